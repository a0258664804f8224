"""List the surveys under sessions/, and compute a checksum of each survey's files.

The Snakefile uses this module at every start, so it imports only fast modules.
"""

import hashlib
from pathlib import Path

from capsule.files import fingerprint
from capsule.survey.session_names import FILES, Surveys, classify_sessions

# A survey of 10 m has some 200 000 samples of 60 bytes.
LARGEST_BYTES = 50_000_000


def list_surveys(sessions: Path) -> Surveys:
    """Return the list of the surveys under sessions/; empty if this folder does not exist."""
    folders = {}
    for folder in sessions.iterdir() if sessions.is_dir() else ():
        try:
            if folder.is_dir():
                folders[folder.name] = {path.name for path in folder.iterdir()}
        except OSError:
            # A folder that cannot be listed counts as empty.
            folders[folder.name] = set()
    return classify_sessions(folders)


def survey_content(folder: Path) -> str:
    """Return a checksum of a survey's files, which does not depend on their time stamps."""
    checksums = [fingerprint(folder / name, LARGEST_BYTES) for name in FILES]
    return hashlib.sha256("\0".join(checksums).encode()).hexdigest()
