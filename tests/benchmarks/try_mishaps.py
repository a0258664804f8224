"""Try many random sequences of edits, settings, failed jobs, kills, dates and dry runs.

    python tests/benchmarks/try_mishaps.py --sequences 300 --at-once 2

The seed of a sequence gives its mishaps between two calls of snakemake. After each sequence, a call
gives exactly the results of a new run, and the next call does nothing. Results that are damaged
from outside are no part of this: nobody looks for them. The last line says how many have failed;
what those leave is kept below the folder that it names.
"""

import argparse
import contextlib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from pathlib import Path

import psutil

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "workflow" / "scripts")]

from capsule.recordings.recording import format_recording
from support.project import Project
from support.synthetic import make_recording

RECORDINGS = ["0mm/r01", "3mm/r01", "3mm/r02", "unlabelled/patient"]
# The results of a run before the figures. The figures would take most of the time.
TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
_SAMPLES = 400


def create_project(folder: Path) -> Project:
    """Make a small project, run it once, and return it; sequences begin with copies of it."""
    project = Project.create(folder, RECORDINGS, samples=_SAMPLES, particles=10, iterations=10)
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    return project


def _other(size_mm: float, name: str) -> bytes:
    return format_recording(make_recording(size_mm, name, samples=_SAMPLES))


# Editions of raw/; each lists its differences from the first one.
EDITIONS: list[dict[str, bytes]] = [
    {},
    {"3mm/r02": _other(3.0, "3mm/other")},
    {"3mm/r02": b""},
    {"3mm/r03": _other(3.0, "3mm/r03")},
    {"0mm/r01": _other(0.0, "0mm/other"), "unlabelled/patient": _other(4.0, "4mm/other")},
    {"3mm/r01": _other(3.0, "3mm/r02"), "3mm/r02": _other(3.0, "3mm/r01")},
]


# Changes of the first configuration.
SETTINGS: list[dict[str, dict[str, object]]] = [
    {},
    {"fit": {"seed": 2}},
    {"evaluation": {"tolerance_mm": 2.0}},
    {"preprocessing": {"window": 40}},
]
# Numbers of recordings that one job takes.
SIZES = [1, 2, 100]
SCRIPTS = ["preprocess", "list", "fit", "describe", "plot", "templates", "evaluate", "detect"]
# What a job says whose run was not asked for all results, some of which are missing.
ASKED_FOR_ALL = "does not exist; make all that is missing: snakemake -c2"


@dataclass(frozen=True)
class State:
    """What results depend on.

    Attributes
    ----------
    edition, settings : int
        Places in `EDITIONS` and in `SETTINGS`.
    size : int
        Number of recordings that one job takes.
    """

    edition: int = 0
    settings: int = 0
    size: int = 1


def put_state(base: Project, project: Project, state: State) -> list[Path]:
    """Change raw/ and the configuration to another state; return the recordings that were written.

    What is in that state already is not touched.
    """
    file = "config/config.yaml"
    before = (project.folder / file).read_bytes()
    shutil.copyfile(base.folder / file, project.folder / file)
    project.configure(**SETTINGS[state.settings], recordings_per_job=state.size)
    if (project.folder / file).read_bytes() == before:
        (project.folder / file).write_bytes(before)
    changed, edition = [], EDITIONS[state.edition]
    for name in sorted({name for each in EDITIONS for name in each}):
        path, original = project.raw / f"{name}.csv", base.raw / f"{name}.csv"
        content = edition.get(name, original.read_bytes() if original.exists() else None)
        if content is None:
            path.unlink(missing_ok=True)
        elif not path.exists() or path.read_bytes() != content:
            path.write_bytes(content)
            changed.append(path)
    return changed


class FreshResults:
    """The results of a new run for each state; each run is made once, when it is needed.

    Parameters
    ----------
    base : Project
        Project from `create_project`.
    """

    def __init__(self, base: Project) -> None:
        self.base = base
        self._made: dict[State, dict[str, bytes]] = {State(): base.result_bytes()}
        self._lock = threading.Lock()

    def of(self, state: State) -> dict[str, bytes]:
        """Return the results for one state."""
        with self._lock:
            if state not in self._made:
                with tempfile.TemporaryDirectory() as folder:
                    project = self.base.copy(Path(folder) / "fresh")
                    shutil.rmtree(project.results)
                    shutil.rmtree(project.folder / ".snakemake")
                    put_state(self.base, project, state)
                    run = project.snakemake(*TABLES)
                    assert run.status == 0, run.output
                    self._made[state] = project.result_bytes()
            return self._made[state]


@dataclass
class Mishaps:
    """One sequence of mishaps, with its own project.

    Attributes
    ----------
    project : Project
        The project.
    fresh : FreshResults
        The results that the sequence must end with.
    numbers : Random
        Random numbers for all choices.
    state : State
        The state of raw/ and of the configuration.
    told : list of str
        The mishaps so far.
    """

    project: Project
    fresh: FreshResults
    numbers: random.Random
    state: State = State()
    told: list[str] = field(default_factory=list)

    def edit(self) -> None:
        """Change raw/ to another state, or back; sometimes with old time stamps, or new ones."""
        self._choose("edition", range(len(EDITIONS)))
        changed = put_state(self.fresh.base, self.project, self.state)
        step_s = self.numbers.choice([None, None, -1e9, 1e6])
        if step_s is not None:
            for path in changed:
                _date(path, step_s)
            self.told[-1] += f", dated {step_s:+g} s"

    def change_settings(self) -> None:
        """Change a setting, or change it back."""
        self._choose("settings", range(len(SETTINGS)))
        put_state(self.fresh.base, self.project, self.state)

    def change_size(self) -> None:
        """Change the largest number of recordings that one job takes."""
        self._choose("size", SIZES)
        put_state(self.fresh.base, self.project, self.state)

    def go_back(self) -> None:
        """Change raw/ and the settings back to the first state."""
        self.state = State(size=self.state.size)
        put_state(self.fresh.base, self.project, self.state)
        self.told.append("first state")

    def _choose(self, what: str, among: Sequence[int]) -> None:
        others = [each for each in among if each != getattr(self.state, what)]
        self.state = replace(self.state, **{what: self.numbers.choice(others)})
        self.told.append(f"{what} {getattr(self.state, what)}")

    def date(self) -> None:
        """Change the time stamp of a recording to the past or to the future."""
        path = self.numbers.choice(sorted(self.project.raw.rglob("*.csv")))
        step_s = self.numbers.choice([-1e6, -3600.0, 600.0, 1e6])
        _date(path, step_s)
        self.told.append(f"{path.stem} dated {step_s:+g} s")

    def delete(self) -> None:
        """Delete a result; in every other case, one that the call at the end asks for."""
        made = [f"results/{name}" for name in self.project.result_bytes()]
        name = self.numbers.choice(self.numbers.choice([TABLES, made or TABLES]))
        (self.project.folder / name).unlink(missing_ok=True)
        self.told.append(f"{name} deleted")

    def plan(self) -> None:
        """Call a dry run."""
        run = self.project.snakemake("--dry-run", *TABLES)
        assert run.status == 0, run.output
        self.told.append("dry run")

    def fail(self) -> None:
        """Run while a script raises an error; then the script is as before."""
        name = self.numbers.choice(SCRIPTS)
        script = self.project.folder / f"workflow/scripts/{name}.py"
        whole = script.read_bytes()
        script.write_bytes(b"raise SystemExit('error: a fault of the tests')\n" + whole)
        run = self.project.snakemake(*TABLES, *self.numbers.choice([[], ["--keep-going"]]))
        script.write_bytes(whole)
        assert run.status, run.output
        self.told.append(f"{name} failed")

    def kill_run(self) -> None:
        """Kill a run with all its jobs."""
        self._run_and_strike("run", kill_run)

    def kill_snakemake(self) -> None:
        """Kill Snakemake, but not its jobs."""
        self._run_and_strike("snakemake", kill_snakemake)

    def kill_job(self) -> None:
        """Kill a single job while other jobs run."""
        self._run_and_strike("job", lambda process: kill_job(process, self.numbers))

    def _run_and_strike(self, what: str, strike: Callable[[subprocess.Popen[str]], None]) -> None:
        if self.project.snakemake("--dry-run", *TABLES).did_nothing:
            self.edit()  # otherwise there is no job to kill
        process = self.project.start(*TABLES, cores=2)
        strike_at_random(process, self.numbers, lambda: strike(process))
        self.told.append(f"{what} killed" if process.returncode else "run had ended")

    def end(self) -> str:
        """Run snakemake as a user does; return the fault, or an empty text."""
        expected = self.fresh.of(self.state)
        run = self.project.snakemake(*TABLES)
        if run.status != 0:
            if ASKED_FOR_ALL not in run.output:
                return f"the run stopped:\n{run.output[-3000:]}"
            self.told.append("asked for all results")
        results = self.project.result_bytes()
        if run.status == 0 and (other := _differing(results, expected)):
            return f"other than in a fresh run: {', '.join(other)}"
        # A deleted result can be missing behind results that fit. The default target makes it
        # again, too; the figures and the page of that would take most of the time.
        if missing := [f"results/{name}" for name in expected if name not in results]:
            self.told.append(f"{len(missing)} results were missing")
            run = self.project.snakemake(*missing, *TABLES)
            if run.status != 0:
                return f"the second run stopped:\n{run.output[-3000:]}"
            results = self.project.result_bytes()
            other = _differing(results, expected)
            if other := [*other, *sorted(expected.keys() - results.keys())]:
                return f"after the second run other than in a fresh run: {', '.join(other)}"
        again = self.project.snakemake(*(f"results/{name}" for name in expected))
        return "" if again.did_nothing else f"the next call did something:\n{again.output[-3000:]}"


def _differing(results: Mapping[str, bytes], expected: Mapping[str, bytes]) -> list[str]:
    """Return the results that are there, but other than expected."""
    return [name for name in expected if results.get(name, expected[name]) != expected[name]]


def _date(path: Path, step_s: float) -> None:
    os.utime(path, (time.time() + step_s,) * 2)


_MISHAPS = [
    Mishaps.edit,
    Mishaps.edit,
    Mishaps.change_settings,
    Mishaps.change_settings,
    Mishaps.change_size,
    Mishaps.go_back,
    Mishaps.go_back,
    Mishaps.date,
    Mishaps.delete,
    Mishaps.plan,
    Mishaps.fail,
    Mishaps.fail,
    Mishaps.kill_run,
    Mishaps.kill_job,
    Mishaps.kill_job,
    Mishaps.kill_snakemake,
]


def try_sequence(fresh: FreshResults, folder: Path, seed: int) -> tuple[list[str], str]:
    """Try two to five mishaps, and return them with the fault, which is empty if there is none.

    The same seed does not give the same moment of a kill. The folder of the project's copy is
    removed if there is no fault.
    """
    numbers = random.Random(seed)
    sequence = Mishaps(fresh.base.copy(folder), fresh, numbers)
    for mishap in numbers.choices(_MISHAPS, k=numbers.randint(2, 5)):
        mishap(sequence)
    fault = sequence.end()
    if not fault:
        shutil.rmtree(folder)
    return sequence.told, fault


# A run of few recordings starts its next job within this time, in s, or has no job left.
_PATIENCE_S = 2.0
# Largest number of jobs before a kill.
_MOST_JOBS = 6
_SCRIPT = re.compile(r"\S*workflow/scripts/\w+\.py")


def strike_at_random(
    process: subprocess.Popen[str], numbers: random.Random, strike: Callable[[], None]
) -> None:
    """Read a run's log to its end, and call a function once during the run.

    The moment is a random time after a random number of jobs have begun. So the moments spread over
    the run, even on a busy computer. With 0 jobs, the moment is during the start of Snakemake. If
    the run ends before, the function is not called.
    """
    jobs = numbers.randint(0, _MOST_JOBS)
    timer = threading.Timer(numbers.uniform(0.0, 0.5 if jobs else 1.5), strike)
    begun = 0
    with process:
        if jobs == 0:
            timer.start()
        for line in process.stdout or []:
            begun += bool(re.match(r"\d+ of \d+: ", line))
            if jobs and begun == jobs:
                timer.start()
                jobs = 0
        # After the end, another process could have the same number.
        timer.cancel()
        if timer.ident is not None:
            timer.join()


def kill_run(process: subprocess.Popen[str]) -> None:
    """Kill Snakemake and all its jobs."""
    # The last process of the group may have ended just before.
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def kill_snakemake(process: subprocess.Popen[str]) -> None:
    """Kill only Snakemake; its jobs continue."""
    process.kill()


def kill_job(process: subprocess.Popen[str], numbers: random.Random) -> None:
    """Kill one of the running jobs, as soon as there is one."""
    deadline = time.monotonic() + _PATIENCE_S
    with contextlib.suppress(psutil.NoSuchProcess):
        while time.monotonic() < deadline:
            if at_work := running_jobs(process):
                numbers.choice(at_work).kill()
                return
            time.sleep(0.005)


def running_jobs(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """Return the processes of the scripts that a Snakemake runs.

    Raises
    ------
    psutil.NoSuchProcess
        Snakemake has ended.
    """
    scripts = []
    for child in psutil.Process(process.pid).children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):
            # The shell that calls a script names it behind "-c", in the midst of a command.
            if any(_SCRIPT.fullmatch(argument) for argument in child.cmdline()):
                scripts.append(child)
    return scripts


def main() -> None:
    """Try the sequences, tell of each that fails, and sum up."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--sequences", type=int, default=300, metavar="N", help="how many (default: 300)")
    add("--first-seed", type=int, default=1000, metavar="N", help="of the first (default: 1000)")
    add("--at-once", type=int, default=1, metavar="N", help="side by side (default: 1)")
    arguments = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="mishaps-"))
    first, failed = arguments.first_seed, 0
    started, happened = time.monotonic(), Counter()
    with ThreadPoolExecutor(arguments.at_once) as pool:
        fresh = FreshResults(create_project(folder / "project"))
        tried = {
            pool.submit(try_sequence, fresh, folder / f"seed-{seed}", seed): seed
            for seed in range(first, first + arguments.sequences)
        }
        for done, future in enumerate(as_completed(tried), start=1):
            told, fault = future.result()
            happened.update(each for each in told if each.endswith("killed"))
            failed += bool(fault)
            if fault:
                print(f"seed {tried[future]}: {'; '.join(told)}: {fault}", flush=True)
            elapsed = time.monotonic() - started
            print(f"{done} of {len(tried)}, {failed} failed, {elapsed:.0f} s", flush=True)
    kills = ", ".join(f"{count} times {what}" for what, count in sorted(happened.items()))
    print(f"{len(tried)} sequences, {failed} failed ({kills}); what failed is kept in {folder}")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
