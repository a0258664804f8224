"""Which jobs one recording more starts, and when: a chart from Snakemake's own metadata.

    python tests/benchmarks/chart_one_more.py --output docs/one-more.svg

An archive is simulated in a temporary copy of the project, and its report is made. Then one
recording is added, and the report is made again. The chart shows this second run.
"""

import argparse
import base64
import json
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import measure_growth
from matplotlib.figure import Figure

from capsule.arguments import natural
from capsule.figures.style import (
    BLUE,
    GREY,
    INK,
    MUTED,
    ORANGE,
    PAGE_WIDTH_IN,
    figure_style,
    render_figure,
)

SNAKEMAKE = "snakemake"


@dataclass
class Job:
    """One job of a run.

    Attributes
    ----------
    name : str
        The rule, and what tells its jobs apart, from the name of the log.
    start, end : float
        In seconds since the call of snakemake.
    inputs, outputs : set of str
        Names of files.
    """

    name: str
    start: float
    end: float
    inputs: set[str] = field(default_factory=set)
    outputs: set[str] = field(default_factory=set)


def read_jobs(metadata: Path, called: float) -> list[Job]:
    """Read the jobs that started after a call of snakemake, in the order of their starts.

    Snakemake keeps a file for each output. The name of the file is the name of the output in
    base64; a long one is cut into folders, whose names begin with an @.

    Parameters
    ----------
    metadata : Path
        The folder .snakemake/metadata.
    called : float
        When snakemake was called, in seconds since 1970.
    """
    jobs: dict[str, Job] = {}
    for path in filter(Path.is_file, metadata.rglob("*")):
        record = json.loads(path.read_text(encoding="utf-8"))
        if record["starttime"] < called:
            continue
        coded = "".join(part.removeprefix("@") for part in path.relative_to(metadata).parts)
        (log,) = record["log"]
        name = log.removeprefix("results/logs/").removesuffix(".log").replace("/", " ", 1)
        start, end = record["starttime"] - called, record["endtime"] - called
        job = jobs.setdefault(name, Job(name, start, end))
        job.start, job.end = min(job.start, start), max(job.end, end)
        job.inputs |= set(record["input"])
        job.outputs.add(base64.urlsafe_b64decode(coded).decode())
    return sorted(jobs.values(), key=lambda job: job.start)


def critical_path(jobs: Sequence[Job]) -> list[Job]:
    """Return the jobs that the last one waited for, each for the one before, in their order."""
    path = [max(jobs, key=lambda job: job.end)]
    while before := [job for job in jobs if job.outputs & path[0].inputs]:
        path.insert(0, max(before, key=lambda job: job.end))
    return path


def run_one_more(recordings: int, cores: int) -> tuple[list[Job], float]:
    """Make a report, add a recording, and make it again.

    Returns
    -------
    jobs : list of Job
        Of the second run.
    seconds : float
        How long the second run took.
    """
    with tempfile.TemporaryDirectory() as temporary:
        project = measure_growth.make_project(Path(temporary) / "project", recordings, {})
        measure_growth.cost_of(project, cores)
        measure_growth.add_recording(project)
        called = time.time()
        seconds, _, _ = measure_growth.cost_of(project, cores)
        return read_jobs(project.folder / ".snakemake" / "metadata", called), seconds


def draw_jobs(jobs: Sequence[Job], seconds: float, title: str) -> Figure:
    """Draw a bar a job over time, those that the report waited for in another colour.

    Parameters
    ----------
    jobs : sequence of Job
        In the order of their starts.
    seconds : float
        How long the run took.
    title : str
        What was run.
    """
    waited_for = critical_path(jobs)
    first, last = jobs[0].start, max(job.end for job in jobs)
    bars = [(SNAKEMAKE, 0.0, first, GREY), (SNAKEMAKE, last, seconds, GREY)]
    bars += [(job.name, job.start, job.end, BLUE) for job in jobs if job not in waited_for]
    bars += [(job.name, job.start, job.end, ORANGE) for job in waited_for]
    rows = {name: row for row, name in enumerate([SNAKEMAKE, *(job.name for job in jobs)])}
    meanings = {ORANGE: "the report waits for it", BLUE: "beside these", GREY: "before and after"}
    with figure_style():
        figure = Figure(figsize=(PAGE_WIDTH_IN, 0.7 + 0.19 * len(rows)), layout="constrained")
        axes = figure.subplots()
        for name, start, end, colour in bars:
            axes.barh(rows[name], end - start, left=start, height=0.7, color=colour, zorder=4)
            if name != SNAKEMAKE or start == 0:
                look = {"va": "center", "fontsize": 6.5, "color": MUTED}
                # The last label stands on the line of the end.
                ground = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
                axes.text(end, rows[name], f" {end - start:.2f}", bbox=ground, **look)
        for colour, meaning in meanings.items():
            axes.barh(0, 0, color=colour, label=meaning)
        axes.axvline(seconds, color=INK, linewidth=0.6)
        axes.set(xlim=(0, 1.06 * seconds), ylim=(len(rows) - 0.4, -0.6), title=title)
        axes.set_yticks(list(rows.values()), list(rows))
        axes.tick_params(axis="y", length=0)
        axes.set_xlabel("time since the call (s)")
        axes.legend(loc="lower left")
    return figure


def table(jobs: Iterable[Job]) -> str:
    """Lay out the jobs as a table in Markdown."""
    rows = [f"| {job.name} | {job.start:.2f} s | {job.end - job.start:.2f} s |" for job in jobs]
    return "\n".join(["| job | start | time |", "|---|---:|---:|", *rows])


def main() -> None:
    """Run, print the table, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--recordings", type=natural, default=120, metavar="N", help="of the archive")
    add("--cores", type=natural, default=2, metavar="N", help="jobs side by side")
    add("--output", type=Path, required=True, metavar="PATH", help="output: the chart, SVG")
    arguments = parser.parse_args()
    jobs, seconds = run_one_more(arguments.recordings, arguments.cores)
    print(table(jobs))
    archive = f"one recording more in an archive of {arguments.recordings:,}"
    title = f"{archive}: {len(jobs)} jobs in {seconds:.1f} s, {arguments.cores} side by side"
    content = render_figure(draw_jobs(jobs, seconds, title), "svg", "one recording more")
    arguments.output.write_bytes(content)


if __name__ == "__main__":
    main()
