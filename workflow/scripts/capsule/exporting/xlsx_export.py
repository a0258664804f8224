"""Export to Excel: one sheet for each table; the head of a column gives its name and unit."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, BinaryIO

from capsule.errors import CapsuleError
from capsule.exporting.exported import NO_UNIT, Column, Exported, Matrices
from capsule.exporting.sheet_cells import content

if TYPE_CHECKING:
    from openpyxl import Workbook

# Excel's limits for one sheet: rows below the head, and columns.
MOST_ROWS = 1_048_575
_MOST_COLUMNS = 16_384


def contents(exported: Exported) -> dict[str, Callable[[BinaryIO], None]]:
    """Return the name of the file, with the function that writes it."""
    return {f"{exported.what}.xlsx": partial(_write, exported)}


def _write(exported: Exported, stream: BinaryIO) -> None:
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    fill(book, "provenance", ["key", "value"], exported.provenance.items())
    for table in exported.tables:
        columns = [column.values.tolist() for column in table.columns]
        fill(book, table.name, [*map(head, table.columns)], zip(*columns, strict=True))
    for matrices in exported.matrices:
        # A row is a sensor, as in the paper's matrices. The head gives the time or the column.
        first = [matrices.of, "unit", f"sensor, along {matrices.axis} [{matrices.axis_unit}]"]
        first += matrices.coordinate.tolist()
        if len(first) > _MOST_COLUMNS:
            raise CapsuleError(
                f"{matrices.name} has {len(first)} columns, but a sheet of Excel has at most "
                f"{_MOST_COLUMNS}; choose --format parquet, or --what evaluation"
            )
        fill(book, matrices.name, first, _rows(matrices))
    book.save(stream)


def fill(book: "Workbook", name: str, first: Sequence[Any], rows: Iterable[Iterable[Any]]) -> None:
    """Write rows below the head of a sheet; add further sheets if the rows need them."""
    sheet, left, number = None, 0, 0
    for row in itertools.chain([()], rows):
        if sheet is None or not left:
            number, left = number + 1, MOST_ROWS
            sheet = book.create_sheet(name if number == 1 else f"{name}_{number}")
            sheet.freeze_panes = "A2"
            sheet.append([content(sheet, value) for value in first])
        if row:
            sheet.append([content(sheet, value) for value in row])
            left -= 1


def head(column: Column) -> str:
    """Return the head of a column, such as ``duration_s [s]``."""
    return f"{column.name} [{column.unit}]" if column.unit not in ("", NO_UNIT) else column.name


def _rows(matrices: Matrices) -> Iterator[list[Any]]:
    for name, matrix in matrices.values.items():
        for sensor, row in enumerate(matrix.tolist(), start=1):
            yield [name, matrices.units.get(name, ""), sensor, *row]
