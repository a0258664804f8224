"""Try random sequences of mishaps in a project between two calls of snakemake.

After each sequence, one call must give exactly the results of a new run, and the next call must do
nothing.
"""

import os
import random
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from capsule.recording import format_recording
from support.preloaded import ForkedCall, PreloadedSnakemake
from support.project import Project
from support.striking import kill_job, kill_run, kill_snakemake, strike_at_random
from support.synthetic import make_recording

RECORDINGS = ["0mm/r01", "3mm/r01", "3mm/r02", "unlabelled/patient"]
# The results of a run before the figures. The figures would take most of the time.
TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
_SAMPLES = 400
DAMAGES = {
    "deleted": lambda content: None,
    "emptied": lambda content: b"",
    "cut short": lambda content: content[: len(content) // 2],
    "overwritten": lambda content: b"\x00 garbage",
    "one bit flipped": lambda content: bytes([content[0] ^ 1]) + content[1:],
}


def create_project(folder: Path, preloaded: PreloadedSnakemake) -> Project:
    """Make a small project, run it once, and return it; sequences begin with copies of it."""
    project = Project.create(folder, RECORDINGS, samples=_SAMPLES, particles=10, iterations=10)
    project.preloaded = preloaded
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    return project


def _other(size_mm: float, name: str) -> bytes:
    return format_recording(make_recording(size_mm, name, samples=_SAMPLES))


# States of raw/ that an edit can make; each lists its differences from the first state.
EDITIONS: list[dict[str, bytes]] = [
    {},
    {"3mm/r02": _other(3.0, "3mm/other")},
    {"3mm/r02": b""},
    {"3mm/r03": _other(3.0, "3mm/r03")},
    {"0mm/r01": _other(0.0, "0mm/other"), "unlabelled/patient": _other(4.0, "4mm/other")},
    {"3mm/r01": _other(3.0, "3mm/r02"), "3mm/r02": _other(3.0, "3mm/r01")},
]


def put_edition(base: Project, project: Project, edition: Mapping[str, bytes]) -> list[Path]:
    """Change raw/ to another state; return the recordings that were written."""
    changed = []
    for name in sorted({name for each in EDITIONS for name in each}):
        path, original = project.raw / f"{name}.csv", base.raw / f"{name}.csv"
        content = edition.get(name, original.read_bytes() if original.exists() else None)
        if content is None:
            path.unlink(missing_ok=True)
        elif not path.exists() or path.read_bytes() != content:
            path.write_bytes(content)
            changed.append(path)
    return changed


def results_of(project: Project) -> dict[str, bytes]:
    """Return every result, except those of recordings that were removed."""
    gone = [
        name for each in EDITIONS for name in each if not (project.raw / f"{name}.csv").exists()
    ]
    return {
        name: content
        for name, content in project.result_bytes().items()
        if not any(recording in name for recording in gone)
    }


class FreshResults:
    """The results of a new run for each state of raw/; each run is made once.

    Parameters
    ----------
    base : Project
        Project from `create_project`.
    editions : int
        Number of `EDITIONS` in use; each needs a new run.
    """

    def __init__(self, base: Project, editions: int = len(EDITIONS)) -> None:
        self.base, self.editions = base, EDITIONS[:editions]
        self._made = {0: results_of(base)}
        self._lock = threading.Lock()

    def of(self, edition: int) -> dict[str, bytes]:
        """Return the results for one state, by its place in `EDITIONS`."""
        with self._lock:
            if edition not in self._made:
                with tempfile.TemporaryDirectory() as folder:
                    project = self.base.copy(Path(folder) / "fresh")
                    shutil.rmtree(project.results)
                    shutil.rmtree(project.folder / ".snakemake")
                    put_edition(self.base, project, self.editions[edition])
                    run = project.snakemake(*TABLES)
                    assert run.status == 0, run.output
                    self._made[edition] = results_of(project)
            return self._made[edition]


@dataclass
class Sequence:
    """One sequence of mishaps, with its own project.

    Attributes
    ----------
    project : Project
        The project.
    fresh : FreshResults
        The results that the sequence must end with.
    numbers : Random
        Random numbers for all choices.
    edition : int
        The state of raw/, by its place in `EDITIONS`.
    told : list of str
        The mishaps so far.
    """

    project: Project
    fresh: FreshResults
    numbers: random.Random
    edition: int = 0
    told: list[str] = field(default_factory=list)

    def edit(self) -> None:
        """Change raw/ to another state, or back; sometimes with old time stamps."""
        others = set(range(len(self.fresh.editions))) - {self.edition}
        self.edition = self.numbers.choice(sorted(others))
        changed = put_edition(self.fresh.base, self.project, EDITIONS[self.edition])
        old = self.numbers.random() < 0.3
        for path in changed if old else []:
            os.utime(path, (1e9, 1e9))
        self.told.append(f"edition {self.edition}" + ", dated long ago" * old)

    def step_clock(self) -> None:
        """Change the time stamp of a recording to the past or to the future."""
        path = self.numbers.choice(sorted(self.project.raw.rglob("*.csv")))
        step_s = self.numbers.choice([-1e6, -3600.0, 600.0, 1e6])
        os.utime(path, (time.time() + step_s,) * 2)
        self.told.append(f"{path.stem} dated {step_s:+g} s")

    def damage(self) -> None:
        """Damage a result."""
        results = self.project.results
        sets = [path.relative_to(results).as_posix() for path in results.glob("sets/*/*/*/*")]
        if names := sorted([*self.project.result_bytes(), *sets]):
            name, how = self.numbers.choice(names), self.numbers.choice(sorted(DAMAGES))
            path = self.project.results / name
            content = DAMAGES[how](path.read_bytes())
            path.unlink() if content is None else path.write_bytes(content)
            self.told.append(f"{name} {how}")

    def lose_notes(self) -> None:
        """Delete the notes of Snakemake or the records."""
        folders = [self.project.folder / ".snakemake", self.project.results / "records"]
        folder = self.numbers.choice(folders)
        shutil.rmtree(folder, ignore_errors=True)
        self.told.append(f"{folder.name} lost")

    def change_sets(self) -> None:
        """Change the largest number of recordings that one job makes."""
        most = self.numbers.choice([1, 2, 100])
        self.project.configure(recordings_per_job=most)
        self.told.append(f"{most} recordings per job")

    def kill_run(self) -> None:
        """Kill a run with all its jobs."""
        self._run_and_strike("run", kill_run)

    def kill_snakemake(self) -> None:
        """Kill Snakemake, but not its jobs."""
        self._run_and_strike("snakemake", kill_snakemake)

    def kill_job(self) -> None:
        """Kill a single job while other jobs run."""
        self._run_and_strike("job", lambda process: kill_job(process, self.numbers))

    def _run_and_strike(
        self, what: str, strike: Callable[[subprocess.Popen[str] | ForkedCall], None]
    ) -> None:
        if not self.told or self.told[-1].endswith("ended"):
            self.edit()  # otherwise there is nothing to do, so no job to kill
        process = self.project.start(*TABLES, cores=2)
        strike_at_random(process, self.numbers, lambda: strike(process), most_jobs=6)
        self.told.append(f"{what} killed" if process.returncode else "run had ended")

    def end(self) -> str:
        """Run snakemake as a user does; return the fault, or an empty text."""
        run = self.project.snakemake(*TABLES)
        if run.status != 0:
            return f"the run stopped:\n{run.output[-3000:]}"
        results, expected = results_of(self.project), self.fresh.of(self.edition)
        if results != expected:
            names = sorted(results.keys() | expected.keys())
            other = [name for name in names if results.get(name) != expected.get(name)]
            return f"other than in a fresh run: {', '.join(other)}"
        again = self.project.snakemake(*TABLES)
        return "" if again.did_nothing else f"the next call did something:\n{again.output[-3000:]}"


_MISHAPS = [
    Sequence.edit,
    Sequence.edit,
    Sequence.step_clock,
    Sequence.damage,
    Sequence.damage,
    Sequence.change_sets,
    Sequence.lose_notes,
    Sequence.kill_run,
    Sequence.kill_job,
    Sequence.kill_job,
    Sequence.kill_snakemake,
]


def try_sequence(
    fresh: FreshResults, folder: Path, seed: int, most: int = 5
) -> tuple[list[str], str]:
    """Try one sequence of mishaps, and return it with the fault.

    Parameters
    ----------
    fresh : FreshResults
        Holds the first project.
    folder : Path
        Folder of the project's copy; removed if there is no fault.
    seed : int
        Seed of the mishaps; the same seed does not give the same moment of a kill.
    most : int
        Largest number of mishaps.

    Returns
    -------
    told : list of str
        The mishaps.
    fault : str
        The fault at the end; empty if there is none.
    """
    numbers = random.Random(seed)
    sequence = Sequence(fresh.base.copy(folder), fresh, numbers)
    for mishap in numbers.choices(_MISHAPS, k=numbers.randint(1, most)):
        mishap(sequence)
    fault = sequence.end()
    if not fault:
        shutil.rmtree(folder)
    return sequence.told, fault
