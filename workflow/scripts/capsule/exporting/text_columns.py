"""Convert tables of text into columns of numbers and text, in full precision."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from capsule.evaluation.files import TEXT
from capsule.exporting.column_words import describe
from capsule.exporting.exported import Column, Table

_TRUTH = {"True": True, "False": False}
# Further columns of text; in these, a text can look like a number in every row.
_TEXT = TEXT | {"key", "value", "first", "second", "measure", "no_verdict", "reading_unit"}


def table_of(
    name: str, long_name: str, columns: Sequence[str], rows: Iterable[Mapping[str, Any]]
) -> Table:
    """Return a table made from rows of text cells, such as those of a CSV file.

    Parameters
    ----------
    name, long_name : str
        Name and description of the table.
    columns : sequence of str
        Names of the columns.
    rows : iterable of mapping
        Cells by the column's name; an empty cell is an unknown value.

    Returns
    -------
    Table
    """
    rows = list(rows)
    made = [column_of(each, [row[each] for row in rows]) for each in columns]
    return Table(name, long_name, tuple(made))


def column_of(name: str, cells: Sequence[str]) -> Column:
    """Return a column of numbers if every cell is a number, and otherwise a column of text."""
    unit, long_name = describe(name)
    values = None if name in _TEXT else _numbers(cells)
    if values is None:
        values, unit = np.array(cells, dtype=object), ""
    return Column(name, "" if values.dtype == bool else unit, long_name, values)


def _numbers(cells: Sequence[str]) -> np.ndarray | None:
    if cells and set(cells) <= _TRUTH.keys():
        return np.array([_TRUTH[cell] for cell in cells])
    try:
        return np.array([int(cell) for cell in cells], dtype=np.int64 if cells else np.float64)
    except (ValueError, OverflowError):
        pass
    try:
        # float() restores every number that repr() wrote exactly; pandas may not.
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return None
