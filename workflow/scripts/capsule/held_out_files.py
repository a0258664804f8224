"""Find out from the recordings themselves which are held out, before the first job.

The Snakefile uses this module at every start, so it imports only fast modules.
"""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from capsule import files
from capsule.errors import RecordingError
from capsule.header_lines import one_line_end, split_header
from capsule.held_out import is_held_out
from capsule.names import as_cell, size_mm

# Bytes that are read of a recording at first; nearly all headers are shorter.
_BEGINNING = 2048


def fitted(
    batches: Mapping[str, Iterable[str]], raw: Path, held_out: Collection[str]
) -> dict[str, list[str]]:
    """Return the recordings of each batch that are fitted: those of nodules that teach.

    The first lines of their files tell which are held out. If no session is held out, no file is
    opened.

    Parameters
    ----------
    batches : mapping of str to iterable of str
        The recordings of each batch of the archive.
    raw : Path
        The folder of recordings.
    held_out : collection of str
        The key ``evaluation.held_out``.

    Returns
    -------
    dict of str to list of str
        Batches without such a recording are left out.
    """
    found = {
        batch: [
            name
            for name in names
            if size_mm(name)
            and not (held_out and is_held_out(name, _session(raw / f"{name}.csv"), held_out))
        ]
        for batch, names in batches.items()
    }
    return {batch: names for batch, names in found.items() if names}


def _session(path: Path) -> str:
    """Return the session of a recording as its table has it; empty if it names none."""
    try:
        return as_cell(_header(path).get("session", ""))
    except (RecordingError, OSError):
        # The recording will be rejected with this reason.
        return ""


def _header(path: Path) -> dict[str, str]:
    """Return the header lines of a recording; read no more of it than they take."""
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
