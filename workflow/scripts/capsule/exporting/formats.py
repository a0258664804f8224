"""Write exported data as files of MATLAB, Excel, Parquet, NetCDF and NWB.

All formats hold the same values, units and provenance. `FORMATS` names them; a function for each
returns the names of its files with what writes them. Packages are imported only if they are used.
"""

import itertools
import json
import math
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from capsule.errors import CapsuleError
from capsule.exporting.columns import NO_UNIT, Column, Table
from capsule.exporting.gathering import Exported, Matrices
from capsule.names import displayed, without_formula

if TYPE_CHECKING:
    import pynwb
    from openpyxl import Workbook
    from openpyxl.worksheet._write_only import WriteOnlyWorksheet

# What writes each file, by its name.
Contents = dict[str, Callable[[Any], None]]

# The value of namelengthmax in MATLAB.
_LONGEST_NAME = 63
_KEYWORD = re.compile(
    "break|case|catch|classdef|continue|else|elseif|end|for|function|global|if|otherwise|parfor|"
    "persistent|return|spmd|switch|try|while"
)
# Excel's limits for one sheet: rows below the head, and columns; and for the characters of a cell.
MOST_ROWS = 1_048_575
_MOST_COLUMNS = 16_384
_LONGEST_TEXT = 32_767
# NWB requires a date. This one replaces an unknown date, and the file says so.
NO_DATE = datetime(1970, 1, 1, tzinfo=UTC)
_UNKNOWN = "session_start_time is not known: 1970-01-01T00:00:00Z stands for it"


def legal_names(names: Iterable[str]) -> dict[str, str]:
    """Return unique field names, made as MATLAB's ``matlab.lang.makeValidName`` makes them.

    Parameters
    ----------
    names : iterable of str
        Names such as ``3mm/r07``.

    Returns
    -------
    dict of str to str
        The valid name of each, such as ``x3mm_r07``.
    """
    legal: dict[str, str] = {}
    taken = set()
    for name in names:
        keyword = _KEYWORD.fullmatch(name)
        joined = re.sub(r"\s+(\S?)", lambda match: match[1].upper(), name)
        base = re.sub(r"[^A-Za-z0-9_]", "_", name.capitalize() if keyword else joined)
        base = (base if base[:1].isalpha() and not keyword else f"x{base}")[:_LONGEST_NAME]
        legal[name], number = base, 0
        while legal[name] in taken:
            number += 1
            end = f"_{number}"
            legal[name] = base[: _LONGEST_NAME - len(end)] + end
        taken.add(legal[name])
    return legal


def _mat(exported: Exported, stream: BinaryIO) -> None:
    """Write a file of MATLAB's version 5, which all later versions open."""
    import scipy.io

    tables = exported.tables.items()
    variables: dict[str, Any] = {
        "provenance": dict(exported.provenance),
        "rate_hz": exported.rate_hz,
        "tables": {name: _struct(table) for name, table in tables},
    }
    for about, of in (("units", "unit"), ("long_names", "long_name")):
        variables[about] = {
            name: {key: getattr(column, of) for key, column in table.columns.items()}
            for name, table in tables
        }
    for matrices in exported.matrices:
        group = variables.setdefault(f"{matrices.of}s", {})
        axis, unit = matrices.axis
        for name, legal in legal_names(matrices.values).items():
            matrix = matrices.values[name]
            entry = group.setdefault(legal, {"name": name})
            entry |= {
                matrices.name: matrix,
                f"{matrices.name}_unit": matrices.units.get(name, ""),
                axis: matrices.coordinate[: matrix.shape[1]].reshape(1, -1),
                f"{axis}_unit": unit,
            }
            if header := exported.headers.get(name):
                keys = legal_names(header)
                entry["header"] = {keys[key]: text for key, text in header.items()}
    scipy.io.savemat(stream, variables, long_field_names=True, do_compression=True)


def _struct(table: Table) -> dict[str, np.ndarray]:
    """Return the columns of a table in a form that MATLAB's ``struct2table`` accepts."""
    names = legal_names(table.columns)
    return {names[key]: each.values.reshape(-1, 1) for key, each in table.columns.items()}


def _xlsx(exported: Exported, stream: BinaryIO) -> None:
    """Write a sheet for each table; the head of a column gives its name and unit."""
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    fill(book, "provenance", ["key", "value"], exported.provenance.items())
    for name, table in exported.tables.items():
        columns = [column.values.tolist() for column in table.columns.values()]
        heads = [head(*column) for column in table.columns.items()]
        fill(book, name, heads, zip(*columns, strict=True))
    for matrices in exported.matrices:
        # A row is a sensor, as in the paper's matrices. The head gives the time or the column.
        axis, unit = matrices.axis
        first = [matrices.of, "unit", f"sensor, along {axis} [{unit}]"]
        first += matrices.coordinate.tolist()
        if len(first) > _MOST_COLUMNS:
            raise CapsuleError(
                f"{matrices.name} has {len(first)} columns, but a sheet of Excel has at most "
                f"{_MOST_COLUMNS}; choose --format parquet, or --what evaluation"
            )
        fill(book, matrices.name, first, _rows(matrices))
    book.save(stream)


def fill(book: "Workbook", name: str, first: Sequence[Any], rows: Iterable[Iterable[Any]]) -> None:
    """Write rows below the head of a sheet; add further sheets if the rows need them."""
    sheet, left, number = None, 0, 0
    for row in itertools.chain([()], rows):
        if sheet is None or not left:
            number, left = number + 1, MOST_ROWS
            sheet = book.create_sheet(name if number == 1 else f"{name}_{number}")
            sheet.freeze_panes = "A2"
            sheet.append([_cell(sheet, value) for value in first])
        if row:
            sheet.append([_cell(sheet, value) for value in row])
            left -= 1


def head(name: str, column: Column) -> str:
    """Return the head of a column, such as ``duration_s [s]``."""
    return f"{name} [{column.unit}]" if column.unit not in ("", NO_UNIT) else name


def _rows(matrices: Matrices) -> Iterator[list[Any]]:
    for name, matrix in matrices.values.items():
        for sensor, row in enumerate(matrix.tolist(), start=1):
            yield [name, matrices.units.get(name, ""), sensor, *row]


def _cell(sheet: "WriteOnlyWorksheet", value: object) -> object:
    """Return a cell: a number in full precision, or a text that is not taken for a formula."""
    from openpyxl.cell import WriteOnlyCell

    kind = "s"
    if isinstance(value, str) and value:
        plain = value if value.isprintable() else displayed(value)
        text = without_formula(plain)[:_LONGEST_TEXT]
    elif value == "" or (isinstance(value, float) and math.isnan(value)):
        return None
    elif isinstance(value, float) and math.isinf(value):
        text = str(value)
    # openpyxl writes only 16 digits, which is too few for this number.
    elif isinstance(value, float) and float(f"{value:.16g}") != value:
        text, kind = repr(value), "n"
    else:
        return value
    cell = WriteOnlyCell(sheet, text)
    cell.data_type = kind
    return cell


def _parquet(table: Table, provenance: Mapping[str, str], stream: BinaryIO) -> None:
    """Write one table; its metadata holds the units and the provenance."""
    import pyarrow
    from pyarrow import parquet

    arrays, fields = [], []
    for key, column in table.columns.items():
        # An unknown value becomes null. A column without text is still text.
        kind = pyarrow.string() if column.values.dtype == object else None
        arrays.append(pyarrow.array(column.values, type=kind, from_pandas=True))
        about = {"unit": column.unit, "long_name": column.long_name}
        fields.append(pyarrow.field(key, arrays[-1].type, metadata=about))
    metadata = {"long_name": table.long_name, "provenance": json.dumps(provenance)}
    schema = pyarrow.schema(fields, metadata=metadata)
    parquet.write_table(pyarrow.table(arrays, schema=schema), stream, compression="zstd")


def _netcdf(exported: Exported, stream: BinaryIO) -> None:
    """Write the matrices by recording, sensor and time, and each table as a group.

    The table of the recordings lies beside the matrices, along the same dimension.
    """
    import xarray

    tables = dict(exported.tables)
    variables = _variables(tables.pop("recordings"), "recording")
    for matrices in exported.matrices:
        variables = {**_stacked(matrices), **variables}
    groups = {"/": xarray.Dataset(variables, attrs=exported.provenance)}
    for name, table in tables.items():
        about = {"long_name": table.long_name}
        groups[name] = xarray.Dataset(_variables(table, "row"), attrs=about)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "export.nc"
        for group, data in groups.items():
            numbers = [key for key, each in data.variables.items() if each.dtype != object]
            packed: Any = {key: {"zlib": True, "complevel": 4} for key in numbers}
            data.to_netcdf(path, mode="a", group=group, engine="h5netcdf", encoding=packed)
        stream.write(path.read_bytes())


def _variables(table: Table, dimension: str) -> dict[str, tuple[Any, ...]]:
    """Return a variable for each column; NetCDF has no truth values, so these become 0 or 1."""
    return {
        name: (
            dimension,
            column.values.astype(np.int8) if column.values.dtype == bool else column.values,
            {"long_name": column.long_name} | ({"units": column.unit} if column.unit else {}),
        )
        for name, column in table.columns.items()
    }


def _stacked(matrices: Matrices) -> Mapping[str, tuple[Any, ...]]:
    """Return the variables of stacked matrices; shorter matrices are padded with NaN."""
    of, coordinate, (axis, unit) = matrices.of, matrices.coordinate, matrices.axis
    stack = np.full((len(matrices.values), matrices.sensors, coordinate.size), np.nan)
    for page, matrix in zip(stack, matrices.values.values(), strict=True):
        page[: matrix.shape[0], : matrix.shape[1]] = matrix
    # Templates can have another number of columns than recordings, so their axis has its own name.
    axis = axis if of == "recording" else f"{of}_{axis}"
    lengths = np.array([matrix.shape[1] for matrix in matrices.values.values()])
    many = {"units": "1", "long_name": f"number of columns of {matrices.name} that are filled"}
    about = {"units": matrices.unit, "long_name": matrices.long_name}
    sensors = np.arange(1, matrices.sensors + 1)
    return {
        of: (of, np.array([*matrices.values], dtype=object), {"long_name": f"name of the {of}"}),
        "sensor": ("sensor", sensors, {"long_name": "sensor, from the head"}),
        axis: (axis, coordinate, {"units": unit, "long_name": axis.replace("_", " ")}),
        matrices.name: ((of, "sensor", axis), stack, about),
        f"{matrices.name}_columns": (of, lengths, many),
    }


def _nwb_contents(exported: Exported) -> Contents:
    """Return a file for each accepted recording, and one for the tables."""
    of_recordings = [each.values for each in exported.matrices if each.of == "recording"]
    names = {name for values in of_recordings for name, matrix in values.items() if matrix.size}
    legal = legal_names(exported.headers)
    made: Contents = {f"{legal[name]}.nwb": partial(_nwb, exported, name) for name in names}
    return dict(sorted(made.items())) | {"tables.nwb": partial(_nwb_tables, exported)}


def _nwb(exported: Exported, name: str, stream: BinaryIO) -> None:
    """Write the matrices of one recording."""
    from pynwb import TimeSeries

    header = exported.headers[name]
    start, remark = session_start(header)
    about = f"recording {name} of a tactile capsule" + (f"; {remark}" if remark else "")
    file = _nwb_file(exported, name, start, about)
    file.data_collection = "".join(f"{key}: {value}\n" for key, value in header.items())
    for matrices in exported.matrices:
        if matrices.of == "recording":
            series = TimeSeries(
                name=matrices.name,
                # Time is the first axis in NWB, so a sensor is a column.
                data=matrices.values[name].T.copy(),
                unit=matrices.units[name],
                rate=exported.rate_hz,
                starting_time=0.0,
                description=f"{matrices.long_name}; a column is a sensor",
            )
            if matrices.rate_hz:
                file.add_acquisition(series)
            else:
                file.create_processing_module("preprocessing", "pre-processed").add(series)
    _save_nwb(file, stream)


def _nwb_tables(exported: Exported, stream: BinaryIO) -> None:
    """Write every table, and the templates as one more table."""
    from hdmf.common import DynamicTable, VectorData

    file = _nwb_file(exported, exported.what, NO_DATE, f"tables of an archive; {_UNKNOWN}")
    module = file.create_processing_module("tables", "tables of the archive")
    templates = {each.name: each.table() for each in exported.matrices if each.of == "size"}
    for name, table in {**exported.tables, **templates}.items():
        columns = []
        for key, column in table.columns.items():
            about = f"{column.long_name} [{column.unit}]" if column.unit else "text"
            data: Any = column.values
            if data.dtype == object:
                # HDF5 cannot infer that a column without rows holds text.
                data = [str(each) for each in data] if data.size else np.array([], dtype="S1")
            columns.append(VectorData(name=key, description=about, data=data))
        module.add(DynamicTable(name=name, description=table.long_name, columns=columns))
    _save_nwb(file, stream)


def session_start(header: Mapping[str, str]) -> tuple[datetime, str]:
    """Return the start date of a recording, and a remark about an unknown date or time zone."""
    told = header.get("started", "")
    try:
        started = datetime.fromisoformat(told)
    except ValueError:
        return NO_DATE, _UNKNOWN + (f" (the header says started: {told!r})" if told else "")
    if started.tzinfo is None:
        return started.replace(tzinfo=UTC), "the header names no time zone; UTC is assumed"
    return started, ""


def _nwb_file(exported: Exported, name: str, start: datetime, about: str) -> "pynwb.NWBFile":
    import pynwb

    return pynwb.NWBFile(
        session_description=about,
        identifier=f"{name} {exported.provenance['results_sha256']}",
        session_id=name,
        session_start_time=start,
        experiment_description=f"origin: {exported.provenance['origin']}",
        related_publications=[exported.provenance["method"]],
        notes=json.dumps(exported.provenance),
    )


def _save_nwb(file: "pynwb.NWBFile", stream: BinaryIO) -> None:
    import h5py
    import pynwb

    with h5py.File(stream, "w") as hdf, pynwb.NWBHDF5IO(file=hdf, mode="w") as written:
        written.write(file, cache_spec=True)


def _parquet_contents(exported: Exported) -> Contents:
    tables = {**exported.tables, **{each.name: each.table() for each in exported.matrices}}
    return {
        f"{name}.parquet": partial(_parquet, table, exported.provenance)
        for name, table in tables.items()
    }


FORMATS: Mapping[str, Callable[[Exported], Contents]] = {
    "mat": lambda exported: {f"{exported.what}.mat": partial(_mat, exported)},
    "xlsx": lambda exported: {f"{exported.what}.xlsx": partial(_xlsx, exported)},
    "parquet": _parquet_contents,
    "netcdf": lambda exported: {f"{exported.what}.nc": partial(_netcdf, exported)},
    "nwb": _nwb_contents,
}
