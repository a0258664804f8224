"""Measure the cost of a run as the archive grows: parse, dry run, cold run, no-op, one more.

    python tests/benchmarks/measure_growth.py --recordings 120 1200
    python tests/benchmarks/measure_growth.py --recordings 12000 --particles 20 --iterations 20
    python tests/benchmarks/measure_growth.py --recordings 12 120 1200 --picture docs/growth.svg

Each archive is simulated in a temporary copy of the project. With --bare, the same commands run
once more under `xargs` without Snakemake, stage after stage. With --picture, the table is drawn,
too.
"""

import argparse
import os
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "workflow" / "scripts")]

from matplotlib.figure import Figure

from capsule.figures.style import (
    BLUE,
    COLUMN_WIDTH_IN,
    GREEN,
    GREY,
    ORANGE,
    VIOLET,
    figure_style,
    render_figure,
)
from edges.durations import RULES
from support.project import Project

STAGES = [*RULES, "report"]
SIZES = ["0", "1", "2", "3", "4", "5"]
ADDED = "3mm/one-more"
# The calls that are drawn, each with its colour and mark.
LOOKS = {
    "cold run": (ORANGE, "D"),
    "one more": (BLUE, "o"),
    "no-op": (GREEN, "^"),
    "dry run": (VIOLET, "v"),
    "parse": (GREY, "s"),
}


def make_project(folder: Path, recordings: int, fit: dict[str, int]) -> Project:
    """Copy the project and simulate an archive of six sizes."""
    project = Project.create(folder, **fit)
    simulate(project, recordings // len(SIZES))
    return project


def simulate(project: Project, runs: int, sizes: list[str] = SIZES, seed: int = 1) -> None:
    """Add simulated recordings to a project."""
    command = [sys.executable, str(ROOT / "workflow/scripts/simulate.py"), "--force"]
    command += ["--out", str(project.raw), "--runs", str(runs), "--seed", str(seed)]
    subprocess.run([*command, "--sizes", *sizes], check=True, capture_output=True)


def add_recording(project: Project) -> None:
    """Add one recording that the archive does not hold yet."""
    other = Project(project.folder / "other")
    simulate(other, 1, ["3"], seed=2)
    shutil.move(other.raw / "3mm" / "r01.csv", project.raw / f"{ADDED}.csv")
    shutil.rmtree(other.folder)


def cpu_of_children() -> float:
    """Return the CPU time of all processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def seconds_of(project: Project, *arguments: str, cores: int) -> float:
    """Time a call of snakemake; it must succeed."""
    start, cpu = time.perf_counter(), cpu_of_children()
    run = project.snakemake(*arguments, cores=cores)
    elapsed, cpu = time.perf_counter() - start, cpu_of_children() - cpu
    # At once, since the largest archive takes most of an hour; CPU time bears a shared machine.
    call = " ".join(["snakemake", *arguments])
    print(f"{call}: {elapsed:.1f} s, CPU {cpu:.1f} s", file=sys.stderr, flush=True)
    if run.status != 0:
        raise SystemExit(f"snakemake failed:\n{run.output[-3000:]}")
    return elapsed


def bare_seconds(project: Project, cores: int) -> float:
    """Time the same commands under xargs, each stage after the one before."""
    summary = subprocess.run(
        [sys.executable, "-m", "snakemake", "--detailed-summary", "-c1"],
        cwd=project.folder, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    rows = [line.split("\t") for line in summary.splitlines()]
    columns = {name: index for index, name in enumerate(rows[0])}
    commands: dict[str, dict[str, None]] = {stage: {} for stage in STAGES}
    for row in rows[1:]:
        commands.setdefault(row[columns["rule"]], {})[row[columns["shellcmd"]]] = None
    shutil.rmtree(project.results)
    for stage_commands in commands.values():
        for command in stage_commands:
            for target in command.split(" > ")[1:]:
                log = project.folder / target.split()[0]
                log.parent.mkdir(parents=True, exist_ok=True)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = {**os.environ, "PATH": path, "OPENBLAS_NUM_THREADS": "1"}
    start = time.perf_counter()
    for stage_commands in commands.values():
        subprocess.run(
            ["xargs", "-0", "-P", str(cores), "-I{}", "bash", "-c", "{}"],
            input="\0".join(stage_commands), cwd=project.folder, env=environment, text=True,
            check=True,
        )  # fmt: skip
    return time.perf_counter() - start


def draw_growth(measured: dict[int, dict[str, float]]) -> Figure:
    """Draw how long each call takes against the number of recordings, both logarithmic.

    Parameters
    ----------
    measured : dict of int to dict of str to float
        By the number of recordings, the seconds of each call of `LOOKS`.
    """
    recordings = sorted(measured)
    with figure_style():
        figure = Figure(figsize=(COLUMN_WIDTH_IN, 3.2), layout="constrained")
        axes = figure.subplots()
        for call, (colour, mark) in LOOKS.items():
            seconds = [measured[count][call] for count in recordings]
            axes.plot(recordings, seconds, color=colour, marker=mark, markersize=4, label=call)
        axes.set(xscale="log", yscale="log", xlabel="recordings", ylabel="time (s)")
        axes.set_xticks(recordings, [f"{count:,}" for count in recordings], minor=False)
        axes.set_xticks([], minor=True)
        axes.yaxis.set_major_formatter("{x:g}")
        axes.grid(color="#d9d9d9", linewidth=0.5)
        axes.legend()
    return figure


def main() -> None:
    """Measure and print one row an archive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", type=int, nargs="+", default=[120])
    parser.add_argument("--particles", type=int, default=2000, help="N of the fit")
    parser.add_argument("--iterations", type=int, default=2000, help="M of the fit")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--bare", action="store_true", help="also without Snakemake, by xargs")
    parser.add_argument(
        "--picture", type=Path, metavar="PATH", help="output: the table, drawn, SVG"
    )
    arguments = parser.parse_args()
    fit = {"particles": arguments.particles, "iterations": arguments.iterations}
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    print(f"-c{arguments.cores}, N = {fit['particles']}, M = {fit['iterations']}\n")
    names = ["parse", "dry run", "cold run", "a recording", "no-op", "one more", "largest process"]
    names += ["bare", "cold / bare"] if arguments.bare else []
    print("| recordings | " + " | ".join(names) + " |\n" + "|---:" * (len(names) + 1) + "|")
    measured = {}
    for recordings in arguments.recordings:
        with tempfile.TemporaryDirectory() as temporary:
            project = make_project(Path(temporary) / "project", recordings, fit)
            cores = arguments.cores
            parse = seconds_of(project, "--list-rules", cores=cores)
            dry = seconds_of(project, "--dry-run", "--quiet", cores=cores)
            cold = seconds_of(project, cores=cores)
            nothing = seconds_of(project, cores=cores)
            add_recording(project)
            more = seconds_of(project, cores=cores)
            seconds = (cold, more, nothing, dry, parse)
            measured[recordings] = dict(zip(LOOKS, seconds, strict=True))
            memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
            cells = [f"{parse:.1f} s", f"{dry:.1f} s", f"{cold:.1f} s"]
            cells += [f"{1000 * cold / recordings:.0f} ms", f"{nothing:.1f} s", f"{more:.1f} s"]
            cells.append(f"{memory:.0f} MB")
            if arguments.bare:
                (project.raw / f"{ADDED}.csv").unlink()
                seconds_of(project, cores=cores)
                bare = bare_seconds(project, cores)
                cells += [f"{bare:.1f} s", f"{cold / bare:.2f}"]
            print(f"| {recordings:,} | " + " | ".join(cells) + " |", flush=True)
    if arguments.picture:
        arguments.picture.write_bytes(render_figure(draw_growth(measured), "svg", "growth"))


if __name__ == "__main__":
    main()
