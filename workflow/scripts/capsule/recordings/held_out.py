"""Which recordings teach: those of held-out sessions judge only.

A recording is held out if it is labelled and the section ``evaluation`` of the configuration names
its session in ``held_out``. The header line ``# session:`` gives the session. Held-out recordings
judge the detectors, and teach nothing.

The Snakefile uses this module at every start, so it imports only fast modules.
"""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import TypeVar

from capsule.errors import CapsuleError, RecordingError
from capsule.recordings.names import as_cell, size_mm
from capsule.recordings.recording import LONGEST_LINE, one_line_end, split_header
from capsule.store import files

Row = TypeVar("Row", bound=Mapping[str, object])
# Bytes that are read of a recording at first; nearly all headers are shorter.
_BEGINNING = 2048


def is_held_out(recording: str, session: object, held_out: Iterable[str]) -> bool:
    """Return whether a recording is held out.

    Parameters
    ----------
    recording : str
        Its name, such as ``3mm/r07``. A recording of unknown size is not held out.
    session : object
        The session as in the table of recordings; anything but a text is none.
    held_out : iterable of str
        The key ``evaluation.held_out``.
    """
    return size_mm(recording) is not None and any(session == as_cell(each) for each in held_out)


def teaching(rows: Mapping[str, Row], held_out: Iterable[str]) -> dict[str, Row]:
    """Return the rows of a table of recordings without the held-out ones, in the same order.

    Parameters
    ----------
    rows : mapping of str to mapping
        The rows by recording, with ``session``.
    held_out : iterable of str
        The key ``evaluation.held_out``.
    """
    named = list(held_out)
    return {
        name: row for name, row in rows.items() if not is_held_out(name, row.get("session"), named)
    }


def unknown_sessions(rows: Iterable[Mapping[str, object]], held_out: Iterable[str]) -> list[str]:
    """Return the held-out sessions that no labelled recording names, in their order.

    Parameters
    ----------
    rows : iterable of mapping
        Rows of results/recordings.csv.
    held_out : iterable of str
        The key ``evaluation.held_out``.
    """
    named = {row.get("session") for row in rows if size_mm(str(row["recording"])) is not None}
    return [session for session in held_out if as_cell(session) not in named]


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
            and not (held_out and is_held_out(name, session_of(raw / f"{name}.csv"), held_out))
        ]
        for batch, names in batches.items()
    }
    return {batch: names for batch, names in found.items() if names}


def session_of(path: Path) -> str:
    """Return the session of a recording as its table has it; empty if it names none.

    No more of the file is read than its header takes.
    """
    size = _BEGINNING
    try:
        while True:
            content = files.read_beginning(path, size)
            # The end may cut a letter in two, or a line.
            lines = one_line_end(content.decode("utf-8-sig", errors="replace")).split("\n")
            if len(content) == size and len(lines.pop()) > LONGEST_LINE:
                return ""  # the recording will be rejected, so the rest of the file is not read
            header, index = split_header(lines)
            if index < len(lines) or len(content) < size:
                return as_cell(header.get("session", ""))
            size *= 8
    except (RecordingError, OSError):
        # The recording will be rejected with this reason.
        return ""


def recordings_with_fits(table: Path, held_out: Collection[str] = ()) -> list[str]:
    """Read which recordings have fits from which templates are made: those of nodules that teach.

    Such a recording is accepted, shows a wave, and is not held out.

    Parameters
    ----------
    table : Path
        results/recordings.csv or results/labelled.csv.
    held_out : collection of str
        The key ``evaluation.held_out``.

    Returns
    -------
    list of str
        The recordings, in the order of `files.accepted_recordings`.

    Raises
    ------
    CapsuleError
        There is no such recording, so no template can be made.
    """
    accepted = teaching(files.accepted_recordings(table), held_out)
    names = [name for name, row in accepted.items() if size_mm(name) and not row["no_verdict"]]
    if not names:
        listed = {row["recording"]: row for row in files.read_csv(table)}
        judging = listed.keys() - teaching(listed, held_out).keys()
        rows = [(name, _why_not(row, name in judging)) for name, row in listed.items()]
        raise CapsuleError(
            "no recording of a nodule can be used, so no template can be made; put recordings of "
            "nodules into folders such as raw/3mm/"
            + "".join(f"\n  {why[0]}: raw/{name}: {why[1]}" for name, why in rows if why)
        )
    return names


def _why_not(row: Mapping[str, str], held_out: bool) -> tuple[str, str] | None:
    if row["status"] != "accepted":
        return "rejected", row["reason"]
    if held_out:
        return "held out", f"evaluation.held_out names its session {row['session']}"
    return ("not judged", row["no_verdict"]) if row["no_verdict"] else None
