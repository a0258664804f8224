"""List the surveys under sessions/, and compute a checksum of each survey's files.

The Snakefile uses this module at every start, so it imports only fast modules.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from capsule.errors import CapsuleError
from capsule.recordings.names import PART, displayed, is_plain, repeated_end
from capsule.store.files import fingerprint

STREAM, EVENTS, PLACES, ABOUT = "stream.csv", "events.jsonl", "places.csv", "session.json"
FILES = (STREAM, EVENTS, PLACES, ABOUT)
# A survey of 10 m has some 200 000 samples of 60 bytes.
LARGEST_BYTES = 50_000_000


@dataclass(frozen=True)
class Surveys:
    """The folders under sessions/, sorted into finished surveys and others."""

    names: tuple[str, ...] = ()
    passed_over: Mapping[str, str] = field(default_factory=dict)


def list_surveys(sessions: Path) -> Surveys:
    """Return the surveys under sessions/, and why other folders are none.

    Both are empty if sessions/ does not exist.
    """
    names, passed_over = [], {}
    for name, files in sorted(_folders(sessions).items()):
        if reason := _why_not(name, files):
            passed_over[displayed(name)] = reason
        else:
            names.append(name)
    return Surveys(tuple(names), passed_over)


def _folders(sessions: Path) -> dict[str, set[str]]:
    """Return the names of the files in each visible folder; none for a folder without access."""
    folders = {}
    for folder in sessions.iterdir() if sessions.is_dir() else ():
        try:
            if folder.is_dir() and not folder.name.startswith("."):
                folders[folder.name] = {path.name for path in folder.iterdir()}
        except OSError:
            folders[folder.name] = set()
    return folders


def _why_not(name: str, files: set[str]) -> str:
    """Return why a folder is not a finished survey; empty if it is one."""
    if not is_plain(name) or repeated_end(name):
        return (
            "rename the folder: only letters A-Z, digits and _ . + - are allowed in its name, at "
            "most 100 of them, the first is a letter or digit, and no end is repeated 20 times"
        )
    if STREAM + PART in files:
        return "not finished; if no survey is running, go on with capsule survey --resume"
    missing = [file for file in FILES if file not in files]
    return f"there is no {missing[0]}" if missing else ""


def survey_content(folder: Path) -> str:
    """Return a checksum of a survey's files, which does not depend on their time stamps."""
    checksums = [fingerprint(folder / name, LARGEST_BYTES) for name in FILES]
    return hashlib.sha256("\0".join(checksums).encode()).hexdigest()


def refuse_changed(folder: Path, content: str) -> None:
    """Raise an error if the checksum of a survey's files is another than when the run began.

    Raises
    ------
    CapsuleError
        The message names the folder.
    """
    if survey_content(folder) != content:
        raise CapsuleError(f"{folder} has changed since the run began; run the command again")
