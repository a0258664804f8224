"""The order of verdicts in a table, and the numbers in its cells."""

from collections.abc import Iterable
from typing import TypeVar

from capsule.kinds import Row

AnyRow = TypeVar("AnyRow", bound=Row)


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


def number(text: str | float) -> float:
    """Return the number in a cell or header line; NaN if it is not a number."""
    try:
        return float(text)
    except ValueError:
        return float("nan")
