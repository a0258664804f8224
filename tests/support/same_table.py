"""Whether a table of pandas holds what a file holds, every number to the last bit."""

import csv
from pathlib import Path

import pandas as pd


def cell(value):
    """Write a value as a table's file has it."""
    return "" if pd.isna(value) else str(value)


def assert_same_table(table: pd.DataFrame, path: Path) -> None:
    """Compare a table with a file: columns, order of the rows, and cells."""
    with path.open(encoding="utf-8", newline="") as stream:
        columns, *rows = csv.reader(stream)
    assert list(table.columns) == columns, path
    made = [[cell(value) for value in row] for row in table.itertuples(index=False)]
    assert len(made) == len(rows), path
    for ours, theirs in zip(made, rows, strict=True):
        for column, one, other in zip(columns, ours, theirs, strict=True):
            assert one == other or float(one) == float(other), (path, column, one, other)
