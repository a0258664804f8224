"""The order of the verdicts in a table."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any


def by_detector(rows: Iterable[Mapping], turn: Callable[[str], Any]) -> list[Mapping]:
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


def as_text(rows: Iterable[Mapping]) -> list[dict[str, str]]:
    """Write rows as they read from a file of theirs: every cell as text, empty where unknown."""
    return [{name: _cell(value) for name, value in row.items()} for row in rows]


def _cell(value: object) -> str:
    # Only NaN differs from itself.
    return "" if value is None or value != value else str(value)
