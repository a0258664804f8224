"""Read a file of any format; a function for each that holds channels, sheets or messages.

Its first bytes decide which one; for .mat and .nwb, the ending of its name, too. Nothing outside of
the file is read. Each package is imported only for a file of its format.
"""

import gzip
import hashlib
import io
import os
import re
import zipfile
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.array_formats import (
    MOST_UNPACKED,
    TOO_LARGE,
    VARIABLE,
    array_tables,
    read_hdf,
    read_matlab,
    read_netcdf,
    read_numpy,
    read_nwb,
    refuse_unpacked,
)
from capsule.importing.lab_yaml import Keys
from capsule.importing.reading_apart import Reader, read_apart
from capsule.importing.stated import as_remarks, stated_unit, states_rate
from capsule.importing.table import Channel, Table, with_stamps
from capsule.importing.text import read_sheets, read_text
from capsule.store.files import read_limited

# 500 MB is far more than one run needs. It is less than a day of 64 channels at 100 Hz in single
# precision.
_MOST_BYTES = 500_000_000
_MOST_CELLS = 2_000_000
# A longer array in a message is probably an image or a scan.
_LONGEST_ARRAY = 256
# The day before the first one of Excel's calendar.
_FIRST_DAY = datetime(1899, 12, 31)
_GZIP = b"\x1f\x8b"
_BAGS = (b"#ROSBAG", b"\x89MCAP")
_NO_TABLE = {
    b"\xd0\xcf\x11\xe0": "it is a workbook of an old Excel; save it as .xlsx",
    b"SQLite format 3": "it is one file of a bag of ROS 2; give the folder with its metadata.yaml",
    b"%PDF": "it is a PDF; export the readings as text",
    **dict.fromkeys(
        (b"7z\xbc\xaf", b"BZh", b"\xfd7zXZ", b"Rar!"), "it is compressed; unpack it first"
    ),
    b"PK\x05\x06": "it is a zip archive without a file; export the readings again",
    b"PAR1": "it is Parquet; save it as text: pandas.read_parquet('{0}').to_csv('{1}.csv')",
    b"ARROW1": "it is Arrow; save it as text: pandas.read_feather('{0}').to_csv('{1}.csv')",
    **dict.fromkeys(
        (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"),
        "it is a pickle of Python, which can run any code when it is read; save it as text: "
        "pandas.read_pickle('{0}').to_csv('{1}.csv')",
    ),
    **dict.fromkeys(
        (b'{"', b"{\n", b"{\r", b"{ ", b"{}", b"[{", b"[["),
        "it is JSON; save it as text: pandas.read_json('{0}').to_csv('{1}.csv'), with lines=True "
        "if each line is a sample",
    ),
}


def read_source(path: Path, keys: Keys) -> tuple[list[Table], str]:
    """Return the tables in a file of any format, and the SHA-256 of the file's content.

    The file can be the folder of a bag of ROS 2, too.

    Raises
    ------
    CapsuleError
        The file cannot be read, or its format is unknown.
    """
    try:
        content = _listing_of_bag(path) if path.is_dir() else read_limited(path, _MOST_BYTES)
    except OSError as error:
        raise CapsuleError(f"{error.strerror}; give the name of a file that can be read") from None
    if content is None:
        raise CapsuleError(TOO_LARGE.format(_MOST_BYTES / 1e6))
    sha256 = hashlib.sha256(content).hexdigest()
    if path.is_dir() or content.startswith(_BAGS):
        return read_apart("bag of ROS", "rosbags.highlevel", _read_bag, path, keys), sha256
    if content.startswith(_GZIP):
        content, path = _unpacked(content), path.with_suffix("")
    for mark, reason in _NO_TABLE.items():
        if content.startswith(mark):
            raise CapsuleError(reason.format(path.name, path.stem))
    for mark, ending, name, package, read in _FORMATS:
        if content.startswith(mark) and path.suffix.lower().endswith(ending):
            return read_apart(name, package, read, content, keys), sha256
    return [read_text(content, keys)], sha256


def _unpacked(content: bytes) -> bytes:
    """Return the content of a gzip file."""
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(content)) as stream:
            unpacked = stream.read(MOST_UNPACKED + 1)
    except (OSError, EOFError, zlib.error) as fault:
        raise CapsuleError(f"the compressed file cannot be read ({fault}); copy it again") from None
    refuse_unpacked(len(unpacked))
    if unpacked.startswith((_GZIP, *_BAGS)):
        raise CapsuleError("it holds a file that is not read from within it; unpack it first")
    return unpacked


def _read_tdms(content: bytes, keys: Keys) -> Iterator[Table]:
    """Read LabVIEW's TDMS; a channel is an array in its group."""
    import nptdms

    file = nptdms.TdmsFile.read(io.BytesIO(content))
    arrays, told = {}, {"": file.properties}
    for group in file.groups():
        told[group.name] = group.properties
        # A rate of the group counts beside the interval of a channel.
        rates = {
            name: value
            for around in (file.properties, group.properties)
            for name, value in around.items()
            if states_rate(name)
        }
        for channel in group.channels():
            if channel.dtype.kind not in "iufM":
                continue
            # Names hold slashes, but no line ends.
            path, data = f"{group.name}\n{channel.name}", channel[:]
            # The channel's own statements win, and come first where a question quotes several.
            own = channel.properties
            said = told[path] = {"wf_start_offset": 0.0, **own, **rates, **own}
            if data.dtype.kind == "M":
                # In seconds since 1970, with a resolution of 1 microsecond.
                data, said["unit_string"] = data.astype("datetime64[us]").astype(float) / 1e6, "s"
            if start := said.get("wf_start_time"):
                offset = np.timedelta64(round(1e6 * said.pop("wf_start_offset")), "us")
                said |= {"started": f"{np.datetime64(start, 'us') + offset}Z", "start_s": 0.0}
            arrays[path] = data
    return array_tables(arrays, "\n", keys, told)


def _read_xdf(content: bytes, _: Keys) -> Iterator[Table]:
    """Read the streams of XDF; pyxdf brings the time stamps to one clock."""
    import pyxdf

    # Its removal of jitter takes 500 lost samples for jitter, so the stamps are left as they were
    # sent. Only if some are out of order, by jitter, it is used, up to each break of a second.
    streams, head = pyxdf.load_xdf(io.BytesIO(content), dejitter_timestamps=False)
    if any(np.any(np.diff(stream["time_stamps"]) <= 0) for stream in streams):
        even, _ = pyxdf.load_xdf(io.BytesIO(content), jitter_break_threshold_samples=0)
        for stream, other in zip(streams, even, strict=True):
            if np.any(np.diff(stream["time_stamps"]) <= 0):
                stream["time_stamps"] = other["time_stamps"]
    started = str(_first(head["info"].get("datetime")))
    for stream in streams:
        info, data, times = stream["info"], stream["time_series"], stream["time_stamps"]
        if not isinstance(data, np.ndarray) or data.dtype.kind not in "iuf" or len(data) < 2:
            continue
        told = _first((_first(info.get("desc")) or {}).get("channels"))
        described = told.get("channel", []) if isinstance(told, dict) else []
        no_end = (
            [] if stream.get("footer") else ["the stream has no end: the file may be incomplete"]
        )
        stamps = Channel("time_stamps", times, "s")
        how: dict[str, Any] = {"started": started, "start_s": float(times[0]), "stamps": stamps}
        # Where the stamps are those of chunks, their usual step contradicts it.
        if (nominal_hz := float(str(_first(info.get("nominal_srate")) or 0))) > 0:
            how["rates_hz"] = {"nominal_srate": nominal_hz}
        channels = []
        for number, values in enumerate(data.T, start=1):
            channel = described[number - 1] if number <= len(described) else {}
            said = {key: _first(value) for key, value in channel.items()}
            name = str(said.get("label") or f"channel {number}")
            channels.append(Channel(name, values.astype(float), stated_unit([said], [said]), **how))
        label = str(_first(info["name"]))
        words = as_remarks(_leaves(_first(info.get("desc"))))
        yield Table(with_stamps(channels), VARIABLE, label, warnings=no_end, remarks=words)


def _leaves(element: Any) -> Iterator[dict[str, str]]:
    """Yield the texts in an XML element, which pyxdf reads as a dictionary of lists."""
    for key, values in element.items() if isinstance(element, dict) else ():
        for value in values:
            if isinstance(value, str):
                yield {key: value}
            yield from _leaves(value)


def _first(values: Any) -> Any:
    """Return the first value of an XML element, which pyxdf reads as a list."""
    return (values[0] if values else "") if isinstance(values, list) else values or ""


def _read_zip(content: bytes, keys: Keys) -> Iterator[Table]:
    """Read what is packed as a zip archive: a workbook, or arrays of numpy."""
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        names = file.namelist()
        refuse_unpacked(sum(part.file_size for part in file.infolist()))
        sheets = [file.read(name) for name in names if name.startswith("xl/worksheets/")]
    if "xl/workbook.xml" in names:
        formulas = any(b"<f>" in sheet or b"<f " in sheet for sheet in sheets)
        yield from _read_excel(content, keys, has_formulas=formulas)
    elif names and all(name.endswith(".npy") for name in names):
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            told = {name: each for name, each in arrays.items() if each.dtype.kind == "U"}
            yield from array_tables(dict(arrays), "/", keys, {"": told})
    elif {"xl/workbook.bin", "content.xml"} & {*names}:
        raise CapsuleError("it is a workbook of another kind than .xlsx; save it as .xlsx")
    else:
        held = f"{names[0]!r}" if names else "nothing"
        raise CapsuleError(f"it is a zip archive, which holds {held}; unpack it, and import that")


def _read_excel(content: bytes, keys: Keys, *, has_formulas: bool) -> list[Table]:
    """Read the sheets of a workbook, with the values that formulas had when it was saved."""
    from openpyxl import load_workbook

    # The read-only way of openpyxl leaves out rows beyond the size that a sheet states.
    book = load_workbook(io.BytesIO(content), data_only=True)
    sheets, units, remarks = {}, {}, list(filter(None, vars(book.properties).values()))
    for sheet in book.worksheets:
        if sheet.max_row * sheet.max_column > _MOST_CELLS:
            raise CapsuleError(
                f"sheet {sheet.title!r} has {sheet.max_row} rows and {sheet.max_column} "
                "columns, too many for one session; delete the cells that hold no readings"
            )
        texts = sheets[sheet.title] = [list(map(_cell_text, row)) for row in sheet.values]
        units[sheet.title] = list(map(_shown_unit, sheet.columns))
        cells = (cell for row in sheet.iter_rows() for cell in row)
        remarks += [cell.comment.text for cell in cells if cell.comment]
        remarks += [part.text for part in (sheet.oddHeader.center, sheet.oddFooter.center)]
        # What stands over several columns holds for each of them.
        for area in sheet.merged_cells.ranges:
            if area.min_row == area.max_row:
                row, first = texts[area.min_row - 1], area.min_col - 1
                row[first : area.max_col] = [row[first]] * (area.max_col - first)
    tables = list(
        read_sheets(sheets, units, [text for text in remarks if isinstance(text, str)], keys)
    )
    if not has_formulas:
        return tables
    formulas = load_workbook(io.BytesIO(content))
    for table in tables:
        values: Any = book[table.label]
        written = [
            each
            for row in formulas[table.label].iter_rows()
            for each in row
            if each.data_type == "f"
        ]
        # Some programs write 0 for a formula that they do not calculate.
        if any(values[each.coordinate].value not in (None, 0) for each in written):
            continue
        rows = set() if table.lines is None else {*table.lines.tolist()}
        counts = Counter(each.column for each in written if each.row in rows)
        columns = {column for column, count in counts.items() if count > len(rows) / 2}
        columns |= {at for at, each in enumerate(table.channels, start=1) if each.holds_numbers}
        is_empty = not any(each.channels for each in tables)
        for cell in written:
            if is_empty or (cell.row in rows and cell.column in columns):
                raise CapsuleError(
                    f"sheet {table.label!r}, cell {cell.coordinate}: the formula {cell.value!r} "
                    "was never calculated; open the file in Excel or LibreOffice, and save it"
                )
    return tables


def _shown_unit(column: Iterable[Any]) -> str:
    """Return the unit that the form of a column's numbers shows, as in ``0.00" kPa"``."""
    forms = Counter(cell.number_format for cell in column if isinstance(cell.value, int | float))
    form = forms.most_common(1)[0][0] if forms else ""
    words = re.findall(r'"([^"]*)"|\\(.)|\[[$]([^\]-]*)|(%)', form.partition(";")[0])
    return "".join(map("".join, words)).strip()


def _cell_text(value: object) -> str:
    """Return the text of a cell of a workbook."""
    # A time that is longer than a day is a date in 1900, if its format has no place for it.
    if isinstance(value, datetime) and value.year <= _FIRST_DAY.year + 1:
        value -= _FIRST_DAY
    return "" if value is None else str(value).strip()


def _listing_of_bag(path: Path) -> bytes | None:
    """Return names and checksums of the files of a bag of ROS 2; None if they are too large.

    Raise an error if the folder is no bag, or names files outside of it.
    """
    files = sorted(path.iterdir())
    if path / "metadata.yaml" not in files:
        raise CapsuleError("it is a folder, but not a bag of ROS 2; give the files in it")
    for file in files:
        if not file.resolve().is_relative_to(path.resolve()):
            raise CapsuleError(
                f"{file.name!r} is a link to a file outside of this folder; copy it into it"
            )
    if sum(file.stat().st_size for file in files) > _MOST_BYTES:
        return None
    return b"".join(
        os.fsencode(file.name) + hashlib.sha256(file.read_bytes()).digest()
        for file in files
        if file.is_file()
    )


def _read_bag(path: Path, _: Keys) -> Iterator[Table]:
    """Read the topics of a bag of ROS 1 or ROS 2; each number in a message becomes a column."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    topics: defaultdict[str, list[tuple[int, dict[str, float]]]] = defaultdict(list)
    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
        for connection, stamp_ns, data in reader.messages():
            message: Any = reader.deserialize(data, connection.msgtype)
            if numbers := dict(_numbers(message, "")):
                stamp = getattr(getattr(message, "header", None), "stamp", None)
                own_ns = int(stamp.sec) * 10**9 + int(stamp.nanosec) if stamp else 0
                topics[connection.topic].append((own_ns or stamp_ns, numbers))
    for topic, rows in topics.items():
        if len(rows) == 1:
            continue
        first_ns, names = rows[0]
        # A float cannot hold all digits of the nanoseconds since 1970, so times are relative to the
        # first.
        started = datetime.fromtimestamp(first_ns // 10**9, UTC).isoformat()
        seconds = np.array([(stamp_ns - first_ns) / 1e9 for stamp_ns, _ in rows])
        channels = [Channel("stamp", seconds, "s", started=started)]
        for name in names:
            values = np.array([row.get(name, np.nan) for _, row in rows])
            channels.append(Channel(name, values, started=started))
        yield Table(channels, VARIABLE, topic)


def _numbers(value: object, name: str) -> Iterator[tuple[str, float]]:
    """Yield the numbers in a message, with names such as ``data[0]`` and ``wrench.force.x``."""
    if is_dataclass(value):
        for field in fields(value):
            if field.name not in ("header", "layout") and not field.name.startswith("_"):
                inner = f"{name}.{field.name}" if name else field.name
                yield from _numbers(getattr(value, field.name), inner)
    elif isinstance(value, list | np.ndarray) and 0 < len(value) <= _LONGEST_ARRAY:
        for number, each in enumerate(value):
            yield from _numbers(each, f"{name}[{number}]")
    elif isinstance(value, int | float | np.number) and not isinstance(value, bool):
        yield name, float(value)


# First bytes and ending of the files of each binary format, its name, and its reader.
_FORMATS: tuple[tuple[bytes, str, str, str, Reader], ...] = (
    (b"\x89HDF", ".nwb", "NWB file", "h5py", read_nwb),
    (b"\x89HDF", "", "HDF5 file", "h5py", read_hdf),
    (b"MATLAB 7.3 MAT-file", "", "HDF5 file", "h5py", read_hdf),
    (b"CDF", "", "NetCDF file", "scipy.io", read_netcdf),
    (b"\x93NUMPY", "", "numpy file", "numpy", read_numpy),
    (b"TDSm", "", "TDMS file", "nptdms", _read_tdms),
    (b"XDF:", "", "XDF file", "pyxdf", _read_xdf),
    (b"PK\x03\x04", "", "workbook", "openpyxl", _read_zip),
    (b"", ".mat", "MATLAB file", "scipy.io", read_matlab),
)
