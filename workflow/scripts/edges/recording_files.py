"""List the files of a recording by stage, and find the recordings whose files do not fit.

The Snakefile uses this module, so it imports only fast modules.
"""

from collections.abc import Iterable
from pathlib import Path

from edges.records import current_key, reason_to_make

# The outputs of the rules preprocess and fit, below results/.
STAGE_FILES = {
    "preprocess": ("signals/{}.npy", "matrices/{}.npy", "checks/{}.json"),
    "fit": ("fits/{}.json",),
}


def recording_files(results: Path, stage: str, name: str) -> list[Path]:
    """Return the paths of a recording's files from one stage.

    Parameters
    ----------
    results : Path
        The folder of results.
    stage : {"preprocess", "fit"}
        The stage.
    name : str
        The recording.
    """
    return [results / pattern.format(name) for pattern in STAGE_FILES[stage]]


def recording_key(results: Path, stage: str, key: str, name: str) -> str:
    """Return the key in the record of a recording's files from one stage.

    The record has the same key whether the recording has a job of its own or shares one. So another
    number of recordings per job makes nothing again.
    """
    return current_key(f"{recording_files(results, stage, name)[0].as_posix()}:{key}")


def reasons_to_make(results: Path, stage: str, key: str, names: Iterable[str]) -> dict[str, str]:
    """Return the recordings whose files of one stage do not fit their records.

    Parameters
    ----------
    results : Path
        The folder of results.
    stage : {"preprocess", "fit"}
        The stage.
    key : str
        Checksum of the stage's settings and code.
    names : iterable of str
        The recordings.

    Returns
    -------
    dict of str to str
        The reason of each such recording, as a clause that follows "because".
    """
    reasons = {}
    for name in names:
        outputs = [path.as_posix() for path in recording_files(results, stage, name)]
        if reason := reason_to_make(recording_key(results, stage, key, name), outputs):
            reasons[name] = reason
    return reasons
