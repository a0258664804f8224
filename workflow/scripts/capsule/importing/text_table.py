"""The table of a text file: its names, units and cells, once its dialect is known."""

from collections.abc import Collection, Sequence
from types import SimpleNamespace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.number_style import MISSING, POINT, NumberStyle
from capsule.importing.source_table import Column, SourceTable
from capsule.importing.text_dialect import Dialect, guess_dialect
from capsule.importing.text_lines import TextLines
from capsule.importing.unit_names import is_unit


def missing_words(keys: SimpleNamespace) -> frozenset[str | float]:
    """Give what stands for a missing sample beside what always does, in lower case, or as number.

    -999 is also written -999.0.
    """
    words = {str(word).strip().lower() for word in keys.missing or ()}
    numbers = {POINT.number(word) for word in words}
    known = {number for number in numbers if number is not None and number == number}
    return frozenset(words | known)


def text_table(
    text: TextLines, keys: SimpleNamespace, needed: int, *, tolerant: bool = False
) -> SourceTable:
    """Read the table of a text file.

    Parameters
    ----------
    text : TextLines
        Its lines.
    keys : SimpleNamespace
        What lab.yaml says.
    needed : int
        Number of columns of numbers that there must be.
    tolerant : bool
        Whether a line that is no whole sample is passed over, as it is in the log of a serial
        line, instead of refused.

    Raises
    ------
    CapsuleError
        There is no table, or it can be read in several ways, or a line has too few cells.
    """
    missing = missing_words(keys)
    dialect = guess_dialect(text.lines, keys, needed, missing)
    rows, numbers = [], []
    lines = text.lines[dialect.first :]
    if not tolerant:
        _check_last(lines, dialect)
    for number, line in lines:
        cells = dialect.split(line)
        if len(cells) == dialect.cells + 1 and not cells[-1]:
            cells.pop()
        if len(cells) == dialect.cells and not (tolerant and not _is_whole(cells, dialect, needed)):
            rows.append(cells)
            numbers.append(number)
        elif not tolerant:
            raise CapsuleError(
                f"line {number} has {len(cells)} cells, but there are {dialect.cells} columns; "
                "complete the line, or delete it"
            )
    names, units = _head(text, dialect)
    taken = set(numbers)
    by_column = zip(*rows, strict=True)
    columns = [
        text_column(name, unit, cells, dialect.style, missing)
        for name, unit, cells in zip(names, units, by_column, strict=True)
    ]
    return SourceTable(
        tuple(columns),
        lines=np.array(numbers),
        notes=text.notes,
        reading={
            "encoding": text.encoding,
            "delimiter": dialect.delimiter,
            "decimal": dialect.style.decimal,
            "thousands": dialect.style.thousands,
        },
        passed_over=tuple(number for number, _ in lines if number not in taken),
    )


def _check_last(lines: Sequence[tuple[int, str]], dialect: Dialect) -> None:
    """Refuse a table whose last line is cut off: the reader of the rest would not be told."""
    number, line = lines[-1]
    cells = dialect.split(line)
    if len(cells) < dialect.cells:
        raise CapsuleError(
            f"line {number}, the last one, has {len(cells)} cells, but there are {dialect.cells} "
            "columns; the file is cut off: copy it again, or delete the line"
        )


def _is_whole(cells: Sequence[str], dialect: Dialect, needed: int) -> bool:
    return sum(dialect.style.number(cell) is not None for cell in cells) >= needed


def _head(text: TextLines, dialect: Dialect) -> tuple[list[str], list[str]]:
    """Find the line of names above the first sample, and the line of units below it."""
    above = text.lines[: dialect.first]
    heads = [cells for _, line in above if (cells := _as_head(line, dialect))]
    if not heads or len(_as_head(above[-1][1], dialect)) == 0:
        first = text.lines[dialect.first][0]
        comments = [line for number, line in text.comments if number < first]
        # np.savetxt writes the names as a comment.
        heads = [cells for line in comments[-1:] if (cells := _as_head(line, dialect))]
    if not heads:
        return [""] * dialect.cells, [""] * dialect.cells
    if len(heads) > 1 and all(map(is_unit, heads[-1])):
        return heads[-2], heads[-1]
    return heads[-1], [""] * dialect.cells


def _as_head(line: str, dialect: Dialect) -> list[str]:
    cells = dialect.split(line)
    if len(cells) == dialect.cells + 1 and not cells[-1]:
        cells.pop()
    numbers = sum(dialect.style.number(cell) is not None for cell in cells if cell)
    fits = len(cells) == dialect.cells and numbers <= len(cells) / 2
    return [cell.strip('"').strip() for cell in cells] if fits else []


def text_column(
    name: str, unit: str, cells: Sequence[str], style: NumberStyle, missing: Collection[str | float]
) -> Column:
    """Make a column from cells of text, numbers where they are some."""
    read = [style.number(cell, missing) for cell in cells]
    unreadable = [index for index, number in enumerate(read) if number is None]
    values = np.array([np.nan if number is None else number for number in read])
    if missing:
        unknown = MISSING.union(missing)
        cells = ["" if cell.lower() in unknown else cell for cell in cells]
    return Column(name, values, unit, np.array(cells, dtype=object), np.array(unreadable, int))
