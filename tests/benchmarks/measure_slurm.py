"""Measure what a run through Slurm costs more than the same run on this machine.

    python tests/benchmarks/measure_slurm.py --recordings 120 1200
    python tests/benchmarks/measure_slurm.py --recordings 360 --particles 20 --iterations 20

Each archive is simulated and run from nothing in three ways: locally, as one Slurm job that runs
everything on its node, and through profiles/slurm. A cluster of one node is started in a temporary
folder (Debian: slurm-wlm munge). The CPU time is that of all processes: the daemons of Slurm, the
jobs, and Snakemake on the login node. The results of all ways must be equal to the byte.
"""

import argparse
import contextlib
import ctypes
import os
import platform
import resource
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "workflow" / "scripts"), str(Path(__file__).parent)]

from measure_growth import make_project

from support.project import Project, Run
from support.slurm import WITHOUT_ACCOUNTING, SingleNodeSlurm, missing_reason

# Option of prctl(2): processes that have lost their parent become children of this one.
SET_CHILD_SUBREAPER = 36


def adopt_orphans() -> None:
    """Make this process the parent of all processes below it that lose their own parent.

    slurmd detaches the processes of its jobs. As adopted children they are counted when they end,
    which needs neither a cgroup nor root.
    """
    if ctypes.CDLL(None, use_errno=True).prctl(SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl cannot set a child subreaper")


def cpu_of_children() -> float:
    """Return the CPU time of all children of this process; wait until each has ended."""
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run_locally(project: Project, folder: Path, slots: int) -> Run:
    """Run the workflow on this machine."""
    return project.snakemake(cores=slots)


def run_as_one_job(project: Project, folder: Path, slots: int) -> Run:
    """Run the workflow as one Slurm job that has all slots of a node."""
    with SingleNodeSlurm(folder, slots) as cluster:
        log = folder / "job.log"
        call = f"{sys.executable} -m snakemake -c{slots}"
        cluster.ask(
            "sbatch", "--wait", f"--chdir={project.folder}", f"--cpus-per-task={slots}",
            f"--output={log}", f"--wrap={call}",
        )  # fmt: skip
        return Run(0, log.read_text(encoding="utf-8"))


def run_through_profile(project: Project, folder: Path, slots: int) -> Run:
    """Run the workflow through profiles/slurm."""
    with SingleNodeSlurm(folder, slots) as cluster:
        return project.snakemake(
            "--profile=profiles/slurm",
            *WITHOUT_ACCOUNTING,
            cores=slots,
            environment=cluster.environment,
        )


WAYS = {
    "local": run_locally,
    "one Slurm job": run_as_one_job,
    "profiles/slurm": run_through_profile,
}


def seconds_of(way: str, project: Project, folder: Path, slots: int) -> tuple[Run, float, float]:
    """Return the run, its wall time and its CPU time, both in seconds; it must succeed."""
    cpu, start = cpu_of_children(), time.perf_counter()
    run = WAYS[way](project, folder, slots)
    elapsed = time.perf_counter() - start
    if run.status != 0:
        raise SystemExit(f"{way}: snakemake failed:\n{run.output[-3000:]}")
    return run, elapsed, cpu_of_children() - cpu


def differing(one: Project, other: Project) -> list[str]:
    """Return the names of the results that differ; the report tells of its own run."""
    first, second = one.result_bytes(), other.result_bytes()
    return [
        name
        for name in sorted({*first, *second})
        if not name.startswith("report") and first.get(name) != second.get(name)
    ]


def main() -> None:
    """Measure and print one row an archive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--recordings", type=int, nargs="+", default=[1200])
    add("--particles", type=int, default=2000, help="N of the fit")
    add("--iterations", type=int, default=2000, help="M of the fit")
    add("--ways", nargs="+", choices=list(WAYS), default=list(WAYS), help="beside local")
    add("--slots", type=int, default=4, help="processors of the node, and of the local run")
    arguments = parser.parse_args()
    if reason := missing_reason():
        raise SystemExit(reason)
    adopt_orphans()
    fit = {"particles": arguments.particles, "iterations": arguments.iterations}
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    print(f"{arguments.slots} slots, N = {fit['particles']}, M = {fit['iterations']}\n")
    names = ["recordings", "way", "Slurm jobs", "CPU", "CPU / local", "wall"]
    print("| " + " | ".join(names) + " |\n|---:|---" + "|---:" * (len(names) - 2) + "|")
    for recordings in arguments.recordings:
        with tempfile.TemporaryDirectory() as temporary:
            measure_archive(Path(temporary), recordings, fit, arguments)


def measure_archive(
    folder: Path, recordings: int, fit: dict[str, int], arguments: argparse.Namespace
) -> None:
    """Measure one archive, and print one row a way."""
    new = make_project(folder / "new", recordings, fit)
    local, local_cpu = None, 0.0
    for number, way in enumerate(dict.fromkeys(["local", *arguments.ways])):
        project = new.copy(folder / f"project-{number}")
        run, wall, cpu = seconds_of(way, project, folder / f"slurm-{number}", arguments.slots)
        if local is None:
            local, local_cpu = project, cpu
        if names := differing(local, project):
            raise SystemExit(f"{way}: {len(names)} results differ: {', '.join(names[:5])}")
        jobs = run.output.count("has been submitted with SLURM jobid")
        jobs += way == "one Slurm job"
        cells = [f"{recordings:,}", way, f"{jobs}", f"{cpu:.0f} s"]
        cells += [f"{cpu / local_cpu:.2f}", f"{wall:.0f} s"]
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
