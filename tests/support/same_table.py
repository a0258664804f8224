"""Compare a pandas table with a file exactly."""

import csv
from pathlib import Path

import pandas as pd

from capsule.store.results import BATCH_COLUMNS


def cell(value):
    """Return a value as the text in a table's file."""
    return "" if pd.isna(value) else str(value)


def assert_same_table(table: pd.DataFrame, path: Path) -> None:
    """Check that a table and a file have the same columns, rows in the same order, and cells.

    The file may go on with the columns that say where the results of a recording stand.
    """
    with path.open(encoding="utf-8", newline="") as stream:
        columns, *rows = csv.reader(stream)
    if columns[-len(BATCH_COLUMNS) :] == [*BATCH_COLUMNS]:
        columns, *rows = (row[: -len(BATCH_COLUMNS)] for row in (columns, *rows))
    assert list(table.columns) == columns, path
    made = [[cell(value) for value in row] for row in table.itertuples(index=False)]
    assert len(made) == len(rows), path
    for ours, theirs in zip(made, rows, strict=True):
        for column, one, other in zip(columns, ours, theirs, strict=True):
            assert one == other or float(one) == float(other), (path, column, one, other)
