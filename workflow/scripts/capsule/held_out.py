"""Held-out recordings: their sessions judge the detectors, and teach nothing.

A recording is held out if it is labelled and the section ``evaluation`` of the configuration names
its session in ``held_out``. The header line ``# session:`` gives the session.

The Snakefile uses this module at every start, so it imports nothing but `naming`.
"""

from collections.abc import Iterable, Mapping
from typing import TypeVar

from capsule.names import as_cell, size_mm

Row = TypeVar("Row", bound=Mapping[str, object])


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
