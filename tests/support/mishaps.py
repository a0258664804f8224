"""Try random sequences of mishaps in a project between two calls of snakemake.

After each sequence, a call gives exactly the results of a new run, and the next call does nothing.
Results that are damaged from outside are no part of this: nobody looks for them.
"""

import os
import random
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from capsule.recordings.recording import format_recording
from support.project import Project
from support.striking import kill_job, kill_run, kill_snakemake, strike_at_random
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
    editions, settings : int
        Number of `EDITIONS` and of `SETTINGS` in use.
    sizes : sequence of int
        Numbers of recordings that one job takes.
    """

    def __init__(
        self,
        base: Project,
        editions: int = len(EDITIONS),
        settings: int = len(SETTINGS),
        sizes: Sequence[int] = SIZES,
    ) -> None:
        self.base = base
        self.editions, self.settings, self.sizes = range(editions), range(settings), sizes
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
        self._choose("edition", self.fresh.editions)
        changed = put_state(self.fresh.base, self.project, self.state)
        step_s = self.numbers.choice([None, None, -1e9, 1e6])
        if step_s is not None:
            for path in changed:
                _date(path, step_s)
            self.told[-1] += f", dated {step_s:+g} s"

    def change_settings(self) -> None:
        """Change a setting, or change it back."""
        self._choose("settings", self.fresh.settings)
        put_state(self.fresh.base, self.project, self.state)

    def change_size(self) -> None:
        """Change the largest number of recordings that one job takes."""
        self._choose("size", self.fresh.sizes)
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
        strike_at_random(process, self.numbers, lambda: strike(process), most_jobs=6)
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


def deal(seed: int, size: int) -> list[list[Callable[[Mishaps], None]]]:
    """Return all mishaps in random order, divided into sequences of a size; the last is shorter."""
    order = random.Random(seed).sample(_MISHAPS, k=len(_MISHAPS))
    return [order[start : start + size] for start in range(0, len(order), size)]


def try_sequence(
    fresh: FreshResults,
    folder: Path,
    seed: int,
    mishaps: Sequence[Callable[[Mishaps], None]] | None = None,
) -> tuple[list[str], str]:
    """Try one sequence of mishaps, and return it with the fault.

    Parameters
    ----------
    fresh : FreshResults
        Holds the first project.
    folder : Path
        Folder of the project's copy; removed if there is no fault.
    seed : int
        Seed of all choices; the same seed does not give the same moment of a kill.
    mishaps : sequence of callable, optional
        Methods of `Mishaps`; by default two to five that the seed chooses.

    Returns
    -------
    told : list of str
        The mishaps.
    fault : str
        The fault at the end; empty if there is none.
    """
    numbers = random.Random(seed)
    sequence = Mishaps(fresh.base.copy(folder), fresh, numbers)
    for mishap in mishaps or numbers.choices(_MISHAPS, k=numbers.randint(2, 5)):
        mishap(sequence)
    fault = sequence.end()
    if not fault:
        shutil.rmtree(folder)
    return sequence.told, fault
