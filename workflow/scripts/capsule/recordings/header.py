"""Read the header of a recording's file, and no more of the file than the header takes.

The Snakefile uses this module at every start, so it imports only fast modules.
"""

from pathlib import Path

from capsule.errors import RecordingError
from capsule.recordings.names import as_cell
from capsule.recordings.recording import one_line_end, split_header
from capsule.store import files

# Bytes that are read of a recording at first; nearly all headers are shorter.
_BEGINNING = 2048


def session_of(path: Path) -> str:
    """Return the session of a recording as its table has it; empty if it names none."""
    try:
        return as_cell(header_of(path).get("session", ""))
    except (RecordingError, OSError):
        # The recording will be rejected with this reason.
        return ""


def header_of(path: Path) -> dict[str, str]:
    """Return the header lines of a recording; read no more of it than they take.

    Raises
    ------
    RecordingError
        The header cannot be read, or says two things.
    OSError
        The file cannot be read.
    """
    size = _BEGINNING
    while True:
        content = files.read_beginning(path, size)
        # The end may cut a letter in two, or a line.
        lines = one_line_end(content.decode("utf-8-sig", errors="replace")).split("\n")
        if len(content) == size:
            lines.pop()
        header, index = split_header(lines)
        if index < len(lines) or len(content) < size:
            return header
        size *= 8
