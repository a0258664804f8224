"""Measure the report page as the archive grows: making, size and opening.

    python tests/benchmarks/measure_page.py
    python tests/benchmarks/measure_page.py --recordings 120 1200 --opened 9

Each archive is simulated and judged in a temporary copy of the project, with short fits.
"""

import argparse
import os
import platform
import statistics
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "workflow" / "scripts")]

from measure_growth import cost_of, make_project
from tables import table

from support.browser import MISSING, Browser

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


def open_page(browser: Browser, page: Path) -> tuple[float, float]:
    """Open the page in a process of its own.

    Returns
    -------
    drawn, cpu : float
        Seconds until the first recording is drawn, and the CPU time of the thread that reads, lays
        out and draws, which bears a shared machine.
    """
    browser.open(page)
    drawn = browser.driver.execute_async_script(DRAWN)
    told = browser.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    return drawn / 1000, next(each["value"] for each in told if each["name"] == "ThreadTime")


def measure(folder: Path, recordings: int, opened: int) -> dict[str, str]:
    """Measure the page of an archive of so many recordings; return its row."""
    project = make_project(folder / "project", recordings, {"particles": 20, "iterations": 20})
    page = project.results / "report.html"
    cost_of(project.folder, cores=2)
    made = cost_of(project.folder, "--forcerun", "report", "--", "results/report.html", cores=2)
    browser = open_browser(folder / "browser")
    try:
        each = [open_page(browser, page) for _ in range(opened)]
    finally:
        browser.close()
    drawn, cpu = map(statistics.median, zip(*each, strict=True))
    return {
        "recordings": f"{recordings:,}",
        "page": f"{page.stat().st_size / 1e6:.1f} MB",
        "a run that makes it": f"{made.seconds:.1f} s",
        "its CPU": f"{made.cpu:.1f} s",
        "its memory": f"{made.memory_mb:.0f} MB",
        "drawn": f"{drawn:.2f} s",
        "CPU of opening": f"{cpu:.2f} s",
    }


def main() -> None:
    """Measure, and print one row an archive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", type=int, nargs="+", default=[120, 1200, 12000])
    parser.add_argument("--opened", type=int, default=5, help="times; the median counts")
    arguments = parser.parse_args()
    if MISSING:
        raise SystemExit(MISSING)
    rows = []
    for recordings in arguments.recordings:
        with tempfile.TemporaryDirectory() as temporary:
            rows.append(measure(Path(temporary), recordings, arguments.opened))
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}\n")
    print(table(rows))


if __name__ == "__main__":
    main()
