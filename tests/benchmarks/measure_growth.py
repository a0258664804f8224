"""Measure the cost of a run as the archive grows: cold run, one recording more, nothing to do.

    python tests/benchmarks/measure_growth.py --recordings 120 1200 --before v0.1.0
    python tests/benchmarks/measure_growth.py --recordings 120 --bare
    python tests/benchmarks/measure_growth.py --recordings 12000 --particles 20 --iterations 20

Each archive is simulated in a temporary copy of the project. With --before, a copy of an earlier
commit does the same, call by call in turn, and a row of ratios follows. A workflow of one rule is
called in turn, too: what a call with nothing to do takes for Snakemake alone. With --bare, the same
commands run once more under `xargs` without Snakemake, stage after stage. With --results, the rows
are added to a CSV table; with --picture, all rows of that table are drawn.

The environment counts: Snakemake imports every plug-in that it finds at each start. Measure in one
that `make report` has made.
"""

import argparse
import csv
import io
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "workflow" / "scripts")]

from matplotlib.figure import Figure

from capsule.figures.style import (
    BLUE,
    COLUMN_WIDTH_IN,
    GREEN,
    ORANGE,
    figure_style,
    render_figure,
)
from support.command import CAPSULE
from support.project import PARTS, Project

# The rules, each after those that it needs.
STAGES = ["preprocess", "list", "list_labelled", "fit", "describe", "templates", "evaluate"]
STAGES += ["detect", "draw", "survey", "report"]
SIZES = ["0", "1", "2", "3", "4", "5"]
# The calls that are measured, each with its colour and mark in the picture.
CALLS = {
    "cold run": (ORANGE, "D"),
    "one more": (BLUE, "o"),
    "nothing to do": (GREEN, "^"),
}
NOW, BEFORE = "now", "before"


@dataclass
class Measured:
    """The calls of one project: seconds by the clock, seconds of CPU and largest memory."""

    project: Project
    seconds: dict[str, list[float]] = field(default_factory=dict)
    cpu: dict[str, list[float]] = field(default_factory=dict)
    memory_mb: float = 0.0

    def call(self, name: str, cores: int) -> None:
        """Call snakemake, and note what it took."""
        seconds, cpu, memory = cost_of(self.project, cores)
        self.seconds.setdefault(name, []).append(seconds)
        self.cpu.setdefault(name, []).append(cpu)
        self.memory_mb = max(self.memory_mb, memory)

    def row(self) -> dict[str, float]:
        """Return the medians of each call, and the largest memory."""
        cells = {}
        for name in CALLS:
            cells[name] = statistics.median(self.seconds[name])
            cells[f"{name}, CPU"] = statistics.median(self.cpu[name])
        return {**cells, "largest process": self.memory_mb}


def unpack(commit: str, folder: Path) -> Path:
    """Unpack the workflow of an earlier commit."""
    packed = subprocess.run(
        ["git", "archive", commit, *PARTS], cwd=ROOT, capture_output=True, check=True
    ).stdout
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(folder, filter="data")
    return folder


def make_project(
    folder: Path, recordings: int, fit: Mapping[str, int], root: Path = ROOT
) -> Project:
    """Copy the project at `root`, and simulate an archive of six sizes."""
    project = Project.create(folder, root=root, **fit)
    simulate(project, recordings // len(SIZES))
    return project


def simulate(project: Project, runs: int, sizes: list[str] = SIZES, seed: int = 1) -> None:
    """Add simulated recordings to a project."""
    command = [*CAPSULE, "simulate", "--force"]
    command += ["--out", str(project.raw), "--runs", str(runs), "--seed", str(seed)]
    subprocess.run([*command, "--sizes", *sizes], check=True, capture_output=True)


def add_recording(project: Project, number: int = 1) -> Path:
    """Add one recording of another session at another site, and return its path."""
    other = Project(project.folder / "other")
    simulate(other, 1, ["3"], seed=1 + number)
    added = project.raw / "3mm" / f"one-more-{number}.csv"
    shutil.copyfile(other.raw / "3mm" / "r01.csv", added)
    shutil.rmtree(other.folder)
    return added


def cost_of(project: Project, cores: int) -> tuple[float, float, float]:
    """Call snakemake, which must succeed.

    Returns
    -------
    tuple of float
        Seconds by the clock, seconds of CPU of all its processes, and the memory of the largest of
        them in MB.
    """
    with tempfile.TemporaryFile("w+") as output:
        start = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, "-m", "snakemake", f"-c{cores}"],
            cwd=project.folder, stdout=output, stderr=output,
        )  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)
        elapsed = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            output.seek(0)
            raise SystemExit(f"snakemake failed:\n{output.read()[-3000:]}")
    cpu = usage.ru_utime + usage.ru_stime
    # At once, since the largest archive takes most of an hour.
    print(f"{project.folder.name}: {elapsed:.1f} s, CPU {cpu:.1f} s", file=sys.stderr, flush=True)
    return elapsed, cpu, usage.ru_maxrss / 1024


def bare_cost(project: Project, cores: int) -> float:
    """Return the seconds that the same commands take under xargs, stage after stage."""
    summary = subprocess.run(
        [sys.executable, "-m", "snakemake", "--detailed-summary", "-c1"],
        cwd=project.folder, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    commands: dict[str, dict[str, None]] = {stage: {} for stage in STAGES}
    for row in csv.DictReader(io.StringIO(summary), delimiter="\t", quoting=csv.QUOTE_NONE):
        commands[row["rule"]][row["shellcmd"]] = None
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


def make_one_rule(folder: Path) -> Project:
    """Make a project whose workflow has one rule."""
    folder.mkdir()
    rule = 'rule all:\n    output:\n        "made",\n    shell:\n        "touch {output}"\n'
    (folder / "Snakefile").write_text(rule, encoding="utf-8")
    return Project(folder)


def measure(
    projects: Mapping[str, Project], one_rule: Project, rounds: int, cores: int
) -> tuple[dict[str, Measured], Measured]:
    """Measure the calls of each project, in turn, so that a busy moment meets all of them.

    Returns
    -------
    tuple of dict and Measured
        The calls of each project by its name, and those of the project with one rule.
    """
    measured, alone = {name: Measured(each) for name, each in projects.items()}, Measured(one_rule)
    for each in [*measured.values(), alone]:
        each.call("cold run", cores)
    for number in range(1, rounds + 1):
        alone.call("nothing to do", cores)
        for each in measured.values():
            each.call("nothing to do", cores)
            add_recording(each.project, number)
            each.call("one more", cores)
    return measured, alone


def cells_of(row: Mapping[str, float]) -> list[str]:
    """Return the cells of a row of the printed table."""
    seconds = [f"{row[name]:.1f} s ({row[f'{name}, CPU']:.1f} s)" for name in CALLS]
    return [*seconds, f"{row['largest process']:.0f} MB"]


def draw_growth(rows: Iterable[Mapping[str, str]]) -> Figure:
    """Draw how long each call takes against the number of recordings, both logarithmic.

    Parameters
    ----------
    rows : iterable of mapping
        Rows of the CSV table; earlier commits are drawn pale and dashed.
    """
    by_code: dict[str, dict[int, Mapping[str, str]]] = {BEFORE: {}, NOW: {}}
    for row in rows:
        by_code[row["code"]][int(row["recordings"])] = row
    with figure_style():
        figure = Figure(figsize=(COLUMN_WIDTH_IN, 3.2), layout="constrained")
        axes = figure.subplots()
        for code, found in by_code.items():
            if not found:
                continue
            recordings = sorted(found)
            look = {"linestyle": "--", "alpha": 0.45} if code == BEFORE else {}
            for call, (colour, mark) in CALLS.items():
                seconds = [float(found[count][call]) for count in recordings]
                label = call if code == NOW else f"{call}, before"
                axes.plot(recordings, seconds, color=colour, marker=mark, ms=4, label=label, **look)
        ticks = sorted({count for found in by_code.values() for count in found})
        axes.set(xscale="log", yscale="log", xlabel="recordings", ylabel="time (s)")
        axes.set_xticks(ticks, [f"{count:,}" for count in ticks], minor=False)
        axes.set_xticks([], minor=True)
        axes.yaxis.set_major_formatter("{x:g}")
        axes.grid(color="#d9d9d9", linewidth=0.5)
        figure.legend(loc="outside upper center", ncols=3)
    return figure


def add_rows(table: Path, rows: Iterable[Mapping[str, object]]) -> None:
    """Replace the rows of the same archives and code in a CSV table, and write it sorted."""
    kept = {}
    if table.exists():
        with table.open(newline="") as stream:
            kept = {(row["code"], row["recordings"]): row for row in csv.DictReader(stream)}
    kept |= {(str(row["code"]), str(row["recordings"])): row for row in rows}
    ordered = sorted(kept.values(), key=lambda row: (int(row["recordings"]), str(row["code"])))
    with table.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(ordered[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(ordered)


def main() -> None:
    """Measure each archive, and print its rows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", type=int, nargs="+", default=[120])
    parser.add_argument("--particles", type=int, default=2000, help="N of the fit")
    parser.add_argument("--iterations", type=int, default=2000, help="M of the fit")
    per_job = {"type": lambda text: text if text == "auto" else int(text), "default": "auto"}
    parser.add_argument("--recordings-per-job", **per_job, help="a number, or auto")
    parser.add_argument("--rounds", type=int, default=3, help="of the calls after the cold run")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--before", metavar="COMMIT", help="an earlier commit to compare with")
    parser.add_argument("--bare", action="store_true", help="also without Snakemake, by xargs")
    parser.add_argument("--results", type=Path, metavar="PATH", help="a CSV table to add to")
    parser.add_argument("--picture", type=Path, metavar="PATH", help="output: that table, drawn")
    arguments = parser.parse_args()
    if arguments.picture and not arguments.results:
        parser.error("--picture draws the table of --results; name it")
    fit = {"particles": arguments.particles, "iterations": arguments.iterations}
    per_job, cores = arguments.recordings_per_job, arguments.cores
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    print(f"-c{cores}, N = {fit['particles']}, M = {fit['iterations']}, {per_job} a job\n")
    print("Seconds by the clock, in brackets seconds of CPU; medians.\n")
    print("| recordings | code | " + " | ".join([*CALLS, "largest process"]) + " |")
    print("|---:|---|" + "---:|" * (len(CALLS) + 1))
    for recordings in arguments.recordings:
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            projects = {}
            if arguments.before:
                earlier = unpack(arguments.before, folder / "unpacked")
                projects[BEFORE] = make_project(folder / BEFORE, recordings, fit, earlier)
            projects[NOW] = make_project(folder / NOW, recordings, fit)
            projects[NOW].configure(recordings_per_job=per_job)
            one_rule = make_one_rule(folder / "one-rule")
            measured, alone = measure(projects, one_rule, arguments.rounds, cores)
            rows = {code: each.row() for code, each in measured.items()}
            for code, row in rows.items():
                print(f"| {recordings:,} | {code} | " + " | ".join(cells_of(row)) + " |")
            if arguments.before:
                ratios = {name: rows[NOW][name] / rows[BEFORE][name] for name in rows[NOW]}
                cells = [f"{ratios[name]:.2f} ({ratios[f'{name}, CPU']:.2f})" for name in CALLS]
                cells.append(f"{ratios['largest process']:.2f}")
                print(f"| {recordings:,} | now / before | " + " | ".join(cells) + " |")
            nothing = statistics.median(alone.seconds["nothing to do"])
            print(f"\nA workflow of one rule with nothing to do: {nothing:.1f} s.\n")
            if arguments.bare:
                bare = bare_cost(projects[NOW], cores)
                share = rows[NOW]["cold run"] / bare
                print(f"\nWithout Snakemake {bare:.1f} s; the cold run took {share:.2f} of it.\n")
            sys.stdout.flush()
        if arguments.results:
            add_rows(
                arguments.results,
                [
                    {"recordings": recordings, "code": code}
                    | {name: f"{value:.2f}" for name, value in row.items()}
                    for code, row in rows.items()
                ],
            )
    if arguments.picture:
        with arguments.results.open(newline="") as stream:
            figure = draw_growth(csv.DictReader(stream))
        arguments.picture.write_bytes(render_figure(figure, "svg", "growth"))


if __name__ == "__main__":
    main()
