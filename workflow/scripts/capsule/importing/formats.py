"""Read a file of any format, one function a format; its first bytes decide which one.

Nothing outside of the file is read. Each package is imported only for a file of its format.
"""

import dataclasses
import gzip
import hashlib
import io
import sqlite3
import struct
import sys
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures.process import BrokenProcessPool
from datetime import UTC, datetime, time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.files import read_limited
from capsule.forks import Forks
from capsule.importing.cells import POINT, cells_table, missing_words
from capsule.importing.packages import (
    MOST_BYTES,
    MOST_UNPACKED,
    damage_named,
    needed_package,
    refuse_unpacked,
    too_large,
)
from capsule.importing.table import Table, array_tables, table_of, without_number_head
from capsule.importing.text import read_text
from capsule.importing.units import is_unit

_MOST_CELLS = 2_000_000
# A longer array in a message is probably an image or a scan.
_LONGEST_ARRAY = 256
_MATLAB_COMPRESSED = 15
_GZIP = b"\x1f\x8b"
_BAGS = (b"#ROSBAG", b"\x89MCAP")
_NO_TABLE = {
    b"\xd0\xcf\x11\xe0": "it is a workbook of an old Excel; save it as .xlsx",
    b"SQLite format 3": "it is one file of a bag of ROS 2; give the folder with its metadata.yaml",
    b"%PDF": "it is a PDF; export the readings as text",
    b"7z\xbc\xaf": "it is compressed; unpack it first",
}


def read_source(path: Path, keys: SimpleNamespace, needed: int) -> tuple[list[Table], str]:
    """Read a file of any format.

    Parameters
    ----------
    path : Path
        A file, or the folder of a bag of ROS 2.
    keys : SimpleNamespace
        The keys of lab.yaml.
    needed : int
        Number of columns of numbers that a run must have.

    Returns
    -------
    tables : list of Table
        Tables in the file.
    sha256 : str
        Checksum of the file's content.

    Raises
    ------
    CapsuleError
        The file cannot be read, or its format is unknown.
    """
    if path.is_dir():
        return _read_bag_folder(path)
    try:
        content = read_limited(path, MOST_BYTES)
    except OSError as error:
        raise CapsuleError(f"{error.strerror}; give the name of a file that can be read") from None
    if content is None:
        raise CapsuleError(too_large())
    sha256 = hashlib.sha256(content).hexdigest()
    if content.startswith(_BAGS):
        return _apart(lambda: read_bag(path)), sha256
    if content.startswith(_GZIP):
        content, path = _unpacked(content), path.with_suffix("")
    reason = next((text for mark, text in _NO_TABLE.items() if content.startswith(mark)), None)
    if reason:
        raise CapsuleError(reason)
    if content.startswith(b"PK\x03\x04"):
        return read_excel(content, keys, needed), sha256
    if binary := _binary_reader(content, path):
        return _apart(lambda: binary(content)), sha256
    return [read_text(content, keys, needed)], sha256


def _apart(read: Callable[[], list[Table]]) -> list[Table]:
    """Read a file in a process of its own, for damaged bytes can crash native code."""
    try:
        (tables,) = Forks(2)(lambda _: read(), [None])
    except BrokenProcessPool:
        raise CapsuleError(
            "the package that reads this format crashed at it; copy or export it again"
        ) from None
    return tables


def _binary_reader(content: bytes, path: Path) -> Callable[[bytes], list[Table]] | None:
    ending = path.suffix.lower()
    if content.startswith((b"\x89HDF", b"MATLAB 7.3 MAT-file")):
        return read_nwb if ending == ".nwb" else read_hdf
    marks = {b"\x93NUMPY": read_numpy, b"TDSm": read_tdms, b"XDF:": read_xdf}
    default = read_matlab if ending == ".mat" else None
    return next((read for mark, read in marks.items() if content.startswith(mark)), default)


def _unpacked(content: bytes) -> bytes:
    """Return the content of a gzip file."""
    with (
        damage_named("compressed file", "copy it again"),
        gzip.GzipFile(fileobj=io.BytesIO(content)) as stream,
    ):
        unpacked = stream.read(MOST_UNPACKED + 1)
    refuse_unpacked(len(unpacked))
    if unpacked.startswith((_GZIP, *_BAGS)):
        raise CapsuleError("it holds a file that is not read from within it; unpack it first")
    return unpacked


def read_numpy(content: bytes) -> list[Table]:
    """Read the array of numpy's file format ``.npy``; fields of a structured array are columns."""
    with damage_named("numpy file", "save it again: numpy.save(file, array)"):
        array = np.load(io.BytesIO(content), allow_pickle=False)
    tables = array_tables({"column": array}, {}, "/")
    if not tables:
        raise CapsuleError(
            f"an array of shape {array.shape} and type {array.dtype} is no table of numbers; save "
            "an array with one row a sample"
        )
    return [dataclasses.replace(table, kind="", label="") for table in tables]


def read_matlab(content: bytes) -> list[Table]:
    """Read a MATLAB file up to version 7.2; fields of a structure are named ``run.time``."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    with damage_named("MATLAB file", "save it again: save -v7", MatReadError):
        refuse_unpacked(_matlab_size(content))
        variables = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=True)
    named = {name: value for name, value in variables.items() if not name.startswith("__")}
    tables = array_tables(dict(_matlab_arrays(named, "")), {}, ".")
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
    while order and at + 8 <= len(content) and size <= MOST_UNPACKED:
        kind, length = struct.unpack_from(f"{order}II", content, at)
        if kind == _MATLAB_COMPRESSED:
            packed = content[at + 8 : at + 8 + length]
            size += len(zlib.decompressobj().decompress(packed, MOST_UNPACKED + 1))
        at += 8 + length
    return size


def _matlab_arrays(variables: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, np.ndarray]]:
    for name, value in variables.items():
        if hasattr(value, "_fieldnames"):
            fields = {field: getattr(value, field) for field in value._fieldnames}
            yield from _matlab_arrays(fields, f"{prefix}{name}.")
            continue
        array = np.asarray(value)
        if array.dtype == object and all(hasattr(each, "_fieldnames") for each in array.flat):
            parts = {f"{name}({n})": each for n, each in enumerate(array.flat, start=1)}
            yield from _matlab_arrays(parts, prefix)
        elif array.dtype.kind in "iufb":
            yield f"{prefix}{name}", array


def read_hdf(content: bytes) -> list[Table]:
    """Read HDF5, with the attributes ``unit``, ``rate`` and ``started``; and MATLAB from 7.3 on."""
    h5py = needed_package("h5py", "HDF5")
    arrays: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    started: list[str] = []

    def visit(name: str, node: Any) -> None:
        # MATLAB stores the contents of cells and objects in these groups.
        if name.split("/")[0] in ("#refs#", "#subsystem#"):
            return
        is_dataset = isinstance(node, h5py.Dataset)
        for key, value in node.attrs.items():
            if is_dataset and key.lower() in ("unit", "units"):
                units[name] = _decoded(value)
            elif key.lower() == "started":
                started.append(_decoded(value))
            elif np.size(value) == 1 and np.asarray(value).dtype.kind in "iuf":
                parent = name.rpartition("/")[0] if is_dataset else name
                arrays[f"{parent}/{key}".lstrip("/")] = np.asarray(value)
        is_text = _decoded(node.attrs.get("MATLAB_class", "")) in ("char", "cell")
        if is_dataset and not is_text and node.dtype.kind in "iufbV" and node.shape is not None:
            arrays[name] = node[()]

    with (
        damage_named("HDF5 file", "copy or export it again"),
        h5py.File(io.BytesIO(content), "r") as file,
    ):
        _refuse_outside(file, h5py)
        visit("", file)
        file.visititems(visit)
    tables = array_tables(arrays, units, "/", started[0] if started else "")
    if not tables:
        raise CapsuleError("no dataset holds a series of numbers; export the readings as arrays")
    return tables


def _decoded(value: object) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _refuse_outside(file: Any, h5py: Any) -> None:
    """Raise an error if an HDF5 file takes samples from other files, or holds too many."""
    outside: list[tuple[str, str]] = []
    sizes: list[int] = []

    def check_link(name: str, link: Any) -> None:
        if isinstance(link, h5py.ExternalLink):
            outside.append((name, link.filename))

    def check(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset):
            return
        outside.extend((name, str(part[0])) for part in node.external or ())
        if node.is_virtual:
            outside.append((name, "a virtual dataset"))
        sizes.append(node.nbytes)

    file.visititems_links(check_link)
    file.visititems(check)
    # Compressed, or never written, a small file can hold very much.
    if sum(sizes) > max(MOST_UNPACKED, 2 * file.id.get_filesize()):
        raise CapsuleError(f"unpacked, {too_large(MOST_UNPACKED)}")
    for name, place in outside:
        raise CapsuleError(
            f"the file names samples outside of it, in {place!r} ({name}), and only the file "
            "itself is read; export it again with all samples in it"
        )


def read_nwb(content: bytes) -> list[Table]:
    """Read the time series of Neurodata Without Borders: acquisition, processing and stimulus."""
    pynwb = needed_package("pynwb", "NWB")
    h5py = needed_package("h5py", "NWB")
    damage = needed_package("hdmf.build.errors", "NWB").ConstructError
    with (
        damage_named("NWB file", "check it with pynwb-validate", damage),
        h5py.File(io.BytesIO(content), "r") as hdf,
    ):
        _refuse_outside(hdf, h5py)
        with pynwb.NWBHDF5IO(file=hdf, mode="r", load_namespaces=True) as stream:
            file = stream.read()
            series = [each for each in file.objects.values() if isinstance(each, pynwb.TimeSeries)]
            tables = [_nwb_table(each, file.session_start_time.isoformat()) for each in series]
    if not any(tables):
        raise CapsuleError("the file holds no time series of numbers; export the readings as one")
    return [table for table in tables if table]


def _nwb_table(series: Any, started: str) -> Table | None:
    data = np.asarray(series.data)
    if data.dtype.kind not in "iuf" or data.ndim not in (1, 2) or data.shape[0] < 2:
        return None
    data = data.astype(float).reshape(data.shape[0], -1) * series.conversion + series.offset
    times = series.timestamps
    columns = [] if times is None else [("timestamps", np.asarray(times), "s")]
    several = data.shape[1] > 1
    columns += [
        (f"{series.name}({number})" if several else series.name, column, series.unit)
        for number, column in enumerate(data.T, start=1)
    ]
    return table_of(columns, series.name, started, series.rate)


def read_tdms(content: bytes) -> list[Table]:
    """Read the groups of LabVIEW's TDMS; the channels of one length in a group are a table."""
    nptdms = needed_package("nptdms", "TDMS")
    tables = []
    with damage_named("TDMS file", "copy or export it again"):
        for group in nptdms.TdmsFile.read(io.BytesIO(content)).groups():
            lengths: defaultdict[int, list[Any]] = defaultdict(list)
            for channel in group.channels():
                if len(channel) > 1 and channel.dtype.kind in "iufM":
                    lengths[len(channel)].append(channel)
            for length, channels in lengths.items():
                step = channels[0].properties.get("wf_increment")
                start = channels[0].properties.get("wf_start_time")
                label = group.name if len(lengths) == 1 else f"{group.name}, {length} samples"
                started = f"{np.datetime64(start, 's')}Z" if start else ""
                columns = [_tdms_column(channel) for channel in channels]
                tables.append(table_of(columns, label, started, 1.0 / step if step else None))
    if not tables:
        raise CapsuleError("no group holds channels of numbers; export the readings as channels")
    return tables


def _tdms_column(channel: Any) -> tuple[str, np.ndarray, str]:
    data = np.asarray(channel[:])
    if data.dtype.kind != "M":
        return channel.name, data, str(channel.properties.get("unit_string", ""))
    # Time stamps are converted to seconds since 1970, with a resolution of 1 microsecond.
    return channel.name, data.astype("datetime64[us]").astype(float) / 1e6, "s"


def read_xdf(content: bytes) -> list[Table]:
    """Read the streams of XDF; pyxdf brings the time stamps to one clock, without jitter."""
    pyxdf = needed_package("pyxdf", "XDF")
    with damage_named("XDF file", "copy or record it again"):
        streams, head = pyxdf.load_xdf(io.BytesIO(content))
        started = str(_first(head["info"].get("datetime")))
        tables = [_xdf_table(stream, started) for stream in streams]
    if not any(tables):
        raise CapsuleError("no stream holds numbers; check that the sensors' stream was recorded")
    return [table for table in tables if table]


def _xdf_table(stream: Mapping[str, Any], started: str) -> Table | None:
    info, data = stream["info"], stream["time_series"]
    if not isinstance(data, np.ndarray) or data.dtype.kind not in "iuf" or data.shape[0] < 2:
        return None
    told = _first((_first(info.get("desc")) or {}).get("channels"))
    channels = (told or {}).get("channel", []) if isinstance(told, dict) else []
    columns = [("time_stamps", stream["time_stamps"], "s")]
    for number, values in enumerate(data.T, start=1):
        channel = channels[number - 1] if number <= len(channels) else {}
        name = str(_first(channel.get("label")) or f"channel {number}")
        columns.append((name, values, str(_first(channel.get("unit")) or "")))
    remark = "" if stream.get("footer") else "the stream has no end: the file may be incomplete"
    return table_of(columns, str(_first(info["name"])), started, remark=remark)


def _first(values: Any) -> Any:
    """Return the first value of an XML element, which pyxdf reads as a list."""
    return (values[0] if values else "") if isinstance(values, list) else values or ""


def read_excel(content: bytes, keys: SimpleNamespace, needed: int) -> list[Table]:
    """Read the sheets of a workbook, with the values that formulas had when it was saved."""
    openpyxl = needed_package("openpyxl", "An Excel workbook")
    with damage_named("workbook", "save it again as .xlsx"):
        with zipfile.ZipFile(io.BytesIO(content)) as file:
            refuse_unpacked(sum(part.file_size for part in file.infolist()))
        # The read-only way of openpyxl leaves out rows beyond the size that a sheet states.
        sheets = openpyxl.load_workbook(io.BytesIO(content), data_only=True).worksheets
        if not sheets:
            raise CapsuleError("the workbook holds no sheet of cells; save it again as .xlsx")
        for sheet in sheets:
            if sheet.max_row * sheet.max_column > _MOST_CELLS:
                raise CapsuleError(
                    f"sheet {sheet.title!r} has {sheet.max_row} rows and {sheet.max_column} "
                    "columns, too many for one session; delete the cells that hold no readings"
                )
        rows = [[[_cell(value) for value in row] for row in sheet.values] for sheet in sheets]
    return [
        without_number_head(_excel_table(sheet.title, cells, keys, needed), keys)
        for sheet, cells in zip(sheets, rows, strict=True)
    ]


def _excel_table(title: str, cells: list[list[str]], keys: SimpleNamespace, needed: int) -> Table:
    counted = [sum(POINT.number(cell) is not None and cell != "" for cell in row) for row in cells]
    first = next((at for at in range(keys.skip_lines or 0, len(cells)) if counted[at] >= needed), 0)
    # Empty cells that have a format make rows wider and sheets longer, so they are dropped.
    below = [(at, row) for at, row in enumerate(cells[first:], start=first + 1) if any(row)]
    width = max((at for _, row in below for at, cell in enumerate(row, 1) if cell), default=0)
    heads = [row[:width] for row in cells[:first] if sum(map(bool, row)) > width / 2]
    units = heads.pop() if len(heads) > 1 and all(map(is_unit, heads[-1])) else [""] * width
    names = heads[-1] if heads else [""] * width
    rows, lines = [row[:width] for _, row in below], [number for number, _ in below]
    told = {"kind": "sheet", "label": title, "line_word": "row"}
    return cells_table(names, units, rows, lines, POINT, missing_words(keys), **told)


def _cell(value: object) -> str:
    if isinstance(value, datetime | time):
        text = value.isoformat(sep=" ") if isinstance(value, datetime) else value.isoformat()
        return text if isinstance(value, time) or "." in text else f"{text}.0"
    if isinstance(value, float):
        return repr(value)
    return "" if value is None else str(value).strip()


def _read_bag_folder(path: Path) -> tuple[list[Table], str]:
    """Read a bag of ROS 2, and return its tables and its checksum."""
    files = sorted(path.iterdir())
    if path / "metadata.yaml" not in files:
        raise CapsuleError("it is a folder, but not a bag of ROS 2; give the files in it")
    for file in files:
        if not file.resolve().is_relative_to(path.resolve()):
            raise CapsuleError(
                f"{file.name!r} is a link to a file outside of this folder; copy it into it"
            )
    if sum(file.stat().st_size for file in files) > MOST_BYTES:
        raise CapsuleError(too_large())
    digest = hashlib.sha256()
    for file in filter(Path.is_file, files):
        digest.update(file.name.encode("utf-8", "surrogateescape"))
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return _apart(lambda: read_bag(path)), digest.hexdigest()


def read_bag(path: Path) -> list[Table]:
    """Read the topics of a bag of ROS 1 or ROS 2; each number in a message becomes a column."""
    bags = needed_package("rosbags.highlevel.anyreader", "A bag of ROS")
    typesys = needed_package("rosbags.typesys", "A bag of ROS")
    types = typesys.get_typestore(typesys.Stores.LATEST)
    topics: dict[str, list[dict[str, Any]]] = {}
    remedy = "give a .bag file, or the folder of a bag of ROS 2 with its metadata.yaml"
    # rosbags reads the files of SQLite by apsw, and did so by sqlite3.
    database = sys.modules.get("apsw", sqlite3)
    own = (bags.AnyReaderError, *bags.ReaderErrors, bags.SerdeError, bags.TypesysError)
    with (
        damage_named("bag", remedy, database.Error, *own),
        bags.AnyReader([path], default_typestore=types) as reader,
    ):
        for connection, stamp_ns, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            if numbers := dict(_numbers(message, "")):
                stamp = getattr(getattr(message, "header", None), "stamp", None)
                own_ns = int(stamp.sec) * 10**9 + int(stamp.nanosec) if stamp else 0
                row = {"stamp": own_ns or stamp_ns} | numbers
                topics.setdefault(connection.topic, []).append(row)
        tables = [_bag_table(topic, rows) for topic, rows in topics.items() if len(rows) > 1]
    if not tables:
        raise CapsuleError(
            "no topic holds messages with numbers; check that the sensors' topic was recorded"
        )
    return tables


def _bag_table(topic: str, rows: list[dict[str, Any]]) -> Table:
    first = rows[0]["stamp"]
    # A float cannot hold all digits of the nanoseconds since 1970, so times are relative to the
    # first.
    columns = [("stamp", np.array([(row["stamp"] - first) / 1e9 for row in rows]), "s")]
    for name in list(rows[0])[1:]:
        columns.append((name, np.array([row.get(name, np.nan) for row in rows]), ""))
    return table_of(columns, topic, datetime.fromtimestamp(first // 10**9, UTC).isoformat())


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
