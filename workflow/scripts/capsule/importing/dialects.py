"""Recognise the dialect of a table of text: the delimiter, and the style of the numbers.

Each possible dialect is tried. If several give different numbers, none is taken: the error names
them, and the keys of lab.yaml that decide.
"""

import csv
import re
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.table import QuestionError
from capsule.importing.units import (
    LEAST_COUNT,
    THOUSANDFOLD,
    is_time_name,
    split_unit,
    unit_of,
)
from capsule.recordings.recording import LARGEST_NUMBER

_MISSING = ("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--")
_DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "bar": "|", "none": ""}
# Lines that are tried first.
TRIED = 200
# Least share of the lines below the first sample that must look like samples.
_LEAST_ROWS = 0.6
# A dialect is dropped if its share of cells with numbers is lower than the best by this much.
_FEWER_NUMBERS = 0.05
_LABELLED = re.compile(r"([A-Za-z_][\w .#-]*?)\s*[:=]\s*([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?|nan)")
# To look for labels in a longer line would take long.
_LONGEST_LABELLED = 1000
# Number and text of a line.
Line: TypeAlias = tuple[int, str]

# By decimal sign and separator of thousands. A number with thousands never begins with 0: the comma
# of 0,123 is a decimal sign, and so is that of 4,690e+02.
_NUMBERS = {
    style: re.compile(rf"[+-]?(?:{digits}){'(?:[eE][+-]?[0-9]+)?' * (style[1] == 'none')}")
    for style, digits in {
        ("point", "none"): r"[0-9]+\.?[0-9]*|\.[0-9]+",
        ("comma", "none"): r"[0-9]+(?:,[0-9]+)?|,[0-9]+",
        ("point", "comma"): r"(?:[1-9][0-9]{0,2}(?:,[0-9]{3})+|[0-9]+)(?:\.[0-9]*)?",
        ("comma", "point"): r"(?:[1-9][0-9]{0,2}(?:\.[0-9]{3})+|[0-9]+)(?:,[0-9]+)?",
    }.items()
}
# A number whose point can be a decimal sign or separate thousands.
_POINTED = re.compile(r"[+-]?[1-9][0-9]{0,2}\.[0-9]{3}")
_GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[\s'\u2019][0-9]{3})+(?:[.,][0-9]+)?")


class Dialect(NamedTuple):
    """A way to read a table.

    After the delimiter, the style of the numbers, the marks of a missing sample and the labels in
    each line of a serial log come the number of cells in a row, the index of the first sample, the
    share of the cells from there on that are numbers, and these numbers (K, C).
    """

    delimiter: str
    style: tuple[str, str]
    missing: Collection[str | float]
    labels: tuple[str, ...] = ()
    cells: int = 0
    first: int = 0
    share: float = 0.0
    numbers: np.ndarray = np.empty((0, 0))

    def split(self, line: str) -> list[str]:
        """Return the cells of a line, without the blanks around them; none if its labels differ."""
        if self.labels:
            return _LABELLED.split(line)[2::3] if labels_of(line) == self.labels else []
        # No text holds a null character, so without a delimiter a row is one cell.
        sign = _DELIMITERS[self.delimiter] or "\0"
        row = " ".join(line.split()) if sign == " " else line
        cells = row.split(sign)
        if '"' in row:
            (cells,) = csv.reader([row], delimiter=sign, skipinitialspace=True)
        return self.trimmed([cell.strip() for cell in cells])

    def trimmed(self, cells: list[str]) -> list[str]:
        """Return the cells of a row without one too many: an empty one, or a remark on a sample.

        LabVIEW names the column of remarks, too.
        """
        if len(cells) != self.cells + 1 or self.cells == 0:
            return cells
        last = cells[-1]
        is_word = last[:1].isalpha() or not re.search("[0-9]", last)
        numbers = [self.number(cell) != np.inf for cell in cells if cell]
        is_remark = is_word and any(numbers) and not numbers[-1]
        is_remark |= last[:1] in ("", "#") or last == "Comment"
        return cells[:-1] if is_remark else cells

    def number(self, cell: str) -> float:
        """Return a cell's number; NaN for a missing sample, infinite if it is not a number."""
        text = cell.strip()
        if text.lower() in self.missing:
            return float("nan")
        if not _NUMBERS[self.style].fullmatch(text):
            # Blanks and apostrophes separate thousands, unless they are between two columns.
            grouped = self.delimiter not in ("none", "space") and _GROUPED.fullmatch(text)
            return float(re.sub("[^0-9.+-]", "", text.replace(",", "."))) if grouped else np.inf
        if self.style[1] != "none":
            text = text.replace("," if self.style[1] == "comma" else ".", "")
        value = float(text.replace(",", "."))
        if value in self.missing:
            return float("nan")
        return value if abs(value) <= LARGEST_NUMBER else np.inf

    def count_numbers(self, row: Sequence[str]) -> int:
        """Return how many cells of a row are numbers, or marks of a missing sample."""
        return sum(self.number(cell) != np.inf for cell in row if cell)

    def names_columns(self, row: Sequence[str]) -> bool:
        """Return whether a row names columns: most cells are words, or one is a time's name."""
        has_words = self.count_numbers(row) <= self.cells / 2 or any(map(is_time_name, row))
        return len(row) == self.cells and has_words


def plain_dialect(keys: Keys) -> Dialect:
    """Return the dialect without a delimiter, with points in its numbers, and the marks.

    A number among the marks of a missing sample matches all its spellings: -999 is also -999.0.
    """
    words = [str(word).strip().lower() for word in keys.missing or ()]
    way = Dialect("none", ("point", "none"), ())
    return way._replace(missing={*_MISSING, *words, *filter(np.isfinite, map(way.number, words))})


def guess_dialect(lines: Sequence[Line], plain: Dialect, keys: Keys) -> Dialect:
    """Return the dialect of a text file's table; raise an error for none, and for several."""
    few = lines if len(lines) <= TRIED else [*lines[: TRIED // 2], *lines[-TRIED // 2 :]]
    ways = _distinct(few, plain, keys)
    if len(few) < len(lines) and (len(ways) > 1 or any(way.first >= len(few) // 2 for way in ways)):
        ways = _distinct(lines, plain, keys)
    narrow = ways or _distinct(few, plain, replace(keys, sensor_count=1))
    if not ways and narrow and narrow[0].cells < keys.sensor_count:
        raise CapsuleError(
            f"there is no table with {keys.sensor_count} columns of numbers, but one with "
            f"{narrow[0].cells}; if each file holds one sensor, give those of a run together, with "
            "--per-sensor, or else set recording.sensors of the configuration"
        )
    if not ways:
        number, text = lines[len(lines) // 2] if lines else (1, "")
        raise CapsuleError(
            f"line {number}: there is no table with {keys.sensor_count} columns of numbers, "
            "separated by commas, semicolons, tabs, spaces or bars; the line is "
            f"{text.strip()[:60]!r}; describe the format with --delimiter, --decimal and "
            "--skip-lines, or export the readings as a table of numbers"
        )
    if len(ways) > 1:
        raise _ambiguity(lines, ways)
    return ways[0]


def _distinct(lines: Sequence[Line], plain: Dialect, keys: Keys) -> list[Dialect]:
    """Try each dialect; return those that read different numbers, one of each."""
    # A point is a decimal sign, unless commas appear, too.
    both = any("," in text and "." in text for _, text in lines)
    quotes = any('"' in text for _, text in lines)
    ways: list[Dialect] = []
    told = "none" if plain.labels else keys.delimiter
    for delimiter in [told] if told else _DELIMITERS:
        if not any(_DELIMITERS[delimiter] in text for _, text in lines):
            continue
        plain = plain._replace(delimiter=delimiter)
        rows = [plain.split(text) for _, text in lines]
        same = [
            way
            for style in _NUMBERS
            if keys.decimal in (None, style[0])
            and keys.thousands in (None, style[1])
            and (keys.thousands or both or style[1] != "point")
            # A comma has one role, unless quotes separate the two roles.
            and (delimiter != "comma" or "comma" not in style or quotes)
            and (way := table_in(rows, plain._replace(style=style), keys.sensor_count))
        ]
        # With the same delimiter, the style that reads more cells as numbers is the right one: a
        # number below 1 shows that the point before its three decimals separates no thousands.
        read = [(way.share, np.count_nonzero(~np.isinf(way.numbers))) for way in same]
        ways += [way for way, count in zip(same, read, strict=True) if count == max(read)]
    # The line above the first sample may name several columns.
    if any(way.first and len(way.split(lines[way.first - 1][1])) == way.cells > 1 for way in ways):
        ways = [way for way in ways if way.cells > 1]
    distinct: list[Dialect] = []
    for way in ways:
        # In a table with tabs, spaces are part of a name or of an empty cell.
        beside_tab = way.delimiter == "space" and any(each.delimiter == "tab" for each in distinct)
        fewer = way.share < max(other.share for other in ways) - _FEWER_NUMBERS
        known = any(np.array_equal(way.numbers, each.numbers, equal_nan=True) for each in distinct)
        if not beside_tab and not fewer and not known:
            distinct.append(way)
    return distinct


def table_in(rows: Sequence[list[str]], way: Dialect, sensors: int) -> Dialect | None:
    """Return a dialect with the table that it finds in the rows, if there is one."""
    if not rows:
        return None
    widths = Counter(map(len, rows[len(rows) // 4 :]))
    width = len(way.labels) or widths.most_common(1)[0][0]
    way = way._replace(cells=width)
    rows = list(map(way.trimmed, rows))
    is_wide = np.array([len(row) == width for row in rows])
    numbers = np.full((len(rows), width), np.inf)
    numbers[is_wide] = [list(map(way.number, row)) for row in rows if len(row) == width]
    there = np.isfinite(numbers).sum(axis=1)
    # A line with a missing sample may hold only the time.
    whole = (there >= sensors) | ((there > 0) & ~np.isinf(numbers).any(axis=1))
    # A word in a column of numbers is a name or a mark, and its row not the first sample.
    is_word = np.isinf(numbers) & is_wide[:, None]
    # Behind the last column of numbers, it is a remark on a sample.
    is_number = np.isfinite(numbers).sum(axis=0) > is_word.sum(axis=0)
    last = int(np.flatnonzero(is_number).max(initial=-1))
    is_head = (np.mean(is_word[is_wide], axis=0) < 0.5) & (np.arange(width) <= last)
    is_named = (is_word & is_head).any(axis=1)
    first = int(np.argmax((there >= sensors) & ~is_named))
    while first > 0 and whole[first - 1] and not is_named[first - 1]:
        first -= 1
    if there.max() < sensors or whole[first:].sum() < max(2, _LEAST_ROWS * (len(rows) - first)):
        return None
    below = numbers[first:][is_wide[first:]]
    share = float(np.mean(~np.isinf(below)))
    return way._replace(first=first, share=share, numbers=below)


def _ambiguity(lines: Sequence[Line], ways: Sequence[Dialect]) -> QuestionError:
    """Return the question that names an ambiguous cell or line, and the options that decide."""
    widest, readings, answers = min(ways, key=lambda way: way.cells), list[str](), []
    is_same = len({way.cells for way in ways}) == 1
    cells = (
        (number, cell)
        for number, text in lines[widest.first :]
        for cell in widest.split(text)
        if "," in cell or (is_same and "." in cell)
    )
    number, cell = next(cells, (lines[widest.first][0], ""))
    text = cell or lines[widest.first][1].strip()[:60]
    for way in ways:
        if way.cells > widest.cells or not cell:
            key, value = "delimiter", way.delimiter
            told = f"columns, {' and '.join(part for part in way.split(text) if part)}"
        else:
            key, value = "thousands", way.style[1]
            if value == "none":
                key, value = "decimal", way.style[0]
            told = "no number" if np.isinf(way.number(cell)) else f"{way.number(cell):.12g}"
        readings.append(f"{told} (--{key} {value})")
        answers.append({key: value})
    can_be = " or ".join(readings)
    return QuestionError(f"line {number}: {text!r} can be {can_be}; choose one", answers)


def check_thousands(
    word: str,
    heads: Iterable[str],
    rows: Iterable[tuple[int, list[str]]],
    dialect: Dialect,
    keys: Keys,
) -> None:
    """Raise an error if points can separate thousands.

    They can if numbers with one jump a thousandfold, or if all numbers with one have three digits
    behind it. `heads` holds what stands above the samples, and `rows` their numbers, each of a
    `word`, and their cells.
    """
    if "point" not in dialect.style or keys.thousands or (keys.decimal and keys.unit != "counts"):
        return
    table = [(number, cells) for number, cells in rows if len(cells) == dialect.cells]
    columns = list(zip(*(cells for _, cells in table), strict=True))
    columns = [column for column in columns if any("." in cell for cell in column)]
    whole_columns = [column for column in columns if all("." in cell for cell in column if cell)]
    numbers = (cell for column in columns for cell in column if "." in cell)
    # A number with two points, a comma, or other digits behind the point settles it; so does a
    # unit of which a thousand are too many.
    settled = any(
        np.isfinite(dialect.number(cell)) and not _POINTED.fullmatch(cell) for cell in numbers
    )
    parts = (part for head in heads for part in (split_unit(head)[1], head.rpartition(":")[2]))
    said = {keys.unit} if keys.unit else {*map(unit_of, parts)}
    is_open = len(whole_columns) >= keys.sensor_count and not settled and not said & {"V", "kohm"}
    for column in columns:
        pointed = [cell for cell in column if "." in cell]
        whole = [float(cell) for cell in column if re.fullmatch("[1-9][0-9]{0,2}", cell)]
        if not all(map(_POINTED.fullmatch, pointed)):
            continue
        decimals = np.array(list(map(float, pointed)))
        # Numbers that rise by the time between two samples are times in s, or in ms by thousands.
        steps = np.diff(decimals) * keys.rate_hz
        is_whole = column in whole_columns
        if is_whole and np.all(steps > 0) and np.abs(np.median(steps) - 1) < 0.5:
            continue
        usual = np.median(decimals)
        jumps = bool(whole) and np.median(whole) > THOUSANDFOLD * usual
        is_small = bool(said & {"counts", "ohm"}) and usual < LEAST_COUNT
        number = next(number for number, cells in table if pointed[0] in cells)
        if jumps and keys.decimal:
            raise QuestionError(
                f"{word} {number}: {pointed[0]!r} beside {whole[0]:g} is no count; use --thousands "
                "point in place of --decimal point, or give another --unit"
            )
        if not keys.decimal and (jumps or (is_whole and (is_open or is_small))):
            raise QuestionError(
                f"{word} {number}: {pointed[0]!r} can be {float(pointed[0]):g} (--decimal point) "
                f"or {pointed[0].replace('.', '')} (--thousands point); choose one",
                [{"decimal": "point"}, {"thousands": "point"}],
            )


def labels_of(line: str) -> tuple[str, ...]:
    """Return the labels of a line; empty if it holds anything but labelled numbers."""
    if len(line) > _LONGEST_LABELLED or _LABELLED.sub("", line).strip(" \t,;|"):
        return ()
    return tuple(label for label, _ in _LABELLED.findall(line))
