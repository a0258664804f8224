"""Read a file of any format, one function a format.

Its first bytes decide which one; for .mat and .nwb, the ending of its name, too. Nothing outside of
the file is read. Each package is imported only for a file of its format.
"""

import dataclasses
import gzip
import hashlib
import io
import os
import re
import struct
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.reading_apart import Reader, read_apart
from capsule.importing.table import Table
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
_RATE_NAMES = re.compile(
    r"(fs|rate|rate_hz|srate|samplerate|sample_rate|sampling_?rate(_hz)?|samplingfrequency|freq)",
    re.IGNORECASE,
)
_GZIP = b"\x1f\x8b"
_BAGS = (b"#ROSBAG", b"\x89MCAP")
_NO_TABLE = {
    b"\xd0\xcf\x11\xe0": "it is a workbook of an old Excel; save it as .xlsx",
    b"SQLite format 3": "it is one file of a bag of ROS 2; give the folder with its metadata.yaml",
    b"%PDF": "it is a PDF; export the readings as text",
    b"7z\xbc\xaf": "it is compressed; unpack it first",
}
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
            raise CapsuleError(reason)
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
    arrays: Mapping[str, np.ndarray], units: Mapping[str, str], separator: str, started: str = ""
) -> Iterator[Table]:
    """Yield tables that join arrays, given by path, with the same length and the same parent.

    They are named by their parent, or by their first array if a parent has several tables. The
    longer side of a matrix counts samples. A single number called rate or fs is the sampling rate
    of arrays with that parent, or below it.
    """
    rates: dict[str, float] = {}
    groups: defaultdict[tuple[str, int], dict[str, _Columns]] = defaultdict(dict)
    for path, array in arrays.items():
        parent, _, name = path.rpartition(separator)
        if array.size == 1 and _RATE_NAMES.fullmatch(name) and float(array.flat[0]) > 0:
            rates[parent] = float(array.flat[0])
        elif columns := _array_columns(name, array, units.get(path, "")):
            groups[parent, len(columns[0][1])][path] = columns
    parents = [parent for parent, _ in groups]
    for (parent, _), members in groups.items():
        label = parent if parents.count(parent) == 1 and parent else next(iter(members))
        above = parent
        while above and above not in rates:
            above = above.rpartition(separator)[0]
        joined = [column for each in members.values() for column in each]
        yield table_of(joined, label, started=started, rate_hz=rates.get(above))


def _array_columns(name: str, array: np.ndarray, unit: str) -> _Columns:
    """Return an array's columns; none if it is not a series of samples."""
    if array.size < 2:
        return []
    if array.dtype.names:
        fields = [field for field in array.dtype.names if array.dtype[field].kind in "iuf"]
        return [(field, array[field], "") for field in fields] if array.ndim == 1 else []
    array = np.squeeze(array)
    if array.dtype.kind not in "iufb" or array.ndim > 2 or min(array.shape) > _MOST_COLUMNS:
        return []
    if array.ndim == 1:
        return [(name, array, unit)]
    tall = array if array.shape[0] >= array.shape[1] else array.T
    return [(f"{name}({n})", column, unit) for n, column in enumerate(tall.T, start=1)]


def _read_numpy(content: bytes, _: Keys) -> Iterator[Table]:
    """Read the array of numpy's file format; fields of a structured array are columns."""
    array = np.load(io.BytesIO(content), allow_pickle=False)
    if columns := _array_columns("column", array, ""):
        yield table_of(columns, label="", kind="")


def _read_matlab(content: bytes, _: Keys) -> list[Table]:
    """Read a MATLAB file up to version 7.2; fields of a structure are named ``run.time``."""
    from scipy.io import loadmat

    _refuse_unpacked(_matlab_size(content))
    variables = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=True)
    named = {name: value for name, value in variables.items() if not name.startswith("__")}
    parts = [part for name, value in named.items() for part in _matlab_arrays(name, value)]
    tables = list(_array_tables(dict(parts), {}, "."))
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


def _read_hdf(content: bytes, _: Keys) -> Iterator[Table]:
    """Read HDF5, with the attributes ``unit``, ``rate`` and ``started``; and MATLAB from 7.3 on."""
    import h5py

    arrays: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    started = ""
    for path, node in _hdf_nodes(content):
        # MATLAB stores the contents of cells and objects in these groups.
        if path.split("/")[0] in ("#refs#", "#subsystem#"):
            continue
        is_dataset = isinstance(node, h5py.Dataset)
        for key, value in node.attrs.items():
            if is_dataset and key.lower() in ("unit", "units"):
                units[path] = _decoded(value)
            elif key.lower() == "started":
                started = started or _decoded(value)
            elif np.size(value) == 1 and np.asarray(value).dtype.kind in "iuf":
                parent = path.rpartition("/")[0] if is_dataset else path
                arrays[f"{parent}/{key}".lstrip("/")] = np.asarray(value)
        is_text = _decoded(node.attrs.get("MATLAB_class", "")) in ("char", "cell")
        if is_dataset and not is_text and node.dtype.kind in "iufbV" and node.shape is not None:
            arrays[path] = node[()]
    return _array_tables(arrays, units, "/", started)


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
        values = data[()] * told.get("conversion", 1.0) + told.get("offset", 0.0)
        columns = _array_columns(name, values, _decoded(told.get("unit", "")))
        if columns and times:
            columns = [("timestamps", times[()], "s"), *columns]
        rate_hz = float(start.attrs["rate"]) if start else None
        if columns and (times or start):
            started = _decoded(group.file["session_start_time"][()])
            yield table_of(columns, name, started=started, rate_hz=rate_hz)


def _read_tdms(content: bytes, _: Keys) -> Iterator[Table]:
    """Read the groups of LabVIEW's TDMS; the channels of one length in a group are a table."""
    import nptdms

    for group in nptdms.TdmsFile.read(io.BytesIO(content)).groups():
        series = [each for each in group.channels() if len(each) > 1 and each.dtype.kind in "iufM"]
        lengths = dict.fromkeys(map(len, series))
        for length in lengths:
            channels = [channel for channel in series if len(channel) == length]
            step, start = map(channels[0].properties.get, ("wf_increment", "wf_start_time"))
            label = group.name if len(lengths) == 1 else f"{group.name}, {length} samples"
            started = f"{np.datetime64(start, 's')}Z" if start else ""
            columns = []
            for channel in channels:
                data, unit = channel[:], str(channel.properties.get("unit_string", ""))
                if data.dtype.kind == "M":
                    # In seconds since 1970, with a resolution of 1 microsecond.
                    data, unit = data.astype("datetime64[us]").astype(float) / 1e6, "s"
                columns.append((channel.name, data, unit))
            rate_hz = 1.0 / step if step else None
            yield table_of(columns, label, started=started, rate_hz=rate_hz)


def _read_xdf(content: bytes, _: Keys) -> Iterator[Table]:
    """Read the streams of XDF; pyxdf brings the time stamps to one clock, without jitter."""
    import pyxdf

    streams, head = pyxdf.load_xdf(io.BytesIO(content))
    started = str(_first(head["info"].get("datetime")))
    for stream in streams:
        info, data = stream["info"], stream["time_series"]
        if not isinstance(data, np.ndarray) or data.dtype.kind not in "iuf" or len(data) < 2:
            continue
        told = _first((_first(info.get("desc")) or {}).get("channels"))
        channels = told.get("channel", []) if isinstance(told, dict) else []
        columns = [("time_stamps", stream["time_stamps"], "s")]
        for number, values in enumerate(data.T, start=1):
            channel = channels[number - 1] if number <= len(channels) else {}
            name = str(_first(channel.get("label")) or f"channel {number}")
            columns.append((name, values, str(_first(channel.get("unit")) or "")))
        end = "" if stream.get("footer") else "the stream has no end: the file may be incomplete"
        yield table_of(columns, str(_first(info["name"])), started=started, remark=end)


def _first(values: Any) -> Any:
    """Return the first value of an XML element, which pyxdf reads as a list."""
    return (values[0] if values else "") if isinstance(values, list) else values or ""


def _read_excel(content: bytes, keys: Keys) -> Iterator[Table]:
    """Read the sheets of a workbook, with the values that formulas had when it was saved."""
    import openpyxl

    with zipfile.ZipFile(io.BytesIO(content)) as file:
        _refuse_unpacked(sum(part.file_size for part in file.infolist()))
    # The read-only way of openpyxl leaves out rows beyond the size that a sheet states.
    for sheet in openpyxl.load_workbook(io.BytesIO(content), data_only=True).worksheets:
        if sheet.max_row * sheet.max_column > _MOST_CELLS:
            raise CapsuleError(
                f"sheet {sheet.title!r} has {sheet.max_row} rows and {sheet.max_column} "
                "columns, too many for one session; delete the cells that hold no readings"
            )
        cells = (
            ["" if value is None else str(value).strip() for value in row] for row in sheet.values
        )
        yield read_rows(enumerate(cells, start=1), keys, sheet.title)


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
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
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
    (b"\x93NUMPY", "", "numpy file", _read_numpy),
    (b"TDSm", "", "TDMS file", _read_tdms),
    (b"XDF:", "", "XDF file", _read_xdf),
    (b"PK\x03\x04", "", "workbook", _read_excel),
    (b"", ".mat", "MATLAB file", _read_matlab),
)
