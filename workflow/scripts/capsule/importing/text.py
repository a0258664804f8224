"""Read text files: tables of any dialect, and logs of a serial line.

The dialect is the delimiter of the columns and the style of the numbers. The reader tries each
possible dialect. If several give different numbers, it takes none: the error names them, and the
keys of lab.yaml that decide.
"""

import csv
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import NamedTuple, TypeAlias

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.cells import POINT, STYLES, NumberStyle, cells_table, missing_words
from capsule.importing.table import QuestionError, Table, without_number_head
from capsule.importing.units import is_unit

_DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "bar": "|", "none": ""}
STAMP_NAME = "serial monitor"
_COMMENT = ("#", "%", "//")
_NOTE = re.compile(r"\s*([A-Za-z][A-Za-z0-9_ ]{0,40}?)\s*[:=]\s*(.+)")
# Keys of a file's own header lines that the recording keeps, or that tell how to read it.
_NOTED = {"adc_bits", "vref_v", "series_ohm", "site", "session", "setup"}
_NOTED |= {"unit", "source", "started"}
_LONGEST_LINE = 100_000
# Lines that are tried first; if they leave a choice, all lines are tried.
_TRIED = 200
# Least share of the lines below the first sample that must look like samples.
_LEAST_ROWS = 0.6
# A dialect is dropped if its share of cells with numbers is lower than the best by this much.
_FEWER_NUMBERS = 0.05
# Lines of a serial monitor: a time stamp, an arrow, and the rest; or labels before readings.
_STAMP = re.compile(r"\s*([0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?)\s*->\s?(.*)")
_LABELLED = re.compile(r"([A-Za-z_][\w .#-]*?)\s*[:=]\s*([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?|nan)")
# To look for labels in a longer line would take long.
_LONGEST_LABELLED = 1000
# Least share of the lines that must look like those of a serial log.
_LEAST_SHARE = 0.5
# Number and text of each line.
_Lines: TypeAlias = Sequence[tuple[int, str]]
# Rows of numbers. None: not a number. "?": a missing sample (NaN would not equal itself).
_Rows: TypeAlias = list[list[float | str | None]]


class _Dialect(NamedTuple):
    """The format of a table: delimiter, style of numbers, index of the first sample, and cells."""

    delimiter: str
    style: NumberStyle
    first: int
    cells: int

    def split(self, line: str) -> list[str]:
        """Return the cells of a line; the delimiter may stand behind the last cell, too."""
        cells = _split_cells(line, self.delimiter)
        return cells[:-1] if len(cells) == self.cells + 1 and not cells[-1] else cells


@dataclass(frozen=True)
class _Text:
    lines: _Lines
    comments: _Lines
    encoding: str
    notes: Mapping[str, str]


def read_text(content: bytes, keys: SimpleNamespace, needed: int) -> Table:
    """Read the table of a text file.

    Parameters
    ----------
    content : bytes
        The file.
    keys : SimpleNamespace
        The keys of lab.yaml.
    needed : int
        Smallest number of columns of numbers.

    Raises
    ------
    CapsuleError
        The file is not text, no table can be recognised in it, or several can.
    """
    text = _split_lines(*_decode(content, keys.encoding), keys.skip_lines or 0)
    some = [line for _, line in text.lines[:_TRIED]]
    fitting = sum(bool(_STAMP.fullmatch(line) or _labels(line)) for line in some)
    is_log = bool(some) and fitting > _LEAST_SHARE * len(some)
    table = _serial_table(text, keys, needed) if is_log else _text_table(text, keys, needed)
    return without_number_head(table, keys)


def _decode(content: bytes, encoding: str | None) -> tuple[str, str]:
    """Return a file's text and its encoding, which is detected if None is given."""
    if not content:
        raise CapsuleError("the file is empty; export it again")
    for guess in [encoding] if encoding else _likely(content):
        try:
            text = content.decode("utf-8-sig" if guess == "utf-8" else guess)
        except UnicodeDecodeError as error:
            fault = f"byte {error.start + 1} is not {guess}"
            continue
        if "\x00" not in text:
            # The codecs utf-16-le and utf-16-be leave a byte-order mark in the text.
            return text.lstrip("\ufeff"), guess.removesuffix("-le").removesuffix("-be")
        fault = "it holds null characters"
    raise CapsuleError(
        f"the file is not readable text: {fault}; use --encoding, or export the file as text"
    )


def _likely(content: bytes) -> list[str]:
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return ["utf-16"]
    head = content[:4000]
    if b"\x00" in head:
        # In UTF-16, a Latin letter has its null byte second (little endian) or first (big endian).
        low, high = head[0::2].count(0), head[1::2].count(0)
        return ["utf-16-le"] if high > low else ["utf-16-be"]
    return ["utf-8", "cp1252", "latin-1"]


def _split_lines(text: str, encoding: str, skip: int) -> _Text:
    """Return the lines and the comments of a text, except the first lines that are skipped."""
    lines, comments = [], []
    plain = text.replace("\r\n", "\n").replace("\r", "\n")
    for number, line in enumerate(plain.split("\n"), start=1):
        stripped = line.strip()
        if number <= skip or not stripped:
            continue
        if len(line) > _LONGEST_LINE:
            raise CapsuleError(
                f"line {number} has {len(line)} characters, but a line of a table has at most "
                f"{_LONGEST_LINE}; choose another file"
            )
        mark = next((each for each in _COMMENT if stripped.startswith(each)), None)
        if mark is None:
            lines.append((number, line))
        else:
            comments.append((number, stripped[len(mark) :].lstrip(mark).strip()))
    return _Text(lines, comments, encoding, _notes(comments))


def _notes(comments: _Lines) -> dict[str, str]:
    """Return the comments of the form ``key: value``, by key."""
    notes: dict[str, str] = {}
    lines: dict[str, int] = {}
    for number, text in comments:
        if not (match := _NOTE.fullmatch(text)):
            continue
        key, value = match[1], match[2].strip()
        if key in _NOTED and notes.get(key, value) != value:
            raise CapsuleError(
                f"lines {lines[key]} and {number} name two values of {key}, "
                f"{notes[key][:60]!r} and {value[:60]!r}; delete the line that is wrong"
            )
        notes[key], lines[key] = value, number
    return notes


def _split_cells(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, without the blanks around them."""
    sign = _DELIMITERS[delimiter]
    if not sign:
        return [line.strip().strip('"')]
    if '"' in line:
        cells = next(csv.reader([line], delimiter=sign, skipinitialspace=True), [])
        return [cell.strip() for cell in cells if cell.strip() or sign != " "]
    return line.split() if sign == " " else [cell.strip() for cell in line.split(sign)]


def _guess_dialect(
    lines: _Lines, keys: SimpleNamespace, needed: int, missing: Collection[str | float]
) -> _Dialect:
    """Return the dialect of a text file's table; raise an error for none, and for several."""
    few = lines if len(lines) <= _TRIED else [*lines[: _TRIED // 2], *lines[-_TRIED // 2 :]]
    ways = _distinct(few, keys, needed, missing)
    if len(few) < len(lines) and (len(ways) > 1 or any(way.first >= len(few) // 2 for way in ways)):
        ways = _distinct(lines, keys, needed, missing)
    if not ways:
        number, text = lines[len(lines) // 2] if lines else (1, "")
        raise CapsuleError(
            f"line {number}: there is no table with {needed} columns of numbers, separated by "
            f"commas, semicolons, tabs, spaces or bars; the line is {text.strip()[:60]!r}; "
            "describe the format with --delimiter, --decimal and --skip-lines"
        )
    if len(ways) > 1:
        raise QuestionError(_ambiguity(lines, ways))
    return ways[0]


def _distinct(
    lines: _Lines, keys: SimpleNamespace, needed: int, missing: Collection[str | float]
) -> list[_Dialect]:
    """Try each dialect; return those that read different numbers, one of each."""
    rated = []
    for delimiter in [keys.delimiter] if keys.delimiter else _DELIMITERS:
        if any(_DELIMITERS[delimiter] in text for _, text in lines):
            for style in _styles(lines, keys):
                rated += _try(lines, delimiter, style, needed, missing)
    best = max((share for share, _, _ in rated), default=0.0)
    # With the same delimiter, the style that reads more cells as numbers is the right one.
    most: dict[str, float] = {}
    for share, dialect, _ in rated:
        most[dialect.delimiter] = max(most.get(dialect.delimiter, 0.0), share)
    rated = [each for each in rated if each[0] == most[each[1].delimiter]]
    if any(_is_named(lines, dialect) for _, dialect, _ in rated):
        rated = [each for each in rated if each[1].delimiter != "none"]
    ways: dict[_Dialect, _Rows] = {}
    for share, dialect, rows in rated:
        # In a table with tabs, spaces are part of a name or of an empty cell.
        beside_tab = dialect.delimiter == "space" and any(way.delimiter == "tab" for way in ways)
        if share >= best - _FEWER_NUMBERS and rows not in ways.values() and not beside_tab:
            ways[dialect] = rows
    return list(ways)


def _styles(lines: _Lines, keys: SimpleNamespace) -> list[NumberStyle]:
    # A point is a decimal sign, unless commas appear, too.
    both = any("," in text and "." in text for _, text in lines)
    return [
        style
        for style in STYLES
        if keys.decimal in (None, style.decimal)
        and keys.thousands in (None, style.thousands)
        and (keys.thousands or both or style.thousands != "point")
    ]


def _is_named(lines: _Lines, dialect: _Dialect) -> bool:
    """Return whether the line above the first sample names several columns."""
    if dialect.cells < 2 or dialect.first == 0:
        return False
    return len(_split_cells(lines[dialect.first - 1][1], dialect.delimiter)) == dialect.cells


def _try(
    lines: _Lines,
    delimiter: str,
    style: NumberStyle,
    needed: int,
    missing: Collection[str | float],
) -> list[tuple[float, _Dialect, _Rows]]:
    """Return the share of numbers, the dialect and the rows; empty if it gives no table."""
    quotes = any('"' in text for _, text in lines)
    # A comma has one role, unless quotes separate the two roles.
    if delimiter == "comma" and "comma" in style and not quotes:
        return []
    split = [_split_cells(text, delimiter) for _, text in lines]
    ((cells, _),) = Counter(map(len, split[len(split) // 4 :])).most_common(1) or [(0, 0)]
    numbers = [[style.number(cell, missing) for cell in row] for row in split]
    samples = [
        len(row) == cells and sum(each is not None and each == each for each in row) >= needed
        for row in numbers
    ]
    if not any(samples):
        return []
    # A line with a missing sample may hold only the time.
    rows = [
        len(row) == cells and None not in row and any(each == each for each in row)
        for row in numbers
    ]
    first = samples.index(True)
    while first > 0 and rows[first - 1]:
        first -= 1
    number_of_rows = sum(map(max, samples[first:], rows[first:]))
    if number_of_rows < max(2, _LEAST_ROWS * (len(numbers) - first)):
        return []
    below = [row for row in numbers[first:] if len(row) == cells]
    share = sum(number is not None for row in below for number in row) / (cells * len(below))
    comparable: _Rows = [["?" if each != each else each for each in row] for row in below]
    return [(share, _Dialect(delimiter, style, first, cells), comparable)]


def _ambiguity(lines: _Lines, ways: Sequence[_Dialect]) -> str:
    """Return a message that names an ambiguous cell, and the options that decide."""
    widest = min(ways, key=lambda way: way.cells)
    for number, text in lines[widest.first :]:
        for cell in widest.split(text):
            if "," in cell or (len({way.cells for way in ways}) == 1 and "." in cell):
                readings = " or ".join(_reading(cell, way, widest.cells) for way in ways)
                return f"line {number}: {cell!r} can be {readings}; choose one"
    number, text = lines[widest.first]
    options = " or ".join(f"--delimiter {way.delimiter}" for way in ways)
    return f"line {number}: {text.strip()[:60]!r} can be read in several ways; use {options}"


def _reading(cell: str, way: _Dialect, fewest: int) -> str:
    if way.cells > fewest:
        parts = [part for part in _split_cells(cell, way.delimiter) if part]
        return f"columns, {' and '.join(parts)} (--delimiter {way.delimiter})"
    value, (decimal, thousands) = way.style.number(cell), way.style
    option = f"--decimal {decimal}" if thousands == "none" else f"--thousands {thousands}"
    return f"{'no number' if value is None else format(value, '.12g')} ({option})"


def _text_table(
    text: _Text, keys: SimpleNamespace, needed: int, *, tolerant: bool = False
) -> Table:
    """Return the table of a text.

    If it is tolerant, as for the log of a serial line, it passes over a line without a whole
    sample instead of raising an error.
    """
    missing = missing_words(keys)
    dialect = _guess_dialect(text.lines, keys, needed, missing)
    _refuse_two_roles(text.lines, dialect)
    lines = [(number, dialect.split(line)) for number, line in text.lines[dialect.first :]]
    if tolerant:
        read = [(number, cells) for number, cells in lines if _is_whole(cells, dialect, needed)]
    else:
        read = lines
        _check_cells(lines, dialect)
    names, units = _head(text, dialect)
    taken = {number for number, _ in read}
    return cells_table(
        names,
        units,
        [cells for _, cells in read],
        [number for number, _ in read],
        dialect.style,
        missing,
        notes=text.notes,
        reading={
            "encoding": text.encoding,
            "delimiter": dialect.delimiter,
            "decimal": dialect.style.decimal,
            "thousands": dialect.style.thousands,
        },
        passed_over=tuple(number for number, _ in lines if number not in taken),
    )


def _refuse_two_roles(lines: _Lines, dialect: _Dialect) -> None:
    """Raise an error if commas are delimiters and decimal signs: there are half as many names."""
    if dialect.delimiter == "comma" and dialect.first > 0:
        (number, names), (first, _) = lines[dialect.first - 1 : dialect.first + 1]
        if (named := len(_split_cells(names, "comma"))) * 2 == dialect.cells:
            raise CapsuleError(
                f"line {first} has {dialect.cells} cells, but line {number} names {named} columns: "
                "a comma seems to be delimiter and decimal sign; export it with another delimiter"
            )


def _check_cells(lines: Sequence[tuple[int, list[str]]], dialect: _Dialect) -> None:
    """Raise an error for a line without all cells, first for a last line that is cut off."""
    number, cells = lines[-1]
    if len(cells) < dialect.cells:
        raise CapsuleError(
            f"line {number}, the last one, has {len(cells)} cells, but there are {dialect.cells} "
            "columns; the file is cut off: copy it again, or delete the line"
        )
    for number, cells in lines:
        if len(cells) != dialect.cells:
            raise CapsuleError(
                f"line {number} has {len(cells)} cells, but there are {dialect.cells} columns; "
                "complete the line, or delete it"
            )


def _is_whole(cells: Sequence[str], dialect: _Dialect, needed: int) -> bool:
    numbers = sum(dialect.style.number(cell) is not None for cell in cells)
    return len(cells) == dialect.cells and numbers >= needed


def _head(text: _Text, dialect: _Dialect) -> tuple[list[str], list[str]]:
    """Return the names above the first sample, and the units in the line below the names."""
    above = [_as_head(line, dialect) for _, line in text.lines[: dialect.first]]
    heads = [cells for cells in above if cells]
    if not heads or not above[-1]:
        first = text.lines[dialect.first][0]
        comments = [line for number, line in text.comments if number < first]
        # np.savetxt writes the names as a comment.
        heads = [cells for line in comments[-1:] if (cells := _as_head(line, dialect))]
    unnamed = [""] * dialect.cells
    if len(heads) > 1 and all(map(is_unit, heads[-1])):
        return heads[-2], heads[-1]
    return (heads[-1] if heads else unnamed), unnamed


def _as_head(line: str, dialect: _Dialect) -> list[str]:
    cells = dialect.split(line)
    numbers = sum(dialect.style.number(cell) is not None for cell in cells if cell)
    fits = len(cells) == dialect.cells and numbers <= len(cells) / 2
    return [cell.strip('"').strip() for cell in cells] if fits else []


def _labels(line: str) -> tuple[str, ...]:
    """Return the labels of a line; empty if it holds anything but labelled numbers."""
    if len(line) > _LONGEST_LABELLED:
        return ()
    rest = re.sub(r"[\s,;|]+", "", _LABELLED.sub("", line))
    return tuple(match[1].strip() for match in _LABELLED.finditer(line)) if not rest else ()


def _serial_table(text: _Text, keys: SimpleNamespace, needed: int) -> Table:
    """Return the table in the log of a serial line; pass over lines without a whole sample."""
    stamps, lines = {}, []
    for number, line in text.lines:
        if match := _STAMP.fullmatch(line):
            stamps[number] = match[1]
        if rest := (match[2] if match else line).strip():
            lines.append((number, rest))
    bare = replace(text, lines=lines)
    table = _labelled(bare, keys) or _text_table(bare, keys, needed, tolerant=True)
    if table.texts is None or table.lines is None or table.unreadable is None:
        return table
    texts = [stamps.get(number, "") for number in table.lines.tolist()]
    if not stamps or "" in texts:
        return table
    return replace(
        table,
        names=(STAMP_NAME, *table.names),
        units=("clock", *table.units),
        numbers=np.vstack([np.full(len(texts), np.nan), table.numbers]),
        texts=np.vstack([np.array(texts, dtype=object), table.texts]),
        unreadable=np.vstack([np.full(len(texts), fill_value=True), table.unreadable]),
    )


def _labelled(text: _Text, keys: SimpleNamespace) -> Table | None:
    """Return the table of labelled numbers; None if the lines have no labels."""
    labels = [_labels(line) for _, line in text.lines]
    usual = max(set(labels), key=labels.count, default=())
    if not usual or labels.count(usual) < _LEAST_SHARE * len(labels):
        return None
    whole = [line for line, each in zip(text.lines, labels, strict=True) if each == usual]
    taken = {number for number, _ in whole}
    return cells_table(
        usual,
        [""] * len(usual),
        [[match[2] for match in _LABELLED.finditer(line)] for _, line in whole],
        [number for number, _ in whole],
        POINT,
        missing_words(keys),
        notes=text.notes,
        reading={"encoding": text.encoding},
        passed_over=tuple(number for number, _ in text.lines if number not in taken),
    )
