"""Names under sessions/: which folders are finished surveys, and what is passed over.

Imports nothing heavy: the Snakefile lists the surveys at every start.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from capsule.naming import PART, displayed, is_plain, repeated_end

STREAM, EVENTS, PLACES, ABOUT = "stream.csv", "events.jsonl", "places.csv", "session.json"
FILES = (STREAM, EVENTS, PLACES, ABOUT)


@dataclass(frozen=True)
class Surveys:
    """What was found under sessions/.

    Attributes
    ----------
    names : tuple of str
        The finished surveys, sorted.
    passed_over : dict of str to str
        Everything else that could be one, and why; the names as `capsule.naming.displayed`.
    """

    names: tuple[str, ...] = ()
    passed_over: Mapping[str, str] = field(default_factory=dict)


def classify_sessions(folders: Mapping[str, set[str]]) -> Surveys:
    """Sort out what lies under sessions/.

    Parameters
    ----------
    folders : mapping of str to set of str
        Of each folder the names of the files in it.
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
    """Say why a folder is no finished survey; empty for one that is."""
    if not is_plain(name) or repeated_end(name):
        return (
            "rename the folder: only letters A-Z, digits and _ . + - are allowed in its name, at "
            "most 100 of them, the first is a letter or digit, and no end is repeated 20 times"
        )
    if STREAM + PART in files:
        return "not finished; if no survey is running: survey.py --resume"
    missing = [file for file in FILES if file not in files]
    return f"there is no {missing[0]}" if missing else ""
