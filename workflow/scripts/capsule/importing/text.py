"""Read text files: tables of any dialect, and logs of a serial line; and the rows of workbooks.

A file is read line by line, so a long one takes little memory.
"""

import io
import re
from array import array
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, pairwise, zip_longest
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.dialects import (
    TRIED,
    Dialect,
    Line,
    check_thousands,
    guess_dialect,
    labels_of,
    plain_dialect,
    table_in,
)
from capsule.importing.joining import with_own_times
from capsule.importing.lab_yaml import Keys
from capsule.importing.stated import (
    MARK,
    bare_unit,
    different,
    facts,
    notes_of,
    stated_rates,
    states_much,
    states_unit,
)
from capsule.importing.table import Channel, Table, not_a_number
from capsule.importing.units import is_unit, unit_of
from capsule.recordings.recording import cut_off, lost_digits

STAMP_NAME = "serial monitor"
_COMMENT = ("#", "%", "//")
_LONGEST_LINE = 100_000
# Lines that are tried if the first ones leave a choice.
_MOST_TRIED = 20_000
# Lines of a serial monitor: a time stamp, an arrow, and the rest; of another terminal: a stamp in
# brackets, or before a blank, a mark or a level and a list; or labels before readings.
_CLOCK = r"[0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?"
_LIST = r"(?![AaPp]\.?[Mm]|UTC|Z|[+-][0-9]{2}:)[^\s,;]+[,;]\s*[^\s,;]+[,;]|\w+[:=]"
_NUMBERS = r"(?=\s*[+-]?[0-9.]+\s*[,;]\s*[+-]?[0-9])"
_STAMP = re.compile(
    rf"\s*(?:({_CLOCK})\s*->"
    rf"|\[\s*([0-9A-Z][^\[\]]*?)(?:\s+[0-9]+\.[0-9]+)?\s*\][:>]?(?:(?:\s*<\w+>)?\s*\w+:{_NUMBERS})?"
    rf"|\(?((?:[0-9]{{4}}-[0-9]{{2}}-[0-9]{{2}}[ T])?{_CLOCK}Z?)"
    rf"(?:(?=\s+(?:{_LIST}))|(?:\)|:|\s*>|\s+(?:[A-Z]+|\w+/\w+:)){_NUMBERS}))\s?(.*)"
)
# Least share of the lines that must look like those of a serial log.
_LEAST_SHARE = 0.5
# Words of a column that are looked through for a unit.
_MOST_WORDS = 20


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
    known = [*islice(lines, _MOST_TRIED), *deque(lines, maxlen=TRIED // 2)]
    marks = [value for key, value in notes_of(comments).items() if MARK.fullmatch(key)]
    keys = replace(keys, missing=[*(keys.missing or ()), *marks]) if marks else keys
    tried = {number: labels_of(line) for number, line in _bare(known[:TRIED], stamps)}
    logged = stamps.keys() | {number for number, labels in tried.items() if labels}
    is_log, labels = len(logged) > _LEAST_SHARE * len(known[:TRIED]), tuple[str, ...]()
    if is_log:
        known, again = [*_bare(known, stamps)], _bare(again, stamps)
        ((usual, count),) = Counter(tried.values()).most_common(1) or [((), 0)]
        labels = usual if count >= _LEAST_SHARE * len(tried) else ()
    dialect = guess_dialect(known, plain_dialect(keys)._replace(labels=labels), keys)
    reading = {"encoding": re.sub("-(sig|le|be)$", "", encoding)}
    above, first, heads, said = [list(labels)], 0, list[list[str]](), list[dict[str, Any]]()
    warnings = list[str]()
    if not labels:  # Otherwise, what stands above the samples is no head of a table.
        decimal, thousands = dialect.style
        reading |= {"delimiter": dialect.delimiter, "decimal": decimal, "thousands": thousands}
        above = [dialect.split(line) for _, line in known[: dialect.first]]
        words = [cell for cells in above for cell in cells]
        below = ((number, dialect.split(line)) for number, line in known[dialect.first :])
        check_thousands("line", [*words, *comments.values()], below, dialect, keys)
        for (number, line), cells in zip(known, above, strict=False):
            plain, text = line.strip(), ": ".join(filter(None, cells))
            is_unit_alone = len(cells) < dialect.cells and bare_unit(plain)
            if (much := states_much(text)) or states_unit(plain) or is_unit_alone:
                comments[number] = text if much else plain
        heads, said = above, _labview(above, dialect)
        above, warnings = _above(known, above, comments, dialect, is_log=is_log)
        first = known[dialect.first][0]
    rows = ((number, dialect.split(line)) for number, line in again if number >= first)
    notes = notes_of(comments)
    remarks = [*comments.values()]
    for (number, line), row in zip(known, heads, strict=False):
        if not (number in comments or dialect.names_columns(row)):
            remarks.append(line if dialect.delimiter != "tab" else ": ".join(filter(None, row)))
    # In a log with labels, so do the lines with none of these.
    others = [line for _, line in known[:TRIED] if not {*labels_of(line)} & {*labels}]
    remarks += others if labels else []
    table = _table(
        above,
        rows,
        dialect,
        keys,
        stamps=stamps if is_log else {},
        is_log=is_log,
        heads=heads,
        said=said,
        notes=notes,
        # A recording of this project tells all that was done to it; another hand adds units.
        remarks=list(filter(bare_unit, remarks)) if "format_version" in notes else remarks,
        reading=reading,
        warnings=warnings,
    )
    # Behind a quote, the last number is whole, too.
    ends = content.rstrip(b" \t\0")[-1:] in (b"", b"\r", b"\n", b'"')
    return table if ends else _checked_end(table, known, dialect)


def _checked_end(table: Table, known: Sequence[Line], dialect: Dialect) -> Table:
    """Return the table of a file without a last line end, with a note if it may be cut off."""
    rows = [dialect.split(line) for _, line in known[dialect.first :]]
    cells = [row[-1].replace(",", ".") for row in rows if len(row) == dialect.cells]
    if len(rows[-1]) == dialect.cells and not cells[-1] and sum(map(bool, cells)) > len(cells) / 2:
        raise cut_off(known[-1][0])
    if len(rows[-1]) != dialect.cells or not np.isfinite(dialect.number(rows[-1][-1])):
        return table
    if "format_version" in table.notes or lost_digits(cells):
        raise cut_off(known[-1][0])
    if max(map(len, cells)) == len(cells[-1]):
        return table
    told = f"the last line has no end, so {cells[-1][:60]!r} may lack digits"
    return replace(table, warnings=[*table.warnings, told])


def _labview(above: Sequence[list[str]], dialect: Dialect) -> list[dict[str, Any]]:
    """Return what the lines above a table of LabVIEW or LabChart say of each column.

    The dictionaries hold attributes of `Channel`. Behind its key, a line has a cell a column.
    """
    said = {row[0].rstrip("=").lower(): row for row in above if len(row) > 1}
    columns: list[dict[str, Any]] = [{} for _ in range(dialect.cells)]
    if "channeltitle" in said:
        columns[0] = {"name": "time", "unit": ""}
    for at, column in enumerate(columns[1:], start=1):
        cells = {key: row[at] for key, row in said.items() if at < len(row) and row[at]}
        if "channeltitle" in said:
            column["name"] = cells.get("channeltitle", "")
        units = (cells.get(key, "") for key in ("y_unit_label", "unitname", "range"))
        told: dict[str, Any] = {"unit": next(filter(None, units), "").rpartition(" ")[2]}
        if (step := dialect.number(cells.get("delta_x", ""))) > 0:
            told |= {"delta_x": step, "x0": dialect.number(cells.get("x0", ""))}
            if "date" in cells and "time" in cells:
                told["started"] = f"{cells['date'].replace('/', '-')}T{cells['time'][:8]}"
        column |= facts([told])
    return columns


def read_sheets(
    sheets: Mapping[str, Sequence[list[str]]],
    units: Mapping[str, Sequence[str]],
    remarks: Sequence[str],
    keys: Keys,
) -> Iterator[Table]:
    """Yield the table in the rows of each sheet, by its title; empty if there is none.

    Empty rows and rows above the names are left out. What a sheet without a table says of units,
    rates and scales holds for the others. All rows of a sheet have the same number of cells.
    `units` holds those that the forms of a sheet's numbers show, one for each column; `remarks`
    what the workbook says beside its cells.
    """
    numbered = {
        title: [
            row
            for row in enumerate(rows, start=1)
            if row[0] > (keys.skip_lines or 0) and any(row[1])
        ]
        for title, rows in sheets.items()
    }
    plain = plain_dialect(keys)
    ways = {
        title: table_in([cells for _, cells in rows], plain, keys.sensor_count)
        for title, rows in numbered.items()
    }
    beside = [cells for title, way in ways.items() if way is None for _, cells in numbered[title]]
    for title, way in ways.items():
        if way is None:
            yield Table((), "sheet", title)
        else:
            yield _sheet(numbered[title], way, keys, title, beside, units[title], remarks)


def _sheet(
    rows: Sequence[tuple[int, list[str]]],
    way: Dialect,
    keys: Keys,
    title: str,
    beside: Sequence[list[str]],
    units: Sequence[str],
    remarks: Sequence[str],
) -> Table:
    """Return the table in the rows of a sheet, and what the rows of other sheets say of it."""
    above = rows[: way.first]
    # Empty cells that have a format make rows wider.
    width = max(at for _, cells in rows[way.first :] for at, cell in enumerate(cells, 1) if cell)
    below = [(number, cells[:width]) for number, cells in rows[way.first :]]
    named = [cells[:width] for _, cells in above if sum(map(bool, cells[:width])) > width / 2]
    said = {
        n: ": ".join(dict.fromkeys(filter(None, cells))) for n, cells in above if len({*cells}) <= 3
    }
    beside = [*beside, *(cells[width:] for _, cells in above)]
    unnamed = [cells for _, cells in above if cells[:width] not in named]
    words = [": ".join(filter(None, cells)) for cells in [*beside, *unnamed]]
    # In a sheet of channels, a value stands below its name.
    below_names = [pairwise(column) for column in zip_longest(*beside, fillvalue="")]
    words += [": ".join(pair) for column in below_names for pair in column if all(pair)]
    told = [
        notes_of({0: text}) for text in words[: len(beside)] if states_much(text) or bare_unit(text)
    ]
    merged: dict[str, str] = {}
    for key, value in (pair for notes in told for pair in notes.items()):
        merged[key] = value if merged.get(key, value) == value else f"{merged[key]}, {value}"
    notes = merged | notes_of(said)
    way = way._replace(cells=width)
    heads = [*words, *(cell for row in named for cell in row)]
    check_thousands("row", heads, below, way, keys)
    return _table(
        named,
        iter(below),
        way,
        keys,
        said=[{"unit": unit} if unit else {} for unit in units[:width]],
        remarks=[*words, *remarks],
        kind="sheet",
        label=title,
        notes=notes,
    )


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


def _lines(content: bytes, encoding: str, skipped: int, comments: dict[int, str]) -> Iterator[Line]:
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


def _bare(lines: Iterable[Line], stamps: dict[int, str]) -> Iterator[Line]:
    """Yield the lines without the stamps of a serial monitor, which are collected."""
    for number, line in lines:
        if match := _STAMP.fullmatch(line):
            *told, line = match.groups()
            stamps[number] = next(filter(None, told))
        if line.strip():
            yield number, line.strip()


def _above(
    lines: Sequence[Line],
    above: list[list[str]],
    comments: Mapping[int, str],
    dialect: Dialect,
    *,
    is_log: bool,
) -> tuple[list[list[str]], list[str]]:
    """Return which rows above the first sample of a text may hold the names, and notes.

    A broken sample between the names and the first whole one is an error, except in a log. Without
    names above it, or in a log, the one just before the first whole one gets a note.
    """
    first = lines[dialect.first][0]
    # Commas are delimiters and decimal signs if there are half as many names as cells.
    if dialect.delimiter == "comma" and above and len(above[-1]) * 2 == dialect.cells:
        raise CapsuleError(
            f"line {first} has {dialect.cells} cells, but line {lines[dialect.first - 1][0]} names "
            f"{len(above[-1])} columns: a comma seems to be delimiter and decimal sign; export it "
            "with another delimiter"
        )
    rows = [dialect.split(text) for number, text in comments.items() if number < first]
    if above and dialect.names_columns(above[-1]):
        # Below or above the names, a comment can hold their units.
        return above + [row for row in rows if all(map(is_unit, filter(None, row)))][-1:], []
    is_below_names, notes = False, list[str]()
    for (number, line), row in zip(lines, above, strict=False):
        if is_below_names and not is_log and 2 * dialect.count_numbers(row) > len(row):
            raise _incomplete(f"line {number}", row, dialect)
        is_below_names |= dialect.names_columns(row)
        told = f"line {number}, {line.strip()[:60]!r}, is passed over: it is no whole sample"
        notes = [told] if 2 * dialect.count_numbers(row) >= len(row) else []
    # np.savetxt writes the names as a comment.
    return rows[-1:], notes


def _incomplete(line: str, row: Sequence[str], dialect: Dialect) -> CapsuleError:
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
    dialect: Dialect,
    keys: Keys,
    *,
    stamps: Mapping[int, str] | None = None,
    is_log: bool = False,
    heads: Sequence[list[str]] = (),
    said: Sequence[Mapping[str, Any]] = (),
    remarks: Sequence[str] = (),
    **told: Any,
) -> Table:
    """Return a table of cells of text; in a log, without lines that hold no whole sample.

    Of the rows above, the last one whose cells are words holds the names, or the units below them:
    names differ from each other. A line that begins as one of `heads` does, repeats them.
    """
    named = [[cell.strip('" ') for cell in row] for row in above if dialect.names_columns(row)]
    heads_only = [[""] * dialect.cells, *named]
    names, units = heads_only[-1], heads_only[0]
    if len(heads_only) > 2 and _are_units(*heads_only[-2:]):
        names, units = heads_only[-2:]
    begun = {row[0] for row in heads if row and dialect.number(row[0]) == np.inf}
    lines, restarts, passed_over = array("q"), list[int](), list[int]()
    columns, words = [array("d") for _ in names], [list[str]() for _ in names]
    for line, cells in rows:
        if cells and cells[0] in begun:
            restarts += [len(lines)] if restarts[-1:] != [len(lines)] else []
            continue
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
        Channel(name, np.asarray(numbers), unit, texts if any(texts) else ())
        for name, unit, numbers, texts in zip(names, units, columns, words, strict=True)
    ]
    if said:
        channels = [replace(each, **how) for each, how in zip(channels, said, strict=True)]
    if rates_hz := stated_rates([told["notes"]]):
        channels = [replace(each, rates_hz=each.rates_hz or rates_hz) for each in channels]
    channels = with_own_times(channels, keys)
    stamped = [stamps.get(line, "") for line in lines] if stamps else [""]
    if all(stamped):
        seconds = np.array(list(map(plain_dialect(keys).number, stamped)))
        if np.inf in seconds:
            channels.insert(0, Channel(STAMP_NAME, np.full(len(lines), np.nan), "clock", stamped))
        else:
            channels.insert(0, Channel(STAMP_NAME, seconds, "s"))
    # Of a column, and of what stands above the names, a word can be the unit.
    remarks = [*remarks, *(cell for row in heads_only[:-1] for cell in row)]
    for each in channels:
        cells = [] if each.holds_numbers else [*dict.fromkeys(filter(None, each.words))]
        remarks += cells[:_MOST_WORDS]
        is_lone = not each.name and len(cells) == 1 and bare_unit(cells[0])
        if is_lone or (cells and re.search("unit|einheit", each.name, re.IGNORECASE)):
            told["notes"].setdefault("unit", different(cells[:_MOST_WORDS]))
    return Table(
        channels,
        lines=np.asarray(lines),
        passed_over=passed_over,
        restarts=restarts,
        remarks=remarks,
        **told,
    )


def _are_units(above: Sequence[str], cells: Sequence[str]) -> bool:
    """Return whether the cells below a row of names are units: all known, or some alike."""
    filled = [cell for cell in cells if cell]
    are_names = len({*filter(None, above)}) == sum(map(bool, above)) > 1
    are_units = len({*filled}) < len(filled) or all(map(is_unit, filled))
    return (are_names and are_units) or None not in map(unit_of, cells)
