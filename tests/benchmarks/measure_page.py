"""Measure the report page as the archive grows: making, size, opening and looking further.

    python tests/benchmarks/measure_page.py
    python tests/benchmarks/measure_page.py --recordings 120 1200 --opened 9

The results in results/ are those of a few recordings; every further one is a copy of one of them
under another name, in every file that the report reads. The rates are those of the few.
"""

import argparse
import csv
import hashlib
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "workflow" / "scripts")]

from capsule.engine.configuration import read_config_file
from capsule.page.packing import deflated, inflated, to_json
from capsule.store.batches import described_together
from capsule.store.files import read_csv, read_json, write_json
from capsule.store.results import FITS, MATRICES, PLOT_DATA, Results
from support.browser import MISSING, Browser
from support.stored import rows_of

# Tells when the first recording has been drawn, in ms since the page was asked for.
WATCH = """
new MutationObserver((_, observer) => {
  if (!document.querySelector("#viewer canvas")) return;
  observer.disconnect();
  requestAnimationFrame(() => setTimeout(() => { window.drawnAt = performance.now(); }));
}).observe(document, { childList: true, subtree: true });
"""
DRAWN = """
const done = arguments[0];
const wait = () => (window.drawnAt === undefined ? setTimeout(wait, 20) : done(window.drawnAt));
wait();
"""
LOADED = "return performance.getEntriesByType('navigation')[0].loadEventEnd"
ANOTHER = """
const [name, done] = arguments;
const title = document.getElementById("viewer-title");
const start = performance.now();
const wait = () => {
  if (title.textContent.startsWith(`${name}:`)) setTimeout(() => done(performance.now() - start));
  else requestAnimationFrame(wait);
};
location.hash = `#recording=${name}`;
requestAnimationFrame(wait);
"""


@dataclass(frozen=True)
class Made:
    """Time and memory of the job that makes the page.

    Attributes
    ----------
    seconds, cpu_seconds : float
        From start to finish, and of all its processes.
    memory_mb : float
        Largest memory of a process.
    """

    seconds: float
    cpu_seconds: float
    memory_mb: float


def copies(names: list[str], recordings: int) -> Iterator[tuple[str, str]]:
    """Yield the names of an archive of so many recordings, each with that of its original."""
    for number in range(recordings):
        again, place = divmod(number, len(names))
        yield (f"{names[place]}-{again:03d}" if again else names[place]), names[place]


def replicate(results: Path, target: Path, recordings: int) -> None:
    """Write the results of an archive of so many recordings, all copies of those in `results`."""
    index = read_csv(results / "recordings.csv")
    originals = dict(copies([row["recording"] for row in index], recordings))
    for part in ("evaluation", "figures"):
        shutil.copytree(results / part, target / part)
    for path in results.iterdir():
        if path.is_file() and path.suffix != ".html":
            shutil.copy2(path, target)
    _rewrite(target / "recordings.csv", index, originals)
    predictions = target / "evaluation" / "predictions.csv"
    _rewrite(predictions, read_csv(predictions), originals)
    before, after = (
        Results.of_table(results, results / "recordings.csv"),
        Results(target, rows_of(originals)),
    )
    names = sorted(set(originals.values()))
    fits = before.fits(name for name in names if before.file(FITS, name).exists())
    drawn = before.described(PLOT_DATA, names, read_json)
    for name, original in originals.items():
        link = after.file(MATRICES, name)
        link.parent.mkdir(parents=True, exist_ok=True)
        os.link(before.file(MATRICES, original).resolve(), link)
        if original in fits:
            write_json(after.file(FITS, name), fits[original] | {"recording": name})
    for members in described_together(originals, 1).values():
        of_batch = {
            name: _renamed(drawn[originals[name]], name)
            for name in members
            if originals[name] in drawn
        }
        write_json(after.file(PLOT_DATA, members[0]), of_batch)


def _renamed(plotted: dict[str, str], name: str) -> dict[str, str]:
    """Return the plot data of a recording under another name."""
    drawn = inflated(plotted["drawn"]) | {"recording": name}
    return plotted | {"drawn": deflated(to_json(drawn))}


def _rewrite(path: Path, rows: list[dict[str, str]], originals: dict[str, str]) -> None:
    """Write a table anew with the rows of each original under every copy's name."""
    by_name: dict[str, list[dict[str, str]]] = {}
    for row in rows:
        by_name.setdefault(row["recording"], []).append(row)
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        batches = rows_of(originals)
        for name, original in sorted(originals.items()):
            other = {"recording": name}
            if "sha256" in rows[0]:
                other |= batches[name]
                checksum = hashlib.sha256(name.encode()).hexdigest()
                other |= {"sha256": checksum, "readings_sha256": checksum, "site": name}
            writer.writerows({**row, **other} for row in by_name.get(original, []))


def make_page(results: Path) -> Made:
    """Run the report's job."""
    settings = read_config_file(ROOT / "config" / "config.yaml")
    told = settings | {"surveys": {"names": [], "passed_over": {}}}
    job = [
        str(ROOT / "workflow" / "scripts" / "report.py"),
        "--results", str(results), "--settings", json.dumps(told),
        "--key", "0" * 20, "--output", str(results / "report.html"),
    ]  # fmt: skip
    return cost_of(job)


def cost_of(script: list[str]) -> Made:
    """Run a script with its arguments."""
    start = time.perf_counter()
    process = subprocess.Popen([sys.executable, *script], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    if status != 0:
        raise SystemExit(f"{script[0]} failed")
    return Made(seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def open_browser(profile: Path) -> Browser:
    """Open a browser that tells when a recording is drawn, and counts CPU time."""
    browser = Browser(profile)
    for command, parameters in (
        ("Page.enable", {}),
        ("Page.addScriptToEvaluateOnNewDocument", {"source": WATCH}),
        ("Performance.enable", {"timeDomain": "threadTicks"}),
    ):
        browser.driver.execute_cdp_cmd(command, parameters)
    return browser


def open_page(browser: Browser, page: Path) -> tuple[float, float, float]:
    """Open the page in a process of its own.

    Returns
    -------
    loaded, drawn, cpu : float
        Seconds until its load event, until the first recording is drawn, and the CPU time of the
        thread that reads, lays out and draws, which bears a shared machine.
    """
    browser.open(page)
    drawn = browser.driver.execute_async_script(DRAWN)
    told = browser.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    cpu = next(each["value"] for each in told if each["name"] == "ThreadTime")
    return browser.run(LOADED) / 1000, drawn / 1000, cpu


def show_another(browser: Browser, names: list[str]) -> float:
    """Choose recordings all over the table; give the median of the seconds until each is drawn."""
    took = [browser.driver.execute_async_script(ANOTHER, name) / 1000 for name in names]
    return statistics.median(took)


def main() -> None:
    """Measure and print one row an archive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", type=int, nargs="+", default=[120, 1200, 12000])
    parser.add_argument("--results", type=Path, default=ROOT / "results", help="a finished run's")
    parser.add_argument("--opened", type=int, default=5, help="times; the median counts")
    arguments = parser.parse_args()
    if MISSING:
        raise SystemExit(MISSING)
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}\n")
    heads = ["recordings", "page", "job", "its CPU", "its memory"]
    heads += ["loaded", "drawn", "CPU of opening", "another"]
    print("| " + " | ".join(heads) + " |\n" + "|---:" * len(heads) + "|")
    for recordings in arguments.recordings:
        with tempfile.TemporaryDirectory(dir=arguments.results.resolve().parent) as temporary:
            results = Path(temporary) / "results"
            replicate(arguments.results, results, recordings)
            made, page = make_page(results), results / "report.html"
            names = [row["recording"] for row in read_csv(results / "recordings.csv")]
            chosen = [names[place] for place in np.linspace(1, len(names) - 1, 7).astype(int)]
            browser = open_browser(Path(temporary) / "browser")
            try:
                opened = [open_page(browser, page) for _ in range(arguments.opened)]
                loaded, drawn, cpu = map(statistics.median, zip(*opened, strict=True))
                another = show_another(browser, chosen)
            finally:
                browser.close()
            cells = [f"{recordings:,}", f"{page.stat().st_size / 1e6:.1f} MB"]
            cells += [f"{made.seconds:.1f} s", f"{made.cpu_seconds:.1f} s"]
            cells += [f"{made.memory_mb:.0f} MB", f"{loaded:.2f} s", f"{drawn:.2f} s"]
            cells += [f"{cpu:.2f} s", f"{another:.2f} s"]
            print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
