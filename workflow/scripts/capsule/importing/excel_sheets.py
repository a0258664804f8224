"""Read the sheets of an Excel workbook with openpyxl."""

import io
import warnings
from collections import Counter
from datetime import datetime, time
from types import SimpleNamespace
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.extra import damage_named, needed_package, refuse_large_zip
from capsule.importing.number_head import without_number_head
from capsule.importing.number_style import POINT
from capsule.importing.source_table import SourceTable
from capsule.importing.text_table import missing_words, text_column
from capsule.importing.unit_names import is_unit

_MOST_CELLS = 20_000_000


def read_excel(content: bytes, keys: SimpleNamespace, needed: int) -> list[SourceTable]:
    """Read the sheets of a workbook, with the values that formulas had when it was saved.

    Parameters
    ----------
    content : bytes
        The file.
    keys : SimpleNamespace
        The keys of lab.yaml.
    needed : int
        Number of columns of numbers that a sample has.

    Raises
    ------
    CapsuleError
        The file is damaged.
    """
    openpyxl = needed_package("openpyxl", "An Excel workbook")
    with damage_named("workbook", "save it again as .xlsx"), warnings.catch_warnings():
        # openpyxl warns about charts, styles and checks, which do not change the values.
        warnings.simplefilter("ignore", UserWarning)
        refuse_large_zip(content)
        # The read-only way of openpyxl leaves out rows beyond the size that a sheet states.
        book = openpyxl.load_workbook(io.BytesIO(content), data_only=True)
        sheets = [(sheet.title, _rows(sheet)) for sheet in book.worksheets]
    return [without_number_head(_table(title, rows, keys, needed), keys) for title, rows in sheets]


def _rows(sheet: Any) -> list[tuple[Any, ...]]:
    if sheet.max_row * sheet.max_column > _MOST_CELLS:
        raise CapsuleError(
            f"sheet {sheet.title!r} has {sheet.max_row} rows and {sheet.max_column} columns, too "
            "many for one session; delete the cells that hold no readings"
        )
    return list(sheet.values)


def _table(
    title: str, rows: list[tuple[Any, ...]], keys: SimpleNamespace, needed: int
) -> SourceTable:
    cells = [[_cell(value) for value in row] for row in rows]
    counted = [sum(POINT.number(cell) is not None and cell != "" for cell in row) for row in cells]
    first = next((at for at in range(keys.skip_lines or 0, len(cells)) if counted[at] >= needed), 0)
    # Empty cells that have a format make rows wider and sheets longer, so they are dropped.
    below = [(at, row) for at, row in enumerate(cells[first:], start=first + 1) if any(row)]
    width = max((at for _, row in below for at, cell in enumerate(row, 1) if cell), default=0)
    heads = [row[:width] for row in cells[:first] if Counter(map(bool, row))[True] > width / 2]
    units = heads.pop() if len(heads) > 1 and all(map(is_unit, heads[-1])) else [""] * width
    names = heads[-1] if heads else [""] * width
    missing = missing_words(keys)
    columns = [
        text_column(names[at], units[at], [row[at] for _, row in below], POINT, missing)
        for at in range(width)
    ]
    lines = np.array([number for number, _ in below])
    return SourceTable(tuple(columns), "sheet", title, lines=lines, line_word="row")


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, datetime | time):
        text = value.isoformat(sep=" ") if isinstance(value, datetime) else value.isoformat()
        return text if isinstance(value, time) or "." in text else f"{text}.0"
    return repr(value) if isinstance(value, float) else str(value).strip()
