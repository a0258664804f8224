"""Names of folders under sessions/: which are finished surveys, and which are passed over.

This module imports nothing heavy, because the Snakefile lists the surveys at every start.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from capsule.names import PART, displayed, is_plain, repeated_end

STREAM, EVENTS, PLACES, ABOUT = "stream.csv", "events.jsonl", "places.csv", "session.json"
FILES = (STREAM, EVENTS, PLACES, ABOUT)


@dataclass(frozen=True)
class Surveys:
    """The folders under sessions/, sorted into finished surveys and others.

    Attributes
    ----------
    names : tuple of str
        The finished surveys, sorted.
    passed_over : dict of str to str
        Other folders, and why they are passed over. The names are as from
        `capsule.names.displayed`.
    """

    names: tuple[str, ...] = ()
    passed_over: Mapping[str, str] = field(default_factory=dict)


def classify_sessions(folders: Mapping[str, set[str]]) -> Surveys:
    """Return which folders under sessions/ are finished surveys, and why the others are not.

    Parameters
    ----------
    folders : mapping of str to set of str
        Names of the files in each folder.
    """
    names, passed_over = [], {}
    for name, files in sorted(folders.items()):
        if name.startswith("."):
            continue
        if reason := _why_not(name, files):
            passed_over[displayed(name)] = reason
        else:
            names.append(name)
    return Surveys(tuple(names), passed_over)


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
