"""Find the dialect of a text file: the delimiter of its columns, and the style of its numbers.

The module tries each possible dialect. If several give different numbers, it takes none: the
error names them, and the keys of lab.yaml that decide.
"""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TypeAlias

from capsule.errors import CapsuleError
from capsule.importing.number_style import (
    COMMA,
    COMMA_WITH_THOUSANDS,
    POINT_WITH_THOUSANDS,
    STYLES,
    NumberStyle,
)
from capsule.importing.question import QuestionError
from capsule.importing.text_lines import DELIMITERS, split_cells

# Lines that are tried first; if they leave a choice, all lines are tried.
_TRIED = 200
# Least share of the lines below the first sample that must look like samples.
_LEAST_ROWS = 0.6
# A dialect is dropped if its share of cells with numbers is lower than the best by this much.
_FEWER_NUMBERS = 0.05
# Lines of numbers. None: not a number. "?": a missing sample (NaN would not equal itself).
_Read: TypeAlias = list[list[float | str | None]]
_SIGNS = {"comma": ",", "point": ".", "none": ""}


@dataclass(frozen=True)
class Dialect:
    """The format of a table in a text file.

    Attributes
    ----------
    delimiter : str
        A key of `capsule.importing.text_lines.DELIMITERS`.
    style : NumberStyle
        The style of its numbers.
    first : int
        Index of the first line with a sample.
    cells : int
        Number of cells in a line.
    """

    delimiter: str
    style: NumberStyle
    first: int
    cells: int

    def split(self, line: str) -> list[str]:
        """Return the cells of a line in this dialect."""
        return dialect_cells(line, self.delimiter, self.style, self.cells)


def dialect_cells(line: str, delimiter: str, style: NumberStyle, cells: int = 0) -> list[str]:
    """Return a line's cells; if commas are delimiter and decimal sign, two parts make a number."""
    parts = split_cells(line, delimiter)
    if delimiter == "comma" and style == COMMA and '"' not in line and len(parts) == 2 * cells:
        return [",".join(parts[at : at + 2]) for at in range(0, len(parts), 2)]
    return parts


def guess_dialect(
    lines: Sequence[tuple[int, str]],
    keys: SimpleNamespace,
    needed: int,
    missing: Collection[str | float],
) -> Dialect:
    """Return the dialect of a text file's table.

    Parameters
    ----------
    lines : sequence of (int, str)
        Number and text of each line.
    keys : SimpleNamespace
        The keys of lab.yaml, of which ``delimiter``, ``decimal`` and ``thousands`` are used.
    needed : int
        Least number of columns of numbers.
    missing : collection of str
        Words for a missing sample, in lower case.

    Raises
    ------
    CapsuleError
        If there is no such table, or several dialects fit.
    """
    few = lines if len(lines) <= _TRIED else [*lines[: _TRIED // 2], *lines[-_TRIED // 2 :]]
    ways = _distinct(few, keys, needed, missing)
    if len(ways) > 1 and len(few) < len(lines):
        ways = _distinct(lines, keys, needed, missing)
    if not ways:
        number, text = lines[len(lines) // 2] if lines else (1, "")
        raise CapsuleError(
            f"line {number}: there is no table with {needed} columns of numbers, separated by "
            f"commas, semicolons, tabs, spaces or bars; the line is {text.strip()[:60]!r}; "
            "describe the format with --delimiter, --decimal and --skip-lines"
        )
    if len(ways) > 1:
        raise QuestionError(_ambiguity(few, list(ways)))
    (way,) = ways
    if len(few) == len(lines) or way.first < len(few) // 2:
        return way
    return next(
        dialect
        for _, dialect, _ in _try(
            lines, way.delimiter, way.style, needed, missing, said=_is_said(keys)
        )
        if dialect.cells == way.cells
    )


def _distinct(
    lines: Sequence[tuple[int, str]],
    keys: SimpleNamespace,
    needed: int,
    missing: Collection[str | float],
) -> dict[Dialect, _Read]:
    """Try each dialect; return those that read different numbers, one of each."""
    rated = []
    for delimiter in [keys.delimiter] if keys.delimiter else DELIMITERS:
        if DELIMITERS[delimiter] and not any(DELIMITERS[delimiter] in text for _, text in lines):
            continue
        for style in _styles(lines, keys):
            rated += _try(lines, delimiter, style, needed, missing, said=_is_said(keys))
    best = max((share for share, _, _ in rated), default=0.0)
    # With the same delimiter, the style that reads more cells as numbers is the right one.
    most = {dialect.delimiter: 0.0 for _, dialect, _ in rated}
    for share, dialect, _ in rated:
        most[dialect.delimiter] = max(most[dialect.delimiter], share)
    rated = [each for each in rated if each[0] == most[each[1].delimiter]]
    if any(_is_named(lines, dialect) for _, dialect, _ in rated):
        rated = [each for each in rated if each[1].delimiter != "none"]
    ways: dict[Dialect, _Read] = {}
    for share, dialect, numbers in rated:
        # In a table with tabs, spaces are part of a name or of an empty cell.
        beside_tab = dialect.delimiter == "space" and any(d.delimiter == "tab" for d in ways)
        if share >= best - _FEWER_NUMBERS and numbers not in ways.values() and not beside_tab:
            ways[dialect] = numbers
    return ways


def _is_said(keys: SimpleNamespace) -> bool:
    """Return whether lab.yaml sets commas as delimiter and as decimal sign."""
    said: bool = keys.delimiter == "comma" and keys.decimal == "comma"
    return said


def _is_named(lines: Sequence[tuple[int, str]], dialect: Dialect) -> bool:
    """Return whether the line above the first sample names several columns."""
    if dialect.cells < 2 or dialect.first == 0:
        return False
    names = split_cells(lines[dialect.first - 1][1], dialect.delimiter)
    return len(names) == dialect.cells


def _styles(lines: Sequence[tuple[int, str]], keys: SimpleNamespace) -> list[NumberStyle]:
    styles = [
        style
        for style in STYLES
        if keys.decimal in (None, style.decimal) and keys.thousands in (None, style.thousands)
    ]
    # A point is a decimal sign, unless commas appear, too.
    both = any("," in text and "." in text for _, text in lines)
    if keys.thousands is None and not both:
        styles = [style for style in styles if style != COMMA_WITH_THOUSANDS]
    return styles


def _try(
    lines: Sequence[tuple[int, str]],
    delimiter: str,
    style: NumberStyle,
    needed: int,
    missing: Collection[str | float],
    *,
    said: bool,
) -> list[tuple[float, Dialect, _Read]]:
    """Read all lines in one dialect; return an empty list if that gives no table."""
    rows = [split_cells(text, delimiter) for _, text in lines]
    usual = Counter(map(len, rows[len(rows) // 4 :])).most_common(1)
    if not usual:
        return []
    width = usual[0][0]
    commas_in_numbers = "," in (_SIGNS[style.decimal], _SIGNS[style.thousands])
    quotes = any('"' in text for _, text in lines)
    # A comma has one role, unless quotes separate the two roles, or two parts make a number.
    if delimiter == "comma" and commas_in_numbers and not quotes:
        return _try_pairs(lines, style, width, needed, missing, said=said)
    numbers: _Read = [[style.number(cell, missing) for cell in row] for row in rows]
    return _rate(numbers, delimiter, style, width, needed)


def _try_pairs(
    lines: Sequence[tuple[int, str]],
    style: NumberStyle,
    width: int,
    needed: int,
    missing: Collection[str | float],
    *,
    said: bool,
) -> list[tuple[float, Dialect, _Read]]:
    """Join two parts to one number, if lab.yaml says so or a line has half as many names."""
    cells = width // 2
    named = any(len(split_cells(text, "comma")) == cells for _, text in lines)
    if style != COMMA or width % 2 or not (named or said):
        return []
    rows = [dialect_cells(text, "comma", style, cells) for _, text in lines]
    numbers: _Read = [[style.number(cell, missing) for cell in row] for row in rows]
    return _rate(numbers, "comma", style, cells, needed)


def _rate(
    numbers: _Read, delimiter: str, style: NumberStyle, cells: int, needed: int
) -> list[tuple[float, Dialect, _Read]]:
    def is_sample(row: list[float | str | None]) -> bool:
        known = sum(number is not None and number == number for number in row)
        return len(row) == cells and known >= needed

    def is_row(row: list[float | str | None]) -> bool:
        # A line with a missing sample may hold only the time.
        return len(row) == cells and None not in row and any(each == each for each in row)

    first = next((index for index, row in enumerate(numbers) if is_sample(row)), None)
    if first is None:
        return []
    while first > 0 and is_row(numbers[first - 1]):
        first -= 1
    below = [row for row in numbers[first:] if len(row) == cells]
    rows = sum(is_sample(row) or is_row(row) for row in below)
    if rows < 2 or rows < _LEAST_ROWS * (len(numbers) - first):
        return []
    share = sum(number is not None for row in below for number in row) / (cells * len(below))
    plain = [["?" if number != number else number for number in row] for row in below]
    return [(share, Dialect(delimiter, style, first, cells), plain)]


def _ambiguity(lines: Sequence[tuple[int, str]], ways: list[Dialect]) -> str:
    """Return a message that names an ambiguous cell, and the options that decide."""
    widest = min(ways, key=lambda way: way.cells)
    for number, text in lines[widest.first :]:
        for cell in widest.split(text):
            if "," in cell or (len({way.cells for way in ways}) == 1 and "." in cell):
                return f"line {number}: {cell!r} can be {_readings(cell, ways)}; choose one"
    number, text = lines[widest.first]
    options = " or ".join(f"--delimiter {way.delimiter}" for way in ways)
    return f"line {number}: {text.strip()[:60]!r} can be read in several ways; use {options}"


def _readings(cell: str, ways: list[Dialect]) -> str:
    fewest = min(way.cells for way in ways)
    texts = []
    for way in ways:
        if way.cells > fewest:
            parts = [part for part in split_cells(cell, way.delimiter) if part]
            texts.append(f"columns, {' and '.join(parts)} (--delimiter {way.delimiter})")
            continue
        value = way.style.number(cell)
        if way.style in (POINT_WITH_THOUSANDS, COMMA_WITH_THOUSANDS):
            option = f"--thousands {way.style.thousands}"
        else:
            option = f"--decimal {way.style.decimal}"
        texts.append(f"{'no number' if value is None else format(value, '.12g')} ({option})")
    return " or ".join(texts)
