"""The order of verdicts in a table, and the text of their cells."""

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from capsule.kinds import Row

AnyRow = TypeVar("AnyRow", bound=Row)


def by_detector(rows: Iterable[Row], turn: Callable[[str], Any]) -> list[Row]:
    """Return verdicts sorted by detector (in order of appearance), then by recording.

    Parameters
    ----------
    rows : iterable of mapping
        Rows with ``detector`` and ``recording``; rows with the same two keep their order.
    turn : callable
        ``turn(recording)`` returns the key by which recordings are sorted; no two have the same.

    Returns
    -------
    list of mapping
    """
    rows = list(rows)
    detectors, recordings = (
        dict.fromkeys(row[column] for row in rows) for column in ("detector", "recording")
    )
    return in_order(rows, detector=detectors, recording=sorted(recordings, key=turn))


def in_order(rows: Iterable[AnyRow], **orders: Iterable[str]) -> list[AnyRow]:
    """Return rows sorted by columns, the first one first.

    Parameters
    ----------
    rows : iterable of mapping
        Rows with the same cells in these columns keep their order.
    **orders : iterable of str
        All cells of each column, in their order.

    Returns
    -------
    list of mapping
    """
    turns = {
        column: {cell: turn for turn, cell in enumerate(order)} for column, order in orders.items()
    }
    return sorted(rows, key=lambda row: [turn[row[column]] for column, turn in turns.items()])


def as_text(rows: Iterable[Row]) -> list[dict[str, str]]:
    """Return rows as if read from a file: every cell as text, empty if unknown."""
    return [{name: _cell(value) for name, value in row.items()} for row in rows]


def number(text: str) -> float:
    """Return the number in a cell or header line; NaN if it is not a number."""
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _cell(value: object) -> str:
    # Only NaN differs from itself.
    return "" if value is None or value != value else str(value)
