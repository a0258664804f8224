"""The demo's folder: simulated labelled recordings, and the settings for the workflow."""

from collections.abc import Iterator
from itertools import count
from pathlib import Path

from capsule import files
from capsule.errors import CapsuleError
from capsule.names import PART, UNLABELLED
from capsule.new import is_taken, own_configuration
from capsule.phantom.command import write_run
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import PlannedRun, planned_runs
from capsule.project import OWN_CONFIG

# Seed of the labelled recordings; played runs have higher seeds.
LABELLED_SEED = 1
# Number of runs of each size in mm: enough to learn from, few enough for a report in seconds.
LABELLED = {0.0: 6, 1.0: 2, 2.0: 2, 3.0: 2, 4.0: 2, 5.0: 2}
_MARK = "SIMULATED.txt"
_TEXT = """Made by `capsule demo`. Everything in this folder is simulated. It shows how the system
works, and nothing about a real gut. Delete the folder whenever you like.
"""


def prepare(folder: Path, phantom: Phantom, sensors: int) -> None:
    """Write the missing files of the demo's folder.

    Parameters
    ----------
    folder : Path
        A new folder, or the folder of an earlier demo.
    phantom : Phantom
        The simulated bench.
    sensors : int
        Number of sensors S.

    Raises
    ------
    CapsuleError
        The folder holds other files.
    """
    if not (folder / _MARK).exists() and is_taken(folder):
        raise CapsuleError(
            f"{folder} exists and was not made by a demo; nothing was written. Choose another "
            "folder: --out FOLDER"
        )
    with files.write_whole(folder / _MARK) as stream:
        stream.write(_TEXT)
    if not (folder / OWN_CONFIG).exists():
        with files.write_whole(folder / OWN_CONFIG) as stream:
            stream.write(own_configuration())
    for run in _labelled():
        path = folder / "raw" / f"{run.name}.csv"
        if not path.exists():
            write_run(path, run, phantom, LABELLED_SEED, sensors)


def next_seed(folder: Path) -> int:
    """Return the lowest seed whose run is not in the demo's folder."""
    taken = {path.name for path in (folder / "raw" / UNLABELLED).glob("*")}
    seeds = count(LABELLED_SEED + 1)
    return next(seed for seed in seeds if not taken & _names(seed))


def run_name(seed: int) -> str:
    """Return the name of the recording of a played run."""
    return f"simulated-{seed}"


def _names(seed: int) -> set[str]:
    return {f"{run_name(seed)}.csv", f"{run_name(seed)}.csv{PART}"}


def _labelled() -> Iterator[PlannedRun]:
    for size_mm, runs in LABELLED.items():
        yield from planned_runs([size_mm], runs, 1)
