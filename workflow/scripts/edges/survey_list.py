"""The folders under sessions/, by their names alone, and what changes with their content.

Imports nothing heavy: the Snakefile asks at every start.
"""

import hashlib
from pathlib import Path

from capsule.survey.session_names import FILES, Surveys, classify_sessions
from edges.files import fingerprint

# A survey of 10 m has some 200 000 samples, 60 bytes each.
LARGEST_BYTES = 50_000_000


def list_surveys(sessions: Path) -> Surveys:
    """List the surveys under sessions/, without opening any; there need not be such a folder."""
    folders = {}
    for folder in sessions.iterdir() if sessions.is_dir() else ():
        try:
            if folder.is_dir():
                folders[folder.name] = {path.name for path in folder.iterdir()}
        except OSError:
            # Without its names it counts as a folder that holds nothing.
            folders[folder.name] = set()
    return classify_sessions(folders)


def survey_content(folder: Path) -> str:
    """Return what changes when a file of a survey changes, whatever its time stamp says."""
    checksums = [fingerprint(folder / name, LARGEST_BYTES) for name in FILES]
    return hashlib.sha256("\0".join(checksums).encode()).hexdigest()
