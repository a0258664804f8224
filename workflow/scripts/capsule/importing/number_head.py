"""Find column names that are numbers, as pandas and numpy write them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from capsule.importing.question import QuestionError
from capsule.importing.source_table import SourceTable

# Least number of columns whose names are taken for names without a question.
_LEAST_NAMES = 3


def without_number_head(table: SourceTable, keys: SimpleNamespace) -> SourceTable:
    """Return a table without a first row of consecutive whole numbers, which are names.

    Parameters
    ----------
    table : SourceTable
        The table; if it has names, it is returned as it is.
    keys : SimpleNamespace
        The keys of lab.yaml, of which ``skip_lines`` is used.

    Raises
    ------
    QuestionError
        If the row can be a sample, too.
    """
    columns = table.columns
    if table.lines is None or len(table.lines) <= 2 or any(column.name for column in columns):
        return table
    cells = ["" if column.texts is None else str(column.texts[0]) for column in columns]
    if not _counts_columns(cells):
        return table
    shown = ",".join(cells)
    place = table.line(0)
    far = is_far(np.array([column.values for column in columns[1:]]))
    if len(columns) >= _LEAST_NAMES and np.mean(far) >= 0.5:
        remark = f"{place}, {shown!r}, is taken for the names of the columns, not for a sample"
        return replace(
            table,
            columns=tuple(column.without_first() for column in columns),
            lines=table.lines[1:],
            remark=remark,
        )
    if keys.skip_lines is None:
        number = int(table.lines[0])
        raise QuestionError(
            f"{place}: {shown!r} can be the names of the columns (--skip-lines {number}) or the "
            f"first sample (--skip-lines {number - 1}); choose one"
        )
    return table


def _counts_columns(cells: list[str]) -> bool:
    """Return whether cells count from 0 or 1; the first may be empty, above pandas' index."""
    numbers = cells[1:] if cells and not cells[0] else cells
    if len(numbers) < 2 or not all(cell.isdecimal() and len(cell) < 4 for cell in numbers):
        return False
    first = int(numbers[0])
    return first in (0, 1) and [int(cell) for cell in numbers] == list(
        range(first, first + len(numbers))
    )


def is_far(values: np.ndarray) -> np.ndarray:
    """Return for each row (S,) whether its first reading is far from all others.

    Parameters
    ----------
    values : (S, K) array
        Readings; NaN where a sample is missing.
    """
    return np.array([_first_is_far(row) for row in values])


def _first_is_far(row: np.ndarray) -> bool:
    known = row[1:][~np.isnan(row[1:])]
    if known.size == 0:
        return False
    low, high = float(known.min()), float(known.max())
    return bool(abs(row[0] - (low + high) / 2) > 1.5 * (high - low))
