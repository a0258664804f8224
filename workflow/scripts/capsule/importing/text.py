"""Read text files: tables of any dialect, and logs of a serial line; and the rows of workbooks.

The dialect is the delimiter of the columns and the style of the numbers. The reader tries each
possible dialect. If several give different numbers, it takes none: the error names them, and the
keys of lab.yaml that decide. A file is read line by line, so a long one takes little memory.
"""

import csv
import io
import re
from array import array
from collections import Counter, deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.table import Channel, QuestionError, Table, not_a_number
from capsule.importing.units import is_time_name, is_unit, unit_of
from capsule.recordings.recording import DECISIVE, LARGEST_NUMBER, cut_off, lost_digits

_MISSING = ("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--")
_DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "bar": "|", "none": ""}
STAMP_NAME = "serial monitor"
_COMMENT = ("#", "%", "//")
_NOTE = re.compile(r"\s*([A-Za-z][A-Za-z0-9_ ]{0,40}?)\s*[:=]\s*(.+)")
# Lines with these keys may not contradict each other.
_DECISIVE = {*DECISIVE, "source", "started"}
_LONGEST_LINE = 100_000
# Lines that are tried first; and if they leave a choice.
_TRIED, _MOST_TRIED = 200, 20_000
# Least share of the lines below the first sample that must look like samples.
_LEAST_ROWS = 0.6
# A dialect is dropped if its share of cells with numbers is lower than the best by this much.
_FEWER_NUMBERS = 0.05
# Lines of a serial monitor: a time stamp, an arrow, and the rest; of another terminal: a stamp in
# brackets, or before a blank and a list; or labels before readings.
_CLOCK = r"[0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?"
_LIST = r"(?![AaPp]\.?[Mm]|UTC|Z|[+-][0-9]{2}:)[^\s,;]+[,;]\s*[^\s,;]+[,;]|\w+[:=]"
_STAMP = re.compile(
    rf"\s*(?:({_CLOCK})\s*->"
    r"|\[\s*([0-9A-Z][^\[\]]*?)(?:\s+[0-9]+\.[0-9]+)?\s*\][:>]?"
    rf"|((?:[0-9]{{4}}-[0-9]{{2}}-[0-9]{{2}}[ T])?{_CLOCK})(?=\s+(?:{_LIST})))\s?(.*)"
)
_LABELLED = re.compile(r"([A-Za-z_][\w .#-]*?)\s*[:=]\s*([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?|nan)")
# To look for labels in a longer line would take long.
_LONGEST_LABELLED = 1000
# Least share of the lines that must look like those of a serial log.
_LEAST_SHARE = 0.5
# What a comment says of all readings.
_IN_UNIT = re.compile(
    r"(?:all )?(times?|(?:\w+ ){0,3}(?:values?|readings?|data|signals?|sensors?|channels?|"
    r"pressures?|forces?|voltages?|resistances?))\b.* in ([^\s,;]+?)\.?",
    re.IGNORECASE,
)
_UNIT_LINE = re.compile(r"\W*(units?|einheit)\s*[:=,;\s]\s*(\S+?)\W*", re.IGNORECASE)
# If cells without a point are so many times those with one beside them, it separates thousands.
_THOUSANDFOLD = 30.0
# Number and text of each line; number and cells of each row.
_Line: TypeAlias = tuple[int, str]
_Rows: TypeAlias = Iterable[tuple[int, list[str]]]


# By decimal sign and separator of thousands. A number with thousands never begins with 0: the comma
# of 0,123 is a decimal sign.
_NUMBERS = {
    style: re.compile(rf"[+-]?(?:{digits})(?:[eE][+-]?[0-9]+)?")
    for style, digits in {
        ("point", "none"): r"[0-9]+\.?[0-9]*|\.[0-9]+",
        ("comma", "none"): r"[0-9]+(?:,[0-9]+)?|,[0-9]+",
        ("point", "comma"): r"(?:[1-9][0-9]{0,2}(?:,[0-9]{3})+|[0-9]+)(?:\.[0-9]*)?",
        ("comma", "point"): r"(?:[1-9][0-9]{0,2}(?:\.[0-9]{3})+|[0-9]+)(?:,[0-9]+)?",
    }.items()
}


class _Dialect(NamedTuple):
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
        """Return the cells of a line, without the blanks around them; none if its labels differ.

        The delimiter may stand behind the last cell, too.
        """
        if self.labels:
            return _LABELLED.split(line)[2::3] if _labels(line) == self.labels else []
        # No text holds a null character, so without a delimiter a row is one cell.
        sign = _DELIMITERS[self.delimiter] or "\0"
        row = " ".join(line.split()) if sign == " " else line
        cells = row.split(sign)
        if '"' in row:
            (cells,) = csv.reader([row], delimiter=sign, skipinitialspace=True)
        cells = [cell.strip() for cell in cells]
        return cells[:-1] if len(cells) == self.cells + 1 > 1 and not cells[-1] else cells

    def number(self, cell: str) -> float:
        """Return a cell's number; NaN for a missing sample, infinite if it is not a number."""
        text = cell.strip()
        if text.lower() in self.missing:
            return float("nan")
        if not _NUMBERS[self.style].fullmatch(text):
            return np.inf
        if self.style[1] != "none":
            text = text.replace("," if self.style[1] == "comma" else ".", "")
        value = float(text.replace(",", "."))
        if value in self.missing:
            return float("nan")
        return value if abs(value) <= LARGEST_NUMBER else np.inf


def _plain(keys: Keys) -> _Dialect:
    """Return the dialect without a delimiter, with points in its numbers, and the marks.

    A number among the marks of a missing sample matches all its spellings: -999 is also -999.0.
    """
    words = [str(word).strip().lower() for word in keys.missing or ()]
    way = _Dialect("none", ("point", "none"), ())
    return way._replace(missing={*_MISSING, *words, *filter(np.isfinite, map(way.number, words))})


def read_text(content: bytes, keys: Keys) -> Table:
    """Read the table of a text file; in the log of a serial line, pass over broken lines.

    Raises
    ------
    CapsuleError
        The file is not text, no table can be recognised in it, or several can.
    """
    encoding = _encoding(content, keys.encoding)
    comments, stamps = dict[int, str](), dict[int, str]()
    lines, again = (_lines(content, encoding, keys.skip_lines or 0, comments) for _ in range(2))
    known = [*islice(lines, _MOST_TRIED), *deque(lines, maxlen=_TRIED // 2)]
    tried = {number: _labels(line) for number, line in _bare(known[:_TRIED], stamps)}
    logged = stamps.keys() | {number for number, labels in tried.items() if labels}
    is_log, labels = len(logged) > _LEAST_SHARE * len(known[:_TRIED]), tuple[str, ...]()
    if is_log:
        known, again = [*_bare(known, stamps)], _bare(again, stamps)
        ((usual, count),) = Counter(tried.values()).most_common(1) or [((), 0)]
        labels = usual if count >= _LEAST_SHARE * len(tried) else ()
    dialect = _guess_dialect(known, _plain(keys)._replace(labels=labels), keys)
    reading = {"encoding": re.sub("-(sig|le|be)$", "", encoding)}
    above, first, heads, said = [list(labels)], 0, list[list[str]](), dict[str, Any]()
    if not labels:  # Otherwise, what stands above the samples is no head of a table.
        decimal, thousands = dialect.style
        reading |= {"delimiter": dialect.delimiter, "decimal": decimal, "thousands": thousands}
        _check_thousands(known[dialect.first :], dialect, keys)
        above = [dialect.split(line) for _, line in known[: dialect.first]]
        for number, line in known[: dialect.first]:
            if match := _UNIT_LINE.fullmatch(line):
                comments[number] = f"unit: {match[2]}"
        # LabVIEW names a column of comments that the samples may leave out.
        above = [row[:-1] if row[dialect.cells :] == ["Comment"] else row for row in above]
        heads, said = above, _labview(above, dialect)
        above = _above(known, above, comments, dialect, is_log=is_log)
        first = known[dialect.first][0]
    rows = ((number, dialect.split(line)) for number, line in again if number >= first)
    table = _table(
        above,
        rows,
        dialect,
        keys,
        stamps=stamps if is_log else {},
        is_log=is_log,
        heads=heads,
        said=said,
        notes=_notes(comments),
        reading=reading,
    )
    # Behind a quote, the last number is whole, too.
    ends = content.rstrip(b" \t\0")[-1:] in (b"", b"\r", b"\n", b'"')
    return table if ends else _checked_end(table, known, dialect)


def _checked_end(table: Table, known: Sequence[_Line], dialect: _Dialect) -> Table:
    """Return the table of a file without a last line end, with a note if it may be cut off."""
    rows = [dialect.split(line) for _, line in known[dialect.first :]]
    cells = [row[-1].replace(",", ".") for row in rows if len(row) == dialect.cells]
    if len(rows[-1]) != dialect.cells or not np.isfinite(dialect.number(rows[-1][-1])):
        return table
    if "format_version" in table.notes or lost_digits(cells):
        raise cut_off(known[-1][0])
    if max(map(len, cells)) == len(cells[-1]):
        return table
    told = f"the last line has no end, so {cells[-1][:60]!r} may lack digits"
    return replace(table, remark="; ".join(filter(None, (table.remark, told))))


def _check_thousands(lines: Sequence[_Line], dialect: _Dialect, keys: Keys) -> None:
    """Raise an error if points can separate thousands: numbers with one jump a thousandfold."""
    if "point" not in dialect.style or keys.thousands or keys.decimal:
        return
    rows = [row for _, line in lines if len(row := dialect.split(line)) == dialect.cells]
    for column in zip(*rows, strict=True):
        pointed = [cell for cell in column if "." in cell]
        if pointed and all(map(_NUMBERS["comma", "point"].fullmatch, pointed)):
            # Where a whole number and one with a point stand below each other.
            jumps = [
                float(min(pair, key=_has_point)) / float(max(pair, key=_has_point))
                for pair in pairwise(column)
                if _has_point(pair[0]) != _has_point(pair[1])
                and re.fullmatch("[1-9][0-9]{0,2}", min(pair, key=_has_point))
            ]
            if jumps and np.median(jumps) > _THOUSANDFOLD:
                number = next(number for number, line in lines if pointed[0] in line)
                raise QuestionError(
                    f"line {number}: {pointed[0]!r} can be {float(pointed[0]):g} (--decimal point) "
                    f"or {pointed[0].replace('.', '')} (--thousands point); choose one"
                )


def _has_point(cell: str) -> bool:
    return "." in cell


def _labview(above: Sequence[list[str]], dialect: _Dialect) -> dict[str, Any]:
    """Return what the lines above a table of LabVIEW or LabChart say: names, units, rate, start."""
    said = {row[0].rstrip("=").lower(): row[1:] for row in above if len(row) > 1}
    told: dict[str, Any] = {}
    if "channeltitle" in said:
        told["names"] = ["time", *said["channeltitle"]]
    for key in ("y_unit_label", "unitname", "range"):
        if units := [cell.rpartition(" ")[2] for cell in said.get(key, ())]:
            told.setdefault("units", ["", *units])
    if "delta_x" in said and (step := dialect.number(said["delta_x"][0])) > 0:
        told["rates_hz"] = {"Delta_X": round(1.0 / step, 9)}
    if "delta_x" in said and "date" in said and "time" in said:
        told["started"] = f"{said['date'][0].replace('/', '-')}T{said['time'][0][:8]}"
    return told


def read_rows(rows: _Rows, keys: Keys, title: str) -> Table:
    """Return the table in the rows of a sheet; empty rows and rows above the names are left out.

    `rows` holds the number of each row, and its cells; all rows have the same number of cells.
    """
    rows = [row for row in rows if row[0] > (keys.skip_lines or 0) and any(row[1])]
    way = _found([cells for _, cells in rows], _plain(keys), keys.sensor_count)
    if way is None:
        return Table((), "sheet", title)
    above, below = rows[: way.first], rows[way.first :]
    # Empty cells that have a format make rows wider.
    width = max(at for _, cells in below for at, cell in enumerate(cells, 1) if cell)
    named = [cells[:width] for _, cells in above if sum(map(bool, cells[:width])) > width / 2]
    samples = ((number, cells[:width]) for number, cells in below)
    way = way._replace(cells=width)
    return _table(named, samples, way, keys, kind="sheet", label=title)


def _encoding(content: bytes, given: str | None) -> str:
    """Return the codec of a text, which is detected if None is given."""
    if not content:
        raise CapsuleError("the file is empty; export it again")
    head, codecs = content[:4000], ["utf-8-sig", "cp1252", "latin-1"]
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        codecs = ["utf-16"]
    elif b"\x00" in head:
        # In UTF-16, a Latin letter has its null byte second (little endian) or first (big endian).
        is_little = head[1::2].count(0) > head[0::2].count(0)
        codecs = ["utf-16-le" if is_little else "utf-16-be"]
    if given:
        # Without a byte order mark, take the order of Windows.
        codecs = codecs[:1] if codecs[0].startswith(given) else [given.replace("16", "16-le")]
    for codec in codecs:
        try:
            if "\x00" not in content.decode(codec):
                return codec
            fault = "it holds null characters"
        except UnicodeDecodeError as error:
            fault = f"byte {error.start + 1} is not {codec.removesuffix('-sig')}"
    raise CapsuleError(
        f"the file is not readable text: {fault}; use --encoding, or export the file as text"
    )


def _lines(
    content: bytes, encoding: str, skipped: int, comments: dict[int, str]
) -> Iterator[_Line]:
    """Yield the lines of a text that are not empty, but for those to skip; collect comments."""
    stream = io.TextIOWrapper(io.BytesIO(content), encoding)
    for number, line in enumerate(stream, start=1):
        stripped = line.strip()
        if number <= skipped or not stripped:
            continue
        if len(line) > _LONGEST_LINE:
            raise CapsuleError(
                f"line {number} has {len(line)} characters, but a line of a table has at most "
                f"{_LONGEST_LINE}; choose another file"
            )
        if stripped.startswith(_COMMENT):
            comments[number] = stripped.lstrip("".join(_COMMENT)).strip()
        else:
            yield number, line.removesuffix("\n")


def _bare(lines: Iterable[_Line], stamps: dict[int, str]) -> Iterator[_Line]:
    """Yield the lines without the stamps of a serial monitor, which are collected."""
    for number, line in lines:
        if match := _STAMP.fullmatch(line):
            *told, line = match.groups()
            stamps[number] = next(filter(None, told))
        if line.strip():
            yield number, line.strip()


def _notes(comments: Mapping[int, str]) -> dict[str, str]:
    """Return the comments of the form ``key: value``, by key."""
    notes: dict[str, tuple[str, int]] = {}
    for number, text in comments.items():
        if match := _IN_UNIT.fullmatch(text):
            if is_unit(match[2]):
                key = "time unit" if match[1].lower().startswith("time") else "unit"
                notes.setdefault(key, (match[2], number))
        elif match := _NOTE.fullmatch(text):
            key, value = match.groups()
            if re.search("unit|einheit", key, re.IGNORECASE):
                key = "time unit" if re.match("time|zeit", key, re.IGNORECASE) else "unit"
            other, line = notes.get(key, (value, number))
            if key in _DECISIVE and other != value:
                raise CapsuleError(
                    f"lines {line} and {number} name two values of {key}, {other[:60]!r} and "
                    f"{value[:60]!r}; delete the line that is wrong"
                )
            notes[key] = value, number
    return {key: value for key, (value, _) in notes.items()}


def _labels(line: str) -> tuple[str, ...]:
    """Return the labels of a line; empty if it holds anything but labelled numbers."""
    if len(line) > _LONGEST_LABELLED or _LABELLED.sub("", line).strip(" \t,;|"):
        return ()
    return tuple(label for label, _ in _LABELLED.findall(line))


def _guess_dialect(lines: Sequence[_Line], plain: _Dialect, keys: Keys) -> _Dialect:
    """Return the dialect of a text file's table; raise an error for none, and for several."""
    few = lines if len(lines) <= _TRIED else [*lines[: _TRIED // 2], *lines[-_TRIED // 2 :]]
    ways = _distinct(few, plain, keys)
    if len(few) < len(lines) and (len(ways) > 1 or any(way.first >= len(few) // 2 for way in ways)):
        ways = _distinct(lines, plain, keys)
    if not ways:
        number, text = lines[len(lines) // 2] if lines else (1, "")
        raise CapsuleError(
            f"line {number}: there is no table with {keys.sensor_count} columns of numbers, "
            "separated by commas, semicolons, tabs, spaces or bars; the line is "
            f"{text.strip()[:60]!r}; describe the format with --delimiter, --decimal and "
            "--skip-lines"
        )
    if len(ways) > 1:
        raise QuestionError(_ambiguity(lines, ways))
    return ways[0]


def _distinct(lines: Sequence[_Line], plain: _Dialect, keys: Keys) -> list[_Dialect]:
    """Try each dialect; return those that read different numbers, one of each."""
    # A point is a decimal sign, unless commas appear, too.
    both = any("," in text and "." in text for _, text in lines)
    quotes = any('"' in text for _, text in lines)
    ways: list[_Dialect] = []
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
            and (way := _found(rows, plain._replace(style=style), keys.sensor_count))
        ]
        # With the same delimiter, the style that reads more cells as numbers is the right one.
        ways += [way for way in same if way.share == max(other.share for other in same)]
    # The line above the first sample may name several columns.
    if any(way.first and len(way.split(lines[way.first - 1][1])) == way.cells > 1 for way in ways):
        ways = [way for way in ways if way.cells > 1]
    distinct: list[_Dialect] = []
    for way in ways:
        # In a table with tabs, spaces are part of a name or of an empty cell.
        beside_tab = way.delimiter == "space" and any(each.delimiter == "tab" for each in distinct)
        fewer = way.share < max(other.share for other in ways) - _FEWER_NUMBERS
        known = any(np.array_equal(way.numbers, each.numbers, equal_nan=True) for each in distinct)
        if not beside_tab and not fewer and not known:
            distinct.append(way)
    return distinct


def _found(rows: Sequence[list[str]], way: _Dialect, sensors: int) -> _Dialect | None:
    """Return a dialect with the table that it finds in the rows, if there is one."""
    if not rows:
        return None
    widths = Counter(map(len, rows[len(rows) // 4 :]))
    width = len(way.labels) or widths.most_common(1)[0][0]
    is_wide = np.array([len(row) == width for row in rows])
    numbers = np.full((len(rows), width), np.inf)
    numbers[is_wide] = [list(map(way.number, row)) for row in rows if len(row) == width]
    there = np.isfinite(numbers).sum(axis=1)
    # A line with a missing sample may hold only the time.
    whole = (there >= sensors) | ((there > 0) & ~np.isinf(numbers).any(axis=1))
    # A word in a column of numbers is a name or a mark, and its row not the first sample.
    is_word = np.isinf(numbers) & is_wide[:, None]
    is_named = (is_word & (np.mean(is_word[is_wide], axis=0) < 0.5)).any(axis=1)
    first = int(np.argmax((there >= sensors) & ~is_named))
    while first > 0 and whole[first - 1] and not is_named[first - 1]:
        first -= 1
    if there.max() < sensors or whole[first:].sum() < max(2, _LEAST_ROWS * (len(rows) - first)):
        return None
    below = numbers[first:][is_wide[first:]]
    share = float(np.mean(~np.isinf(below)))
    return way._replace(cells=width, first=first, share=share, numbers=below)


def _ambiguity(lines: Sequence[_Line], ways: Sequence[_Dialect]) -> str:
    """Return a message that names an ambiguous cell or line, and the options that decide."""
    widest, readings = min(ways, key=lambda way: way.cells), list[str]()
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
            parts = " and ".join(part for part in way.split(text) if part)
            readings.append(f"columns, {parts} (--delimiter {way.delimiter})")
        else:
            value, (decimal, thousands) = way.number(cell), way.style
            option = f"--decimal {decimal}" if thousands == "none" else f"--thousands {thousands}"
            told = "no number" if np.isinf(value) else f"{value:.12g}"
            readings.append(f"{told} ({option})")
    return f"line {number}: {text!r} can be {' or '.join(readings)}; choose one"


def _above(
    lines: Sequence[_Line],
    above: list[list[str]],
    comments: Mapping[int, str],
    dialect: _Dialect,
    *,
    is_log: bool,
) -> list[list[str]]:
    """Return which rows above the first sample of a text may hold the names.

    A broken sample between the names and the first whole one is an error, except in a log.
    """
    first = lines[dialect.first][0]
    # Commas are delimiters and decimal signs if there are half as many names as cells.
    if dialect.delimiter == "comma" and above and len(above[-1]) * 2 == dialect.cells:
        raise CapsuleError(
            f"line {first} has {dialect.cells} cells, but line {lines[dialect.first - 1][0]} names "
            f"{len(above[-1])} columns: a comma seems to be delimiter and decimal sign; export it "
            "with another delimiter"
        )
    if above and _are_names(above[-1], dialect):
        return above
    is_below_names = False
    for (number, _), row in zip(lines, above, strict=False):
        if is_below_names and not is_log and 2 * _numbers_in(row, dialect) > len(row):
            raise _incomplete(f"line {number}", row, dialect)
        is_below_names |= _are_names(row, dialect)
    # np.savetxt writes the names as a comment.
    return [dialect.split(text) for number, text in comments.items() if number < first][-1:]


def _numbers_in(row: Sequence[str], dialect: _Dialect) -> int:
    return sum(dialect.number(cell) != np.inf for cell in row if cell)


def _are_names(row: Sequence[str], dialect: _Dialect) -> bool:
    """Return whether a row names the columns: most cells are words, or one is a time's name."""
    has_words = _numbers_in(row, dialect) <= dialect.cells / 2 or any(map(is_time_name, row))
    return len(row) == dialect.cells and has_words


def _incomplete(line: str, row: Sequence[str], dialect: _Dialect) -> CapsuleError:
    for cell in row if len(row) == dialect.cells else ():
        if dialect.number(cell) == np.inf:
            return CapsuleError(f"{line}: {not_a_number(cell)}")
    return CapsuleError(
        f"{line} has {len(row)} cells, but there are {dialect.cells} columns; complete the line, "
        "copy the file again, or delete the line"
    )


def _table(
    above: Iterable[list[str]],
    rows: Iterator[tuple[int, list[str]]],
    dialect: _Dialect,
    keys: Keys,
    *,
    stamps: Mapping[int, str] | None = None,
    is_log: bool = False,
    heads: Sequence[list[str]] = (),
    said: Mapping[str, Any] | None = None,
    **told: Any,
) -> Table:
    """Return a table of cells of text; in a log, without lines that hold no whole sample.

    Of the rows above, the last one whose cells are words holds the names, or the units below them:
    names differ from each other. A line that begins as one of `heads` does, repeats them.
    """
    named = [[cell.strip('" ') for cell in row] for row in above if _are_names(row, dialect)]
    heads_only = [[""] * dialect.cells, *named]
    names, units = heads_only[-1], heads_only[0]
    if len(heads_only) > 2 and _are_units(*heads_only[-2:]):
        names, units = heads_only[-2:]
    how = dict(said or {})
    names, units = how.pop("names", names), how.pop("units", units)
    begun = {row[0] for row in heads if row and dialect.number(row[0]) == np.inf}
    lines, restarts, passed_over = array("q"), list[int](), list[int]()
    columns, words = [array("d") for _ in names], [list[str]() for _ in names]
    for line, cells in rows:
        if cells and cells[0] in begun:
            restarts += [len(lines)] if restarts[-1:] != [len(lines)] else []
            continue
        # A remark may stand behind a sample.
        if len(cells) == dialect.cells + 1 and re.fullmatch("#.*|[^0-9]*", cells[-1]):
            cells.pop()
        numbers = [dialect.number(cell) for cell in cells]
        is_whole = len(cells) == dialect.cells
        if is_log and not (is_whole and len(cells) - numbers.count(np.inf) >= keys.sensor_count):
            passed_over.append(line)
            continue
        if not is_whole:
            where = ", the last one," if next(rows, None) is None else ""
            raise _incomplete(f"line {line}{where}", cells, dialect)
        lines.append(line)
        for column, texts, cell, number in zip(columns, words, cells, numbers, strict=True):
            column.append(np.nan if number == np.inf else number)
            texts.append(cell if number == np.inf else "")
    if restarts and not lines:
        raise CapsuleError(
            f"each line begins with {heads[-1][0]!r}, as the first one does, so none is a sample; "
            "describe the format with --delimiter, --decimal and --skip-lines"
        )
    channels = [
        Channel(name, np.asarray(numbers), unit, texts if any(texts) else (), **how)
        for name, unit, numbers, texts in zip(names, units, columns, words, strict=True)
    ]
    stamped = [stamps.get(line, "") for line in lines] if stamps else [""]
    if all(stamped):
        seconds = np.array(list(map(_plain(keys).number, stamped)))
        if np.inf in seconds:
            channels.insert(0, Channel(STAMP_NAME, np.full(len(lines), np.nan), "clock", stamped))
        else:
            channels.insert(0, Channel(STAMP_NAME, seconds, "s"))
    return Table(
        channels, lines=np.asarray(lines), passed_over=passed_over, restarts=restarts, **told
    )


def _are_units(above: Sequence[str], cells: Sequence[str]) -> bool:
    """Return whether the cells below a row of names are units: all known, or some alike."""
    filled = [cell for cell in cells if cell]
    are_names = len({*filter(None, above)}) == sum(map(bool, above)) > 1
    are_units = len({*filled}) < len(filled) or all(map(is_unit, filled))
    return (are_names and are_units) or None not in map(unit_of, cells)
