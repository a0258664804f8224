"""The file format of a recording: its only reader and its only writer.

A recording is a text file: ``# key: value`` lines, one line of column names, and one line for each
sample. Only the columns ``time_s, sensor_1 ... sensor_S`` are required. In the line of a missing
sample (the board was unplugged), the sensor cells are empty.

The Snakefile reads the header lines at every start, so this module imports only fast modules.
"""

import array
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np

from capsule.arrays import FloatArray, NumberArray
from capsule.errors import RecordingError

FORMAT_VERSION = "1"
# ASCII digits only: float() would also accept digits of other scripts.
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
# No clock and no ADC gives more than this; its square is far from overflow.
LARGEST_NUMBER = 1e20
# No recording comes near these limits. A file beyond them is something else: it is rejected at
# once, because reading it in full could take minutes.
LONGEST_LINE = 10_000
_MOST_LINES = 200_000
# No recording comes near this limit. A file beyond it is something else.
_LONGEST_HEADER = 1000
# The report shows every header in full.
_MOST_HEADER_CHARACTERS = 10_000
# Header line with the time from which on no wave ran, in s, or with `TO_THE_END`.
WAVE_UNTIL, TO_THE_END = "wave_until_s", "end"
# Header lines that decide how a recording is read, taught from and judged. Each may have one value.
DECISIVE = (
    *("site", "session", "setup", "unit", "nodule_at_mm", "adc_bits", "vref_v", "series_ohm"),
    WAVE_UNTIL,
)


def _bare(key: str) -> str:
    """Return a key as it is read by someone who does not know its spelling."""
    return re.sub(r"[\s_-]", "", key).lower().removesuffix("s")


_MEANT = {_bare(key): key for key in (*DECISIVE, "rate_hz")}
# A remark that is nothing but a unit.
_UNIT_ALONE = re.compile(
    r"[\[(]?([kmuµμ]?(pa|n|v|ω|ohms?|bar|gf?)|psi|mmhg|counts?)[\])]?", re.IGNORECASE
)


@dataclass(frozen=True)
class Recording:
    """One run of the capsule along the intestine.

    Attributes
    ----------
    time_s : (K,) array
        Time of each sample in seconds.
    values : (S, K) array
        Readings of the S sensors, ADC counts or volts; NaN where a sample is missing.
    header : dict of str to str
        The ``# key: value`` lines of the file.
    """

    time_s: FloatArray
    values: NumberArray
    header: Mapping[str, str] = field(default_factory=dict)


class ForeignFileError(RecordingError):
    """The error of a file that another program may have written, which the import may read."""


def source_of(header: Mapping[str, str]) -> str:
    """Return where a recording comes from, with the simulator's version, bench and seed if any."""
    named = [header.get("source", "")]
    for key in ("version", "bench", "seed"):
        if f"simulator_{key}" in header:
            named.append(f"{key} {header[f'simulator_{key}']}")
    return ", ".join(part for part in named if part)


def wave_until_s(header: Mapping[str, str]) -> float:
    """Return the time from which on no wave ran; infinite if it ran to the end or nobody says.

    Raises
    ------
    RecordingError
        The header says something else.
    """
    stated = header.get(WAVE_UNTIL, TO_THE_END).strip()
    if stated == TO_THE_END:
        return math.inf
    if not _NUMBER.fullmatch(stated):
        raise RecordingError(
            f"the header says {WAVE_UNTIL}: {_shorten(stated)!r}; write the time in s from which "
            f"on no wave ran, or {TO_THE_END!r} if it ran to the end"
        )
    return float(stated)


def header_number(
    header: Mapping[str, str], key: str, *, may_be_negative: bool = False
) -> float | None:
    """Return the number that a header line states, None without the line.

    Raises
    ------
    RecordingError
        The line states something else; 0 or less is none, unless the number may be negative.
    """
    stated = header.get(key, "")
    if not stated:
        return None
    if not re.fullmatch(r"[+-]?[0-9]{1,6}(\.[0-9]{1,6})?", stated):
        raise RecordingError(f"the header says {key}: {_shorten(stated)!r}, which is not a number")
    if not (may_be_negative or float(stated) > 0):
        raise RecordingError(f"the header says {key}: {stated}; it must be above 0")
    return float(stated)


def rate_of(header: Mapping[str, str]) -> str:
    """Return the sampling rate in Hz that the header states; empty if it states none.

    If a recording was resampled at its import, it is the rate before, rounded to two digits.
    """
    stated = header.get("rate_hz", "").strip()
    before = re.match(rf"from ({_NUMBER.pattern}) Hz", header.get("import_resampled", ""))
    if before:
        stated = f"{float(before[1]):.2g}"
    return f"{float(stated):g}" if _NUMBER.fullmatch(stated) else stated


def column_names(sensors: int) -> list[str]:
    """Return the required columns of a recording with this many sensors."""
    return ["time_s", *(f"sensor_{s}" for s in range(1, sensors + 1))]


def read_recording(stream: BinaryIO, sensors: int, max_bytes: int = 16_000_000) -> Recording:
    """Read a recording.

    Parameters
    ----------
    stream : binary file
        The file, open for reading.
    sensors : int
        Number of sensors S that the file must hold.
    max_bytes : int
        Limit of the file's size; of a larger file, only one byte more than this is read.

    Raises
    ------
    RecordingError
        The bytes are not a recording of S sensors; the text says why and in which line.
    ForeignFileError
        The same, for a table of another form.
    """
    content = stream.read(max_bytes + 1)
    if len(content) > max_bytes:
        raise too_large(max_bytes)
    text = _decode(content)
    if not text:
        # The file holds only a byte order mark.
        raise RecordingError("the file is empty")
    text = one_line_end(text)
    if text.count("\n") > _MOST_LINES:
        raise RecordingError(
            f"the file has {text.count(chr(10))} lines; a recording has at most {_MOST_LINES}"
        )
    lines = text.split("\n")
    complete = lines[-1] == ""
    if complete:
        lines.pop()
    longest = max(range(len(lines)), key=lambda index: len(lines[index]))
    if len(lines[longest]) > LONGEST_LINE:
        raise RecordingError(
            f"line {longest + 1} has {len(lines[longest])} characters; a line of a recording "
            f"has at most {LONGEST_LINE}"
        )
    header, first_row = split_header(lines)
    if first_row == len(lines):
        raise RecordingError("the file ends after its header; column names and samples are missing")
    order = _column_order(lines[first_row], sensors, first_row + 1)
    version = header.get("format_version")
    last_cells = [line.rpartition(",")[2].strip() for line in lines[first_row + 1 :]]
    if not complete and (version is not None or lost_digits(last_cells)):
        raise cut_off(len(lines))
    if version not in (None, FORMAT_VERSION):
        raise RecordingError(
            f"the header says format_version {_shorten(version)!r}; "
            f"this program reads version {FORMAT_VERSION} only"
        )
    # A packed array, because lists of floats take ten times the memory.
    cells = array.array("d")
    for number, line in enumerate(lines[first_row + 1 :], start=first_row + 2):
        if line.strip():
            cells.extend(_parse_row(line, order, number))
    if not cells:
        raise RecordingError("the file ends after its column names; the samples are missing")
    table = np.array(cells).reshape(-1, sensors + 1)
    return Recording(table[:, 0], np.ascontiguousarray(table[:, 1:].T), header)


def cut_off(number: int) -> RecordingError:
    """Return the error for a file whose last line, of this number, is cut off."""
    return RecordingError(f"line {number} is cut off: the file ends in mid-line; copy it again")


def lost_digits(cells: Sequence[str]) -> bool:
    """Return whether the last of a column's numbers, with no line end behind it, has lost digits.

    It is shorter than all others; or, with more digits, it would be near the number before.
    """
    *before, last = cells or [""]
    if not before or not _NUMBER.fullmatch(last):
        return False
    if len(last) < min(map(len, before)):
        return True
    if "." in last or not _NUMBER.fullmatch(before[-1]):
        return False
    value, earlier = float(last), float(before[-1])
    return any(abs(value * 10**n - earlier) < abs(value - earlier) / 4 for n in (1, 2, 3))


def too_large(max_bytes: int) -> RecordingError:
    """Return the error for a file that is too large to be a recording."""
    return RecordingError(
        f"the file is larger than {max_bytes / 1e6:g} MB and cannot be one run "
        "(limit: recording.max_megabytes)"
    )


def _decode(content: bytes) -> str:
    if not content:
        raise RecordingError("the file is empty")
    if content.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\x00" in content:
        raise RecordingError("the file is not UTF-8 text (UTF-16, or binary?); save it as UTF-8")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise RecordingError(
            f"byte {error.start + 1} is not UTF-8 text (another encoding?); save it as UTF-8"
        ) from None


def _column_order(line: str, sensors: int, number: int) -> list[int]:
    """Return the index of each required column, and last the number of all columns."""
    if ";" in line or "\t" in line:
        raise ForeignFileError(
            f"line {number} separates columns by semicolons or tabs; "
            "use commas between columns and points in numbers"
        )
    names = [name.strip() for name in line.split(",")]
    wanted = column_names(sensors)
    doubled = sorted(name for name, count in Counter(names).items() if count > 1 and name)
    if doubled:
        raise RecordingError(
            f"line {number}: the column {_shorten(doubled[0])!r} appears more than once"
        )
    missing = [name for name in wanted if name not in names]
    if missing:
        # Without the time, it is another program's table rather than a damaged recording.
        error = ForeignFileError if "time_s" in missing else RecordingError
        raise error(
            f"line {number}: the column {missing[0]!r} is missing; found: {_shorten(line)!r}, "
            f"required: {','.join(wanted)}"
        )
    surplus = [
        name for name in names if re.fullmatch(r"sensor_[0-9]+", name) and name not in wanted
    ]
    if surplus:
        raise RecordingError(
            f"line {number}: there is a column {_shorten(surplus[0])!r}, "
            f"but recording.sensors is {sensors}"
        )
    return [names.index(name) for name in wanted] + [len(names)]


def _parse_row(line: str, order: Sequence[int], number: int) -> list[float]:
    cells = line.split(",")
    if len(cells) != order[-1]:
        raise RecordingError(
            f"line {number} has {len(cells)} cells, but there are {order[-1]} columns "
            "(a cut-off line, or decimal commas?)"
        )
    picked = [cells[index].strip() for index in order[:-1]]
    if picked[0] and not any(picked[1:]):
        picked[1:] = ["nan"] * (len(picked) - 1)
        return [_parse_number(picked[0], number), *map(float, picked[1:])]
    return [_parse_number(cell, number) for cell in picked]


def _parse_number(cell: str, number: int) -> float:
    # float() alone would let nan, inf and 1_000 pass.
    if not _NUMBER.fullmatch(cell):
        empty = "a cell is empty; for a missing sample, leave all sensor cells empty"
        what = f"{_shorten(cell)!r} is not a number" if cell else empty
        raise RecordingError(f"line {number}: {what}")
    value = float(cell)
    if abs(value) > LARGEST_NUMBER:
        raise RecordingError(f"line {number}: {_shorten(cell)!r} is too large")
    return value


def _shorten(text: str, length: int = 60) -> str:
    return text if len(text) <= length else text[: length - 3] + "..."


def format_header(header: Mapping[str, str], sensors: int) -> str:
    """Return the first lines of a recording: ``# key: value`` lines and the column names.

    Parameters
    ----------
    header : mapping of str to str
        Facts about the run; ``format_version`` is added.
    sensors : int
        Number of sensors S.

    Returns
    -------
    str
        The lines; each ends in a line feed.
    """
    entries = {"format_version": FORMAT_VERSION, **header}
    lines = [f"# {_one_line(key)}: {_one_line(value)}\n" for key, value in entries.items()]
    return "".join(lines) + ",".join(column_names(sensors)) + "\n"


def format_sample(time_s: float, values: Sequence[float] | None, sensors: int = 4) -> str:
    """Return the line of one sample; ``None`` stands for a missing sample.

    Parameters
    ----------
    time_s : float
        Time in seconds.
    values : sequence of S floats, or None
        The readings.
    sensors : int
        Number of empty cells of a missing sample.

    Returns
    -------
    str
        A line that ends in a line feed.
    """
    cells = [""] * sensors if values is None else [_format_number(value) for value in values]
    return ",".join([_format_number(time_s), *cells]) + "\n"


def format_recording(recording: Recording) -> bytes:
    """Return the bytes of a recording's file; `read_recording` returns an equal recording."""
    sensors = recording.values.shape[0]
    lines = [format_header(recording.header, sensors)]
    for time_s, sample in zip(recording.time_s, recording.values.T, strict=True):
        missing = bool(np.isnan(sample).all())
        lines.append(format_sample(time_s, None if missing else sample, sensors))
    return "".join(lines).encode("utf-8")


def _format_number(value: float) -> str:
    number = float(value)
    return str(int(number)) if number.is_integer() and abs(number) < 1e15 else repr(number)


def _one_line(text: object) -> str:
    return " ".join(str(text).split())


def one_line_end(text: str) -> str:
    """Return text whose lines all end in a line feed, whatever the system that wrote them."""
    # splitlines() would also split at form feeds and other characters, which editors do not do.
    return text.replace("\r\n", "\n").replace("\r", "\n")


def split_header(lines: Sequence[str]) -> tuple[dict[str, str], int]:
    """Return the header lines of a recording, and the index of the line of column names.

    Parameters
    ----------
    lines : sequence of str
        The lines of the file, or its first lines.

    Returns
    -------
    header : dict of str to str
        The values by their keys.
    index : int
        The number of lines if all of them are header lines.

    Raises
    ------
    RecordingError
        The header is too long to be one, says two things of the same key, spells the key of a line
        that decides something otherwise, or has a unit without a key.
    """
    header: dict[str, str] = {}
    characters = 0
    for index, line in enumerate(lines):
        stripped = line.strip()
        if stripped and not stripped.startswith("#"):
            return header, index
        key, colon, value = stripped.lstrip("#").partition(":")
        if colon:
            key, value = key.strip(), value.strip()
            meant = _MEANT.get(_bare(key), key)
            if meant != key:
                raise RecordingError(
                    f"line {index + 1}: the header says {_shorten(key)!r}; write {meant!r} if you "
                    "mean that, or else another word"
                )
            if key in DECISIVE and header.get(key, value) != value:
                raise RecordingError(
                    f"line {index + 1}: the header says {key} {header[key]!r} above, and {value!r} "
                    "here; keep the line that is true"
                )
            header[key] = value
        elif _UNIT_ALONE.fullmatch(key.strip()):
            raise RecordingError(
                f"line {index + 1}: {_shorten(stripped)!r} can be the unit of the readings; write "
                "'# unit: ' and counts, V, ohm or kohm if it is, or else take the line out"
            )
        characters += len(stripped)
        if characters > _MOST_HEADER_CHARACTERS:
            raise RecordingError(
                f"line {index + 1}: the header lines hold more than {_MOST_HEADER_CHARACTERS} "
                "characters; keep long notes in a separate file"
            )
        if index >= _LONGEST_HEADER:
            raise RecordingError(f"the first {_LONGEST_HEADER} lines hold no column names")
    return header, len(lines)
