"""Measure the cost of a run as the archive grows: cold run, one recording more, nothing to do.

    python tests/benchmarks/measure_growth.py --recordings 120 1200
    python tests/benchmarks/measure_growth.py --recordings 12000 --particles 20 --iterations 20
    python tests/benchmarks/measure_growth.py --recordings 120 1200 12000 --opened 5

Each archive is simulated in a temporary copy of the project. A workflow of one rule is called in
turn, too: what a call with nothing to do takes for Snakemake alone. With --opened, the report is
measured instead: a run that makes it, its size, and how long a browser takes to open it; with short
fits. To compare with an earlier commit, measure in a checkout of it as well.

The environment counts: Snakemake imports every plug-in that it finds at each start. Measure in one
that `make report` has made.
"""

import argparse
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from tables import table

from support.browser import MISSING, Browser
from support.command import CAPSULE, output_of
from support.project import Project

CORES = 2
SIZES = ["0", "1", "2", "3", "4", "5"]
ONE_RULE = 'rule all:\n    output:\n        "made",\n    shell:\n        "touch {output}"\n'


class Cost(NamedTuple):
    """Seconds by the clock, seconds of CPU of all processes, and the largest memory of one."""

    seconds: float
    cpu: float
    memory_mb: float


def cost_of(folder: Path, *arguments: str) -> Cost:
    """Call snakemake in a folder; it must succeed."""
    with tempfile.TemporaryFile("w+") as output:
        start = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, "-m", "snakemake", f"-c{CORES}", *arguments],
            cwd=folder, stdout=output, stderr=output,
        )  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)
        elapsed = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            output.seek(0)
            raise SystemExit(f"snakemake failed:\n{output.read()[-3000:]}")
    cpu = usage.ru_utime + usage.ru_stime
    # At once, since the largest archive takes most of an hour.
    print(f"{folder.name}: {elapsed:.1f} s, CPU {cpu:.1f} s", file=sys.stderr, flush=True)
    return Cost(elapsed, cpu, usage.ru_maxrss / 1024)


def row_of(calls: Mapping[str, list[Cost]]) -> dict[str, str]:
    """Return the medians of each call of a folder, and the largest memory."""
    cells = {}
    for name, costs in calls.items():
        seconds, cpu, _ = map(statistics.median, zip(*costs, strict=True))
        cells[name] = f"{seconds:.1f} s ({cpu:.1f} s)"
    most = max(cost.memory_mb for costs in calls.values() for cost in costs)
    return cells | {"largest process": f"{most:.0f} MB"}


def simulate(project: Project, runs: int, sizes: list[str], seed: int, prefix: str = "r") -> None:
    """Add simulated recordings of a session to a project."""
    command = [*CAPSULE, "simulate", "--out", project.raw, "--runs", runs, "--seed", seed]
    output_of(*command, "--prefix", prefix, "--sizes", *sizes)


def make_project(folder: Path, recordings: int, fit: Mapping[str, int]) -> Project:
    """Copy the project, and simulate an archive of six sizes."""
    project = Project.create(folder, **fit)
    simulate(project, recordings // len(SIZES), SIZES, seed=1)
    return project


def measure(project: Project, one_rule: Path, rounds: int) -> dict[str, dict[str, str]]:
    """Measure the calls of both workflows, in turn, so that a busy moment meets both."""
    folders = {"one rule": one_rule, "ours": project.folder}
    costs: dict[str, dict[str, list[Cost]]] = {name: defaultdict(list) for name in folders}
    for number in range(rounds + 1):
        for name, folder in folders.items():
            call = "nothing to do" if number else "cold run"
            costs[name][call].append(cost_of(folder))
            if number and folder is not one_rule:
                simulate(project, 1, ["3"], seed=1 + number, prefix=f"one-more-{number}-")
                costs[name]["one more"].append(cost_of(folder))
    return {name: row_of(each) for name, each in costs.items()}


def open_page(browser: Browser, page: Path) -> tuple[float, float]:
    """Open the page; return seconds until a recording is drawn, and those of the thread's CPU."""
    call = browser.driver.execute_cdp_cmd
    call("Performance.enable", {"timeDomain": "threadTicks"})
    browser.open(page)
    told = call("Performance.getMetrics", {})["metrics"]
    cpu = next(each["value"] for each in told if each["name"] == "ThreadTime")
    return browser.run("return performance.now()") / 1000, cpu


def measure_page(folder: Path, recordings: int, opened: int) -> dict[str, str]:
    """Measure the page of an archive of so many recordings; return its row."""
    project = make_project(folder / "project", recordings, {"particles": 20, "iterations": 20})
    page = project.results / "report.html"
    cost_of(project.folder)
    made = cost_of(project.folder, "--forcerun", "report", "--", "results/report.html")
    browser = Browser(folder / "browser")
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
    """Measure each archive, and print its rows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", type=int, nargs="+", default=[120])
    parser.add_argument("--particles", type=int, default=2000, help="N of the fit")
    parser.add_argument("--iterations", type=int, default=2000, help="M of the fit")
    parser.add_argument("--rounds", type=int, default=3, help="of the calls after the cold run")
    parser.add_argument("--opened", type=int, default=0, metavar="N", help="times of the report")
    arguments = parser.parse_args()
    fit = {"particles": arguments.particles, "iterations": arguments.iterations}
    rows = []
    if arguments.opened and MISSING:
        raise SystemExit(MISSING)
    for recordings in arguments.recordings:
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            if arguments.opened:
                rows.append(measure_page(folder, recordings, arguments.opened))
                continue
            project = make_project(folder / "ours", recordings, fit)
            one_rule = folder / "one-rule"
            one_rule.mkdir()
            (one_rule / "Snakefile").write_text(ONE_RULE, encoding="utf-8")
            measured = measure(project, one_rule, arguments.rounds)
        label = {"recordings": f"{recordings:,}"}
        rows += [label | {"workflow": name} | row for name, row in measured.items()]
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    if not arguments.opened:
        print(f"-c{CORES}, N = {arguments.particles}, M = {arguments.iterations}\n")
        print("Seconds by the clock, in brackets seconds of CPU; medians.")
    print(f"\n{table(rows)}")


if __name__ == "__main__":
    main()
