"""The order of verdicts in a table, and the text of their cells."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from capsule.kinds import Row


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
    detectors = {name: place for place, name in enumerate(dict.fromkeys(_of(rows, "detector")))}
    recordings = {
        name: place for place, name in enumerate(sorted(set(_of(rows, "recording")), key=turn))
    }
    return sorted(rows, key=lambda row: (detectors[row["detector"]], recordings[row["recording"]]))


def _of(rows: Iterable[Row], column: str) -> Iterator[str]:
    return (row[column] for row in rows)


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
