"""Read the table of a text file: its names, units and cells."""

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
    """Return the additional marks of a missing sample, as lower-case words and as numbers.

    The number matches all its spellings: -999 is also written -999.0.
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
        The file's lines.
    keys : SimpleNamespace
        The keys of lab.yaml.
    needed : int
        Least number of columns of numbers.
    tolerant : bool
        Whether to pass over a line without a whole sample, as for the log of a serial line,
        instead of raising an error.

    Raises
    ------
    CapsuleError
        If there is no table, several dialects fit, or a line has too few cells.
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
    """Raise an error if the last line is cut off, because then the file is incomplete."""
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
    """Return the names above the first sample, and the units in the line below the names."""
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
    """Return a column from cells of text, with their numbers."""
    read = [style.number(cell, missing) for cell in cells]
    unreadable = [index for index, number in enumerate(read) if number is None]
    values = np.array([np.nan if number is None else number for number in read])
    if missing:
        unknown = MISSING.union(missing)
        cells = ["" if cell.lower() in unknown else cell for cell in cells]
    return Column(name, values, unit, np.array(cells, dtype=object), np.array(unreadable, int))
