"""The order of the verdicts in a table, and what their cells read as."""

from collections.abc import Callable, Iterable
from typing import Any

from capsule.kinds import Row


def by_detector(rows: Iterable[Row], turn: Callable[[str], Any]) -> list[Row]:
    """Sort verdicts: detectors as they come, and of each detector recordings by their turn.

    Parameters
    ----------
    rows : iterable of mapping
        With ``detector`` and ``recording``; rows of the same two keep their order.
    turn : callable
        ``turn(recording)`` gives what recordings are sorted by.

    Returns
    -------
    list of mapping
    """
    rows = list(rows)
    detectors = list(dict.fromkeys(row["detector"] for row in rows))
    return sorted(rows, key=lambda row: (detectors.index(row["detector"]), turn(row["recording"])))


def as_text(rows: Iterable[Row]) -> list[dict[str, str]]:
    """Write rows as they read from a file of theirs: every cell as text, empty where unknown."""
    return [{name: _cell(value) for name, value in row.items()} for row in rows]


def number(text: str) -> float:
    """Read a cell or header line as a number; what is none is unknown (NaN)."""
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _cell(value: object) -> str:
    # Only NaN differs from itself.
    return "" if value is None or value != value else str(value)
