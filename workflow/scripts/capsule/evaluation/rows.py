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
