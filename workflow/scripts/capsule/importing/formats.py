"""Read a file of any format, one function a format.

Its first bytes decide which one; for .mat and .nwb, the ending of its name, too. Nothing outside of
the file is read. Each package is imported only for a file of its format.
"""

import gzip
import hashlib
import io
import os
import re
import struct
import zipfile
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.reading_apart import Reader, read_apart
from capsule.importing.table import UNSURE_RATE, Table, side_by_side
from capsule.importing.text import read_rows, read_text
from capsule.store.files import read_limited

# 500 MB is far more than one run needs. It is less than a day of 64 channels at 100 Hz in single
# precision.
_MOST_BYTES = 500_000_000
# A small file that unpacks to more is no recording.
_MOST_UNPACKED = 100_000_000
_TOO_LARGE = "it is larger than {:g} MB, too large for one session; split it into smaller files"
_MOST_CELLS = 2_000_000
# A matrix with more columns is probably an image.
_MOST_COLUMNS = 256
# A longer array in a message is probably an image or a scan.
_LONGEST_ARRAY = 256
_MATLAB_COMPRESSED = 15
# The day before the first one of Excel's calendar.
_FIRST_DAY = datetime(1899, 12, 31)
# Channels of one run can have different sampling rates, but not too different ones.
_MOST_LONGER = 2.5
_RATE = re.compile(
    rf"(fs|s?rate|samp(le|ling)?_?(rate|freq(uency)?)|{UNSURE_RATE.pattern})(_?hz)?", re.IGNORECASE
)
# NetCDF writes an array under this name for an axis without values.
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable"
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
}
_NO_TABLE |= dict.fromkeys(
    [b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"],
    "it is a pickle of Python, which can run any code when it is read; save it as text: "
    "pandas.read_pickle('{0}').to_csv('{1}.csv')",
)
_NO_TABLE |= dict.fromkeys(
    [b"{", b"[{", b"[["],
    "it is JSON; save it as text: pandas.read_json('{0}').to_csv('{1}.csv'), with lines=True if "
    "each line is a sample",
)
# Name, numbers and unit of each column.
_Columns: TypeAlias = Sequence[tuple[str, np.ndarray, str]]


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
        raise CapsuleError(_TOO_LARGE.format(_MOST_BYTES / 1e6))
    sha256 = hashlib.sha256(content).hexdigest()
    if path.is_dir() or content.startswith(_BAGS):
        return read_apart("bag of ROS", _read_bag, path, keys), sha256
    if content.startswith(_GZIP):
        content, path = _unpacked(content), path.with_suffix("")
    for mark, reason in _NO_TABLE.items():
        if content.startswith(mark):
            raise CapsuleError(reason.format(path.name, path.stem))
    for mark, ending, name, read in _FORMATS:
        if content.startswith(mark) and path.suffix.lower().endswith(ending):
            return read_apart(name, read, content, keys), sha256
    return [read_text(content, keys)], sha256


def _refuse_unpacked(size: int, most_bytes: int = _MOST_UNPACKED) -> None:
    """Raise an error if a small file unpacks to more bytes than one session needs."""
    if size > most_bytes:
        raise CapsuleError(f"unpacked, {_TOO_LARGE.format(_MOST_UNPACKED / 1e6)}")


def _unpacked(content: bytes) -> bytes:
    """Return the content of a gzip file."""
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(content)) as stream:
            unpacked = stream.read(_MOST_UNPACKED + 1)
    except (OSError, EOFError, zlib.error) as fault:
        raise CapsuleError(f"the compressed file cannot be read ({fault}); copy it again") from None
    _refuse_unpacked(len(unpacked))
    if unpacked.startswith((_GZIP, *_BAGS)):
        raise CapsuleError("it holds a file that is not read from within it; unpack it first")
    return unpacked


def table_of(columns: _Columns, label: str, kind: str = "variable", **told: Any) -> Table:
    """Return a table of a format without text cells.

    `columns` holds name, numbers (K,) and unit of each column; `told` holds further attributes.
    """
    names, values, units = zip(*columns, strict=True)
    # Columns of different lengths, as in a damaged file, raise an error here.
    arrays = tuple(np.array(values, dtype=float))
    return Table(names, units, arrays, kind=kind, label=label, **told)


def _array_tables(
    arrays: Mapping[str, np.ndarray],
    separator: str,
    keys: Keys,
    told: Mapping[str, Mapping[str, Any]],
) -> Iterator[Table]:
    """Yield tables that join arrays, given by path, with the same length and the same parent.

    If none of a parent's tables has enough columns, all of its arrays are one: a sensor can have a
    sampling rate of its own. They are named by their parent, or by their first array if a parent
    has several tables. `told` holds the attributes of each path. A single number is an attribute of
    its parent. An attribute holds for all below, unless a nearer one says something else.
    """
    about: defaultdict[str, dict[str, Any]] = defaultdict(dict)
    about |= {path: dict(said) for path, said in told.items()}
    places = {path: path.rpartition(separator) for path in arrays}
    for path, (parent, _, name) in places.items():
        if arrays[path].size == 1 and arrays[path].dtype.kind in "iuf":
            about[parent][name] = arrays[path]
    groups: defaultdict[str, defaultdict[int, dict[str, list[Table]]]]
    groups = defaultdict(lambda: defaultdict(dict))
    for path, (parent, _, name) in places.items():
        scopes, above = [about[path]], path
        while above:
            above = above.rpartition(separator)[0]
            scopes.append(about[above])
        unit, _, date = _attribute(scopes[:1], "units", "unit").partition(" since ")
        how: dict[str, Any] = {
            "started": date or _attribute(scopes, "started"),
            "rates_hz": _rates(scopes),
        }
        if columns := _array_columns(name, arrays[path], unit):
            channels = [table_of([column], path, **how) for column in columns]
            groups[parent][len(columns[0][1])][path] = channels
    for parent, by_size in groups.items():
        parts = list(by_size.values())
        if not any(sum(map(len, part.values())) >= keys.sensor_count for part in parts):
            parts = [{path: each for part in parts for path, each in part.items()}]
        for part in parts:
            label = parent if len(parts) == 1 and parent else next(iter(part))
            table = side_by_side([each for channels in part.values() for each in channels], label)
            times = {(each.columns[0].size, *each.rates_hz.items()) for each in table.alone if each}
            starts = {each.started for each in table.alone if each and each.started}
            yield replace(table, alone=() if len(times) == 1 >= len(starts) else table.alone)


def _attribute(scopes: Iterable[Mapping[str, Any]], *names: str) -> str:
    """Return the nearest attribute with one of the names as a text; empty if there is none."""
    found = (said[key] for said in scopes for name in names for key in said if key.lower() == name)
    return _decoded(next(found, ""))


def _rates(scopes: Iterable[Mapping[str, Any]]) -> dict[str, float]:
    """Return the sampling rates in the nearest scope that states one surely, by their names."""
    rates: dict[str, float] = {}
    for said in scopes:
        for name, value in said.items():
            numbers = np.ravel(value) if _RATE.fullmatch(name) else np.empty(0)
            if numbers.size == 1 and numbers.dtype.kind in "iuf" and numbers[0] > 0:
                rates.setdefault(name, float(numbers[0]))
        if any(not UNSURE_RATE.fullmatch(name) for name in rates):
            break
    return rates


def _array_columns(name: str, array: np.ndarray, unit: str) -> _Columns:
    """Return an array's columns; none if it is not a series of samples.

    The longer side of a matrix counts samples.
    """
    if array.size < 2:
        return []
    if array.dtype.names:
        fields = [field for field in array.dtype.names if array.dtype[field].kind in "iuf"]
        return [(field, array[field], "") for field in fields] if array.ndim == 1 else []
    array = np.squeeze(array)
    if array.dtype.kind not in "iufb" or array.ndim > 2:
        return []
    if array.ndim == 1:
        return [(name, array, unit)]
    if min(array.shape) > _MOST_COLUMNS:
        return []
    tall = array if array.shape[0] >= array.shape[1] else array.T
    return [(f"{name}({n})", column, unit) for n, column in enumerate(tall.T, start=1)]


def _read_numpy(content: bytes, _: Keys) -> Iterator[Table]:
    """Read the array of numpy's file format; fields of a structured array are columns."""
    array = np.load(io.BytesIO(content), allow_pickle=False)
    if columns := _array_columns("column", array, ""):
        yield table_of(columns, label="", kind="")


def _read_matlab(content: bytes, keys: Keys) -> list[Table]:
    """Read a MATLAB file up to version 7.2; fields of a structure are named ``run.time``."""
    from scipy.io import loadmat

    _refuse_unpacked(_matlab_size(content))
    variables = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=True)
    named = {name: value for name, value in variables.items() if not name.startswith("__")}
    parts = [part for name, value in named.items() for part in _matlab_arrays(name, value)]
    tables = list(_array_tables(dict(parts), ".", keys, {}))
    if not tables:
        raise CapsuleError(
            f"no variable holds a series of numbers; it holds {', '.join(named) or 'nothing'}. "
            "Only MATLAB can read a table or timetable: save its columns as arrays, "
            "x = table2array(T)"
        )
    return tables


def _matlab_size(content: bytes) -> int:
    """Return the number of bytes in the compressed elements of a MATLAB file, at least roughly."""
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    at, size = 128, 0
    while order and at + 8 <= len(content) and size <= _MOST_UNPACKED:
        kind, length = struct.unpack_from(f"{order}II", content, at)
        if kind == _MATLAB_COMPRESSED:
            packed = content[at + 8 : at + 8 + length]
            size += len(zlib.decompressobj().decompress(packed, _MOST_UNPACKED + 1))
        at += 8 + length
    return size


def _matlab_arrays(name: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the arrays of numbers in a variable, with names such as ``lab.run(2).time``."""
    for field in getattr(value, "_fieldnames", ()):
        yield from _matlab_arrays(f"{name}.{field}", getattr(value, field))
    array = np.asarray(value)
    if array.dtype.kind in "iufb":
        yield name, array
    elif array.ndim and all(hasattr(each, "_fieldnames") for each in array.flat):
        for number, each in enumerate(array.flat, start=1):
            yield from _matlab_arrays(f"{name}({number})", each)


def _hdf_nodes(content: bytes) -> Iterator[tuple[str, Any]]:
    """Yield the paths of an HDF5 file, and the group or dataset at each.

    Raise an error if the file takes samples from other files, or holds too many.
    """
    import h5py

    links: dict[str, Any] = {}
    paths, size = ["/"], 0
    with h5py.File(io.BytesIO(content), "r") as file:
        file.visititems_links(links.__setitem__)
        file.visit(paths.append)
        external = {
            path: each for path, each in links.items() if isinstance(each, h5py.ExternalLink)
        }
        outside = [(path, link.filename) for path, link in external.items()]
        for path in paths:
            if isinstance(node := file[path], h5py.Dataset):
                size += node.nbytes
                outside += [(path, str(part[0])) for part in node.external or ()]
                outside += [(path, "a virtual dataset")] * node.is_virtual
        # Compressed, or never written, a small file can hold very much.
        _refuse_unpacked(size, max(_MOST_UNPACKED, 2 * len(content)))
        for path, place in outside:
            raise CapsuleError(
                f"the file names samples outside of it, in {place!r} ({path}), and only the file "
                "itself is read; export it again with all samples in it"
            )
        for path in paths:
            yield path, file[path]


def _read_hdf(content: bytes, keys: Keys) -> Iterator[Table]:
    """Read HDF5, with the attributes ``unit``, ``rate`` and ``started``; and MATLAB from 7.3 on."""
    import h5py

    arrays: dict[str, np.ndarray] = {}
    told: dict[str, Mapping[str, Any]] = {}
    for path, node in _hdf_nodes(content):
        # MATLAB stores the contents of cells and objects in these groups.
        if path.split("/")[0] in ("#refs#", "#subsystem#"):
            continue
        said = told[path.strip("/")] = dict(node.attrs)
        is_array = isinstance(node, h5py.Dataset) and node.shape is not None
        is_other = _decoded(said.get("MATLAB_class", "")) in ("char", "cell")
        is_other |= _decoded(said.get("NAME", "")).startswith(_NO_VARIABLE)
        if is_array and node.dtype.kind in "iufbV" and not is_other:
            arrays[path] = _scaled(path, node[()], said)
    return _array_tables(arrays, "/", keys, told)


def _read_netcdf(content: bytes, keys: Keys) -> Iterator[Table]:
    """Read NetCDF before version 4, which is not HDF5."""
    from scipy.io import netcdf_file

    with netcdf_file(io.BytesIO(content), mmap=False) as file:
        told = {path: each._attributes for path, each in file.variables.items()}
        arrays = {
            path: _scaled(path, each.data, told[path])
            for path, each in file.variables.items()
            if each.data.dtype.kind in "iuf"
        }
        return _array_tables(arrays, "/", keys, {"": file._attributes, **told})


def _scaled(path: str, array: np.ndarray, said: Mapping[str, Any]) -> np.ndarray:
    """Return the numbers that stored ones stand for, by the conventions of NetCDF; NaN for none."""
    marks = [np.ravel(said[key]) for key in ("_FillValue", "missing_value") if key in said]
    scaling = [key for key in ("scale_factor", "add_offset") if key in said]
    if array.dtype.kind not in "iuf" or not (marks or scaling):
        return array
    values = array.astype(float)
    if _decoded(said.get("_Unsigned", "")) == "true" and array.dtype.kind == "i":
        values = array.view(f"{array.dtype.byteorder}u{array.itemsize}").astype(float)
    for key in scaling:
        factor = np.ravel(said[key])
        if factor.size != 1:
            raise CapsuleError(
                f"{key} of {path} holds {factor.size} numbers, and only one is understood; export "
                "the readings without packing"
            )
        values = values * factor if key == "scale_factor" else values + factor
    for mark in marks:
        values[np.isin(array, mark)] = np.nan
    return values


def _decoded(value: object) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _read_nwb(content: bytes, _: Keys) -> Iterator[Table]:
    """Read the time series of Neurodata Without Borders: acquisition, processing and stimulus."""
    import h5py

    for _path, group in _hdf_nodes(content):
        data = group.get("data") if isinstance(group, h5py.Group) else None
        if not isinstance(data, h5py.Dataset) or data.dtype.kind not in "iuf":
            continue
        # A time series is its data, and the time of each sample or the sampling rate.
        times, start = group.get("timestamps"), group.get("starting_time")
        name, told = group.name.rpartition("/")[2], data.attrs
        values = data[()] * told.get("conversion", 1.0)
        if each := group.get("channel_conversion"):
            shape = np.ones(values.ndim, dtype=int)
            shape[each.attrs.get("axis", 1)] = -1
            values = values * each[()].reshape(shape)
        values = values + told.get("offset", 0.0)
        columns = _array_columns(name, values, _decoded(told.get("unit", "")))
        if columns and (times or start):
            stamps = [("timestamps", times[()], "s")] if times else []
            how: dict[str, Any] = {"started": _decoded(group.file["session_start_time"][()])}
            how["start_s"] = float(times[0] if times else start[()])
            how["rates_hz"] = {} if times else {"rate": float(start.attrs["rate"])}
            yield side_by_side([table_of([*stamps, each], name, **how) for each in columns], name)


def _read_tdms(content: bytes, _: Keys) -> Iterator[Table]:
    """Read LabVIEW's TDMS; the channels of a group that can be of the same run are a table."""
    import nptdms

    for group in nptdms.TdmsFile.read(io.BytesIO(content)).groups():
        series = [each for each in group.channels() if len(each) > 1 and each.dtype.kind in "iufM"]
        lengths = sorted({len(each) for each in series})
        firsts = [n for before, n in pairwise([0, *lengths]) if n > _MOST_LONGER * before]
        for first, end in pairwise([*firsts, np.inf]):
            channels = [_tdms_channel(each) for each in series if first <= len(each) < end]
            label = group.name if len(firsts) == 1 else f"{group.name}, {first} samples"
            yield side_by_side(channels, label)


def _tdms_channel(channel: Any) -> Table:
    """Return a channel of TDMS as a table, with its own start and sampling rate."""
    data, said = channel[:], channel.properties
    unit, step = str(said.get("unit_string", "")), said.get("wf_increment")
    if data.dtype.kind == "M":
        # In seconds since 1970, with a resolution of 1 microsecond.
        data, unit = data.astype("datetime64[us]").astype(float) / 1e6, "s"
    start_s, started = float(said.get("wf_start_offset", 0.0)), ""
    if start := said.get("wf_start_time"):
        offset = np.timedelta64(round(1e6 * start_s), "us")
        started, start_s = f"{np.datetime64(start, 'us') + offset}Z", 0.0
    rates_hz = {"1 / wf_increment": 1.0 / step} if step else {}
    how: dict[str, Any] = {"started": started, "start_s": start_s, "rates_hz": rates_hz}
    return table_of([(channel.name, data, unit)], channel.name, **how)


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
        info, data, stamps = stream["info"], stream["time_series"], stream["time_stamps"]
        if not isinstance(data, np.ndarray) or data.dtype.kind not in "iuf" or len(data) < 2:
            continue
        told = _first((_first(info.get("desc")) or {}).get("channels"))
        described = told.get("channel", []) if isinstance(told, dict) else []
        end = "" if stream.get("footer") else "the stream has no end: the file may be incomplete"
        how: dict[str, Any] = {"started": started, "start_s": float(stamps[0]), "remark": end}
        channels = []
        for number, values in enumerate(data.T, start=1):
            channel = described[number - 1] if number <= len(described) else {}
            name = str(_first(channel.get("label")) or f"channel {number}")
            column = name, values, str(_first(channel.get("unit")) or "")
            channels.append(table_of([("time_stamps", stamps, "s"), column], name, **how))
        yield side_by_side(channels, str(_first(info["name"])))


def _first(values: Any) -> Any:
    """Return the first value of an XML element, which pyxdf reads as a list."""
    return (values[0] if values else "") if isinstance(values, list) else values or ""


def _read_zip(content: bytes, keys: Keys) -> Iterator[Table]:
    """Read what is packed as a zip archive: a workbook, or arrays of numpy."""
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        names = file.namelist()
        _refuse_unpacked(sum(part.file_size for part in file.infolist()))
        sheets = [file.read(name) for name in names if name.startswith("xl/worksheets/")]
    if "xl/workbook.xml" in names:
        formulas = any(b"<f>" in sheet or b"<f " in sheet for sheet in sheets)
        yield from _read_excel(content, keys, has_formulas=formulas)
    elif names and all(name.endswith(".npy") for name in names):
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            yield from _array_tables(dict(arrays), "/", keys, {})
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
    tables = []
    for sheet in book.worksheets:
        if sheet.max_row * sheet.max_column > _MOST_CELLS:
            raise CapsuleError(
                f"sheet {sheet.title!r} has {sheet.max_row} rows and {sheet.max_column} "
                "columns, too many for one session; delete the cells that hold no readings"
            )
        cells = (list(map(_cell_text, row)) for row in sheet.values)
        tables.append(read_rows(enumerate(cells, start=1), keys, sheet.title))
    if not has_formulas:
        return tables
    formulas = load_workbook(io.BytesIO(content))
    for table in tables:
        values: Any = book[table.label]
        width = len(table.columns)
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
        for cell in written:
            is_column = counts[cell.column] > len(rows) / 2
            is_column |= cell.column <= width and table.holds_numbers(cell.column - 1)
            in_table = cell.row in rows and is_column
            if in_table or not any(each.columns for each in tables):
                raise CapsuleError(
                    f"sheet {table.label!r}, cell {cell.coordinate}: the formula {cell.value!r} "
                    "was never calculated; open the file in Excel or LibreOffice, and save it"
                )
    return tables


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
        columns = [("stamp", np.array([(stamp_ns - first_ns) / 1e9 for stamp_ns, _ in rows]), "s")]
        for name in names:
            columns.append((name, np.array([row.get(name, np.nan) for _, row in rows]), ""))
        started = datetime.fromtimestamp(first_ns // 10**9, UTC).isoformat()
        yield table_of(columns, topic, started=started)


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
_FORMATS: tuple[tuple[bytes, str, str, Reader], ...] = (
    (b"\x89HDF", ".nwb", "NWB file", _read_nwb),
    (b"\x89HDF", "", "HDF5 file", _read_hdf),
    (b"MATLAB 7.3 MAT-file", "", "HDF5 file", _read_hdf),
    (b"CDF", "", "NetCDF file", _read_netcdf),
    (b"\x93NUMPY", "", "numpy file", _read_numpy),
    (b"TDSm", "", "TDMS file", _read_tdms),
    (b"XDF:", "", "XDF file", _read_xdf),
    (b"PK\x03\x04", "", "workbook", _read_zip),
    (b"", ".mat", "MATLAB file", _read_matlab),
)
