"""Try many random sequences of edits, settings, failed jobs, kills, dates and dry runs.

    python tests/benchmarks/try_mishaps.py --sequences 300 --at-once 2

The seed of a sequence gives its mishaps between two calls of snakemake. After each sequence, a call
gives exactly the results of a new run, and the next call does nothing. Results that are damaged
from outside are no part of this: nobody looks for them. The table tells how often each mishap
happened; what failed is kept below the folder that the last line names.
"""

import argparse
import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import psutil
from tables import table

from capsule.recordings.recording import format_recording
from support.project import Project
from support.synthetic import make_recording

# The results of a run before the figures. The figures would take most of the time.
TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
SAMPLES = 400
SCRIPTS = ["preprocess", "list", "fit", "describe", "plot", "templates", "evaluate", "detect"]


def made(size_mm: float, name: str) -> bytes:
    """Return the content of a recording, another one for each name."""
    return format_recording(make_recording(size_mm, name, samples=SAMPLES))


# Contents of raw/, and changes of the configuration. The first of each is that of the project.
FIRST = {
    "0mm/r01": made(0.0, "0mm/r01"),
    "3mm/r01": made(3.0, "3mm/r01"),
    "3mm/r02": made(3.0, "3mm/r02"),
    "unlabelled/patient": made(0.0, "unlabelled/patient"),
}
EDITIONS: list[dict[str, bytes]] = [
    FIRST,
    FIRST | {"3mm/r02": made(3.0, "3mm/other")},
    FIRST | {"3mm/r02": b""},
    FIRST | {"3mm/r03": made(3.0, "3mm/r03")},
    FIRST | {"0mm/r01": made(0.0, "0mm/other"), "unlabelled/patient": made(4.0, "4mm/other")},
    FIRST | {"3mm/r01": FIRST["3mm/r02"], "3mm/r02": FIRST["3mm/r01"]},
]
SETTINGS: list[dict[str, dict[str, object]]] = [
    {},
    {"fit": {"seed": 2}},
    {"evaluation": {"tolerance_mm": 2.0}},
    {"preprocessing": {"window": 40}},
]


class Sequence:
    """One sequence of mishaps, with its own copy of a project that was run once.

    The same seed does not give the same moment of a kill.
    """

    def __init__(self, base: Project, folder: Path, seed: int) -> None:
        self.numbers, self.told = random.Random(seed), list[str]()
        self.base, self.project = base, base.copy(folder)

    def try_all(self) -> str:
        """Try two to five mishaps and a run; return the fault, which is empty if there is none."""
        for mishap in self.numbers.choices(MISHAPS, k=self.numbers.randint(2, 5)):
            self.told.append(mishap(self) or mishap.__name__)
        fault = self.end()
        if not fault:
            shutil.rmtree(self.project.folder)
        return fault

    def edit(self, edition: Mapping[str, bytes] | None = None) -> None:
        """Change raw/ to another edition, or to the one given; what is there stays as it is.

        What changes sometimes has an old time stamp, or a new one.
        """
        edition = edition or self.numbers.choice(EDITIONS[1:])
        step_s = self.numbers.choice([0.0, 0.0, -1e9, 1e6])
        for name in sorted(set().union(*EDITIONS)):
            path = self.project.raw / f"{name}.csv"
            if name not in edition:
                path.unlink(missing_ok=True)
            elif not path.exists() or path.read_bytes() != edition[name]:
                path.write_bytes(edition[name])
                os.utime(path, (time.time() + step_s,) * 2)

    def change_settings(self, settings: Mapping[str, object] | None = None) -> None:
        """Change a setting, or those given, and the largest number of recordings of a job."""
        config = "config/config.yaml"
        shutil.copyfile(self.base.folder / config, self.project.folder / config)
        chosen = self.numbers.choice(SETTINGS[1:]) if settings is None else settings
        self.project.configure(**chosen, recordings_per_job=self.numbers.choice([1, 2, 100]))

    def go_back(self) -> None:
        """Change raw/ and the settings back to the first state."""
        self.edit(FIRST)
        self.change_settings({})

    def date(self) -> None:
        """Change the time stamp of a recording to the past or to the future."""
        path = self.numbers.choice(sorted(self.project.raw.rglob("*.csv")))
        step_s = self.numbers.choice([-1e6, -3600.0, 600.0, 1e6])
        os.utime(path, (time.time() + step_s,) * 2)

    def delete(self) -> None:
        """Delete a result; in every other case, one that the call at the end asks for."""
        made = [f"results/{name}" for name in self.project.result_bytes()]
        name = self.numbers.choice(self.numbers.choice([TABLES, made or TABLES]))
        (self.project.folder / name).unlink(missing_ok=True)

    def plan(self) -> None:
        """Call a dry run."""
        run = self.project.snakemake("--dry-run", *TABLES)
        assert run.status == 0, run.output

    def fail(self) -> None:
        """Run while a script raises an error; then the script is as before."""
        script = self.project.folder / f"workflow/scripts/{self.numbers.choice(SCRIPTS)}.py"
        whole = script.read_bytes()
        script.write_bytes(b"raise SystemExit('error: a fault of the tests')\n" + whole)
        self.project.snakemake(*TABLES, *self.numbers.choice([[], ["--keep-going"]]))
        script.write_bytes(whole)

    def kill(self) -> str:
        """Kill a run with all its jobs, Snakemake but not its jobs, or one job, at some moment.

        The moment is some time after a number of jobs have begun, so the moments spread over the
        run, even on a busy computer. With 0 jobs, it is during the start of Snakemake.
        """
        if self.project.snakemake("--dry-run", *TABLES).did_nothing:
            self.edit()  # otherwise there is no job to kill
        strikes = {"a run": kill_run, "Snakemake": subprocess.Popen.kill, "a job": self._kill_job}
        what, strike = self.numbers.choice(list(strikes.items()))
        jobs, begun = self.numbers.randint(0, 6), 0
        with self.project.start(*TABLES, cores=2) as process:
            longest_s = 0.5 if jobs else 1.5
            timer = threading.Timer(self.numbers.uniform(0.0, longest_s), strike, [process])
            if jobs == 0:
                timer.start()
            for line in process.stdout or []:
                begun += " of " in line.partition(": ")[0]
                if jobs and begun == jobs:
                    timer.start()
                    jobs = 0
            # After the end, another process could have the same number.
            timer.cancel()
            if timer.ident is not None:
                timer.join()
        return f"kill of {what}{'' if process.returncode else ', too late'}"

    def _kill_job(self, process: subprocess.Popen[str]) -> None:
        while process.poll() is None:
            # A process of the list may end before it is asked.
            with contextlib.suppress(psutil.NoSuchProcess):
                children = psutil.Process(process.pid).children(recursive=True)
                if at_work := list(filter(is_job, children)):
                    self.numbers.choice(at_work).kill()
                    return
            time.sleep(0.005)

    def end(self) -> str:
        """Run snakemake as a user does; return the fault, or an empty text."""
        fresh = self.base.copy(self.project.folder.with_suffix(".fresh"), results=False)
        for part in ("raw", "config"):
            shutil.rmtree(fresh.folder / part)
            shutil.copytree(self.project.folder / part, fresh.folder / part)
        run = fresh.snakemake(*TABLES)
        assert run.status == 0, run.output
        expected = fresh.result_bytes()
        shutil.rmtree(fresh.folder)
        # As the default target does, but for the figures and the page, which take most of the time.
        wanted = [f"results/{name}" for name in expected]
        run = self.project.snakemake(*wanted)
        if run.status != 0:
            return f"the run stopped:\n{run.output[-3000:]}"
        results = self.project.result_bytes()
        if other := [name for name in expected if results.get(name) != expected[name]]:
            return f"other than in a fresh run: {', '.join(other)}"
        again = self.project.snakemake(*wanted)
        return "" if again.did_nothing else f"the next call did something:\n{again.output[-3000:]}"


MISHAPS = [Sequence.edit, Sequence.change_settings, Sequence.kill] * 3
MISHAPS += [Sequence.go_back, Sequence.fail] * 2 + [Sequence.date, Sequence.delete, Sequence.plan]


def kill_run(process: subprocess.Popen[str]) -> None:
    """Kill Snakemake and all its jobs; the last one may have ended just before."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def is_job(process: psutil.Process) -> bool:
    """Return whether a process runs a script; its shell names one in the midst of a command."""
    return any(word.endswith(".py") and "/scripts/" in word for word in process.cmdline())


def main() -> None:
    """Try the sequences, tell of each that fails, and sum up."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--sequences", type=int, default=300, metavar="N", help="how many (default: 300)")
    add("--first-seed", type=int, default=1000, metavar="N", help="of the first (default: 1000)")
    add("--at-once", type=int, default=1, metavar="N", help="side by side (default: 1)")
    arguments = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="mishaps-"))
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.sequences)
    happened, failed = Counter[str](), 0
    base = Project.create(folder / "project", list(FIRST), SAMPLES, particles=10, iterations=10)
    run = base.snakemake(*TABLES)
    assert run.status == 0, run.output

    def tried(seed: int) -> tuple[Sequence, str]:
        sequence = Sequence(base, folder / f"seed-{seed}", seed)
        return sequence, sequence.try_all()

    with ThreadPoolExecutor(arguments.at_once) as pool:
        for seed, (sequence, fault) in zip(seeds, pool.map(tried, seeds), strict=True):
            happened.update(sequence.told)
            failed += bool(fault)
            print(f"seed {seed}: {'; '.join(sequence.told)}: {fault or 'as fresh'}", flush=True)
    print(table([{"mishap": what, "times": str(n)} for what, n in sorted(happened.items())]))
    print(f"{len(seeds)} sequences, {failed} failed; what failed is kept in {folder}")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
