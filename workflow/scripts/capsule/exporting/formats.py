"""Write exported data as files of MATLAB, Excel, Parquet, NetCDF and NWB.

All formats hold the same values, units and provenance. `FORMATS` names them; a function for each
returns the names of its files with what writes them. Packages are imported only if they are used.
"""

import itertools
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import UTC, datetime
from functools import cache, partial
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
import pandas as pd

from capsule.engine.configuration import read_config_file
from capsule.engine.project import SCHEMAS
from capsule.errors import CapsuleError
from capsule.exporting.gathering import NO_UNIT, OWNER, Exported
from capsule.recordings.names import displayed, without_formula

if TYPE_CHECKING:
    from openpyxl import Workbook
    from openpyxl.worksheet._write_only import WriteOnlyWorksheet

# What writes each file, by its name.
Contents = dict[str, Callable[[Any], None]]
Tables = dict[str, pd.DataFrame]

# The value of namelengthmax in MATLAB.
_LONGEST_NAME = 63
# Names that get an x in front there: those that begin with no letter, and its keywords.
_NO_NAME = re.compile(
    "([^A-Za-z].*)?|break|case|catch|classdef|continue|else|elseif|end|for|function|global|if|"
    "otherwise|parfor|persistent|return|spmd|switch|try|while"
)
# Excel's limits for one sheet: rows below the head, and columns.
MOST_ROWS = 1_048_575
_MOST_COLUMNS = 16_384
# NWB requires a date. This one replaces an unknown date, and the file says so.
NO_DATE = datetime(1970, 1, 1, tzinfo=UTC)
_UNKNOWN = "session_start_time is not known: 1970-01-01T00:00:00Z stands for it"


@cache
def described() -> dict[str, dict[str, str]]:
    """Return the content of workflow/schemas/columns.yaml: words for tables and columns."""
    return read_config_file(SCHEMAS / "columns.yaml")


def columns_of(table: pd.DataFrame) -> Iterator[tuple[str, np.ndarray, str, str]]:
    """Yield name, values, unit and long name of each column of a table, as all formats write them.

    The values are float64 (NaN: unknown), int64, bool, or objects that are text. The unit of text
    and of truth values is empty; that of sensors is an attribute of their table.
    """
    for name, values in table.items():
        unit, long_name = describe(str(name))
        if str(name).startswith("sensor_"):
            unit = table.attrs["unit"]
        array = values.to_numpy()
        yield str(name), array, "" if array.dtype in (bool, object) else unit, long_name


def describe(name: str) -> tuple[str, str]:
    """Return the unit (``1`` if it has none) and the long name of a column of numbers.

    Both follow from the column's name, such as ``estimate_low_mm`` or ``peak_spacing_2``.
    """
    told = described()
    base: list[str] = []
    unit, end, of = NO_UNIT, "", ""
    for part in name.split("_"):
        if base and part in told["units"]:
            unit = told["units"][part]
        elif base and part in told["ends"]:
            end = told["ends"][part]
        elif part.isdecimal():
            of = f", sensor {part}"
        elif base and re.fullmatch(r"[0-9.]+mm", part):
            of = f" beside the template of {part}"
        else:
            base.append(part)
    key = "_".join(base)
    words = told["columns"].get(name) or told["columns"].get(key) or key.replace("_", " ")
    return told["units"].get(key, unit), f"{end} {words}{of}".strip()


def legal_names(names: Iterable[str]) -> dict[str, str]:
    """Return a unique field name for each name, made as MATLAB's ``matlab.lang.makeValidName``.

    The field of ``3mm/r07`` is ``x3mm_r07``.
    """
    original: dict[str, str] = {}
    for name in names:
        spaced = f"x {name}" if _NO_NAME.fullmatch(name) else name
        joined = re.sub(r"\s+(\S?)", lambda match: match[1].upper(), spaced)
        base = re.sub(r"[^A-Za-z0-9_]", "_", joined)[:_LONGEST_NAME]
        legal, number = base, 0
        while legal in original:
            number += 1
            legal = f"{base[: _LONGEST_NAME - len(f'_{number}')]}_{number}"
        original[legal] = name
    return {name: legal for legal, name in original.items()}


def _mat(exported: Exported, stream: BinaryIO) -> None:
    """Write a file of MATLAB's version 5, which all later versions open."""
    import scipy.io

    variables: dict[str, Any] = {"provenance": exported.provenance, "rate_hz": exported.rate_hz}
    variables |= {"tables": {}, "units": {}, "long_names": {}}
    for name, table in exported.tables.items():
        legal, columns = legal_names(table.columns), [*columns_of(table)]
        # MATLAB's struct2table takes columns.
        variables["tables"][name] = {legal[key]: values[:, None] for key, values, _, _ in columns}
        variables["units"][name] = {legal[key]: unit for key, _, unit, _ in columns}
        variables["long_names"][name] = {legal[key]: words for key, _, _, words in columns}
    for array, parts in exported.arrays.items():
        group = variables.setdefault(f"{OWNER[array]}s", {})
        for name, field in legal_names(parts).items():
            along = exported.along(array, name)
            axis, entry = str(along.name), group.setdefault(field, {"name": name})
            entry |= {array: parts[name], f"{array}_unit": exported.unit(array, name)}
            entry |= {axis: along.to_numpy()[None], f"{axis}_unit": describe(axis)[0]}
            if header := exported.headers.get(name):
                keys = legal_names(header)
                entry["header"] = {keys[key]: text for key, text in header.items()}
    scipy.io.savemat(stream, variables, long_field_names=True, do_compression=True)


def _xlsx(exported: Exported, stream: BinaryIO) -> None:
    """Write a sheet for each table, and one for each kind of array."""
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    provenance = pd.DataFrame(exported.provenance.items(), columns=["key", "value"])
    write_sheets(book, "provenance", provenance)
    for name, table in exported.tables.items():
        units = [(key, unit) for key, _, unit, _ in columns_of(table) if unit not in ("", NO_UNIT)]
        heads = {key: f"{key} [{unit}]" for key, unit in units}
        write_sheets(book, name, table.rename(columns=heads))
    for array in exported.arrays:
        # A row is a sensor, as in the paper's matrices. The heads give the time or the column.
        table = exported.long_table(array)
        of, axis = table.index.names
        rows = table.stack().unstack(axis, sort=False)
        rows = rows.rename_axis([of, f"sensor, along {axis} [{describe(axis)[0]}]"]).reset_index()
        rows.insert(1, "unit", [exported.unit(array, name) for name in rows[of]])
        write_sheets(book, array, rows)
    book.save(stream)


def write_sheets(book: "Workbook", name: str, table: pd.DataFrame) -> None:
    """Write a table as a sheet; rows that the sheet cannot hold go on in further sheets."""
    if table.shape[1] > _MOST_COLUMNS:
        raise CapsuleError(
            f"{name} has {table.shape[1]} columns, but a sheet of Excel has at most "
            f"{_MOST_COLUMNS}; choose --format parquet, or --what evaluation"
        )
    # The cell of an unknown value is empty, and Excel has no infinite number.
    known = table.astype(object).replace({"": None, np.nan: None, np.inf: "inf", -np.inf: "-inf"})
    for number, start in enumerate(range(0, max(len(table), 1), MOST_ROWS), start=1):
        sheet = book.create_sheet(name if number == 1 else f"{name}_{number}")
        sheet.freeze_panes = "A2"
        rows = known[start : start + MOST_ROWS].itertuples(index=False, name=None)
        for row in itertools.chain([table.columns], rows):
            sheet.append([_cell(sheet, value) for value in row])


def _cell(sheet: "WriteOnlyWorksheet", value: object) -> object:
    """Return a cell: a number in full precision, or a text that is not taken for a formula."""
    from openpyxl.cell import WriteOnlyCell

    if isinstance(value, str):
        text, kind = without_formula(value if value.isprintable() else displayed(value)), "s"
    # openpyxl writes only 16 digits, which is too few for this number.
    elif isinstance(value, float) and float(f"{value:.16g}") != value:
        text, kind = repr(value), "n"
    else:
        return value
    cell = WriteOnlyCell(sheet, text)
    cell.data_type = kind
    return cell


def _parquet(exported: Exported, name: str, table: pd.DataFrame, stream: BinaryIO) -> None:
    """Write one table; its metadata holds the units and the provenance."""
    import pyarrow
    from pyarrow import parquet

    arrays, fields = [], []
    for key, values, unit, long_name in columns_of(table):
        # An unknown value becomes null. A column without text is still text.
        kind = pyarrow.string() if values.dtype == object else None
        arrays.append(pyarrow.array(values, type=kind, from_pandas=True))
        about = {"unit": unit, "long_name": long_name}
        fields.append(pyarrow.field(key, arrays[-1].type, metadata=about))
    provenance = json.dumps(exported.provenance)
    metadata = {"long_name": described()["tables"][name], "provenance": provenance}
    schema = pyarrow.schema(fields, metadata=metadata)
    parquet.write_table(pyarrow.table(arrays, schema=schema), stream, compression="zstd")


def _netcdf(exported: Exported, stream: BinaryIO) -> None:
    """Write the arrays by recording, sensor and time, and each table as a group.

    The table of the recordings lies beside the arrays, along the same dimension. Shorter arrays are
    padded with NaN.
    """
    import xarray

    tables = dict(exported.tables)
    variables = _variables(tables.pop("recordings"), "recording")
    root = xarray.Dataset({"recording": variables["recording"]}, attrs=exported.provenance)
    for array, parts in exported.arrays.items():
        table = exported.long_table(array)
        of, along = table.index.names
        # Templates may have more or fewer columns than recordings, so their axis has its own name.
        axis = along if of == "recording" else f"{of}_{along}"
        about = {"long_name": described()["tables"][array], "units": table.attrs["unit"]}
        stack = table.to_xarray().to_dataarray("sensor").rename({along: axis})
        root[array] = stack.transpose(of, "sensor", axis).assign_attrs(about)
        root[f"{array}_columns"] = (of, [values.shape[1] for values in parts.values()])
        root[axis].attrs |= {"long_name": along, "units": describe(along)[0]}
        root["sensor"].attrs["long_name"] = "sensor, from the head"
    groups = {"/": root.assign(variables)}
    for name, table in tables.items():
        about = {"long_name": described()["tables"][name]}
        groups[name] = xarray.Dataset(_variables(table, "row"), attrs=about)
    packed = {"/": {array: {"zlib": True, "complevel": 4} for array in exported.arrays}}
    stream.write(xarray.DataTree.from_dict(groups).to_netcdf(engine="h5netcdf", encoding=packed))


def _variables(table: pd.DataFrame, dimension: str) -> dict[str, tuple[Any, ...]]:
    """Return a variable of NetCDF for each column of a table."""
    return {
        name: (dimension, values, {"long_name": long_name} | ({"units": unit} if unit else {}))
        for name, values, unit, long_name in columns_of(table)
    }


def _nwb_contents(exported: Exported) -> Contents:
    """Return a file for each accepted recording, and one for the tables and the templates."""
    made: Contents = {}
    for name, legal in sorted(legal_names(exported.headers).items()):
        own = [array for array, parts in exported.arrays.items() if name in parts]
        if any(exported.arrays[array][name].size for array in own):
            made[f"{legal}.nwb"] = partial(_nwb, exported, name, own, {})
    tables = flat_tables(exported, exported.arrays.keys() & {"template"})
    return made | {"tables.nwb": partial(_nwb, exported, exported.what, [], tables)}


def _nwb(
    exported: Exported, name: str, arrays: list[str], tables: Tables, stream: BinaryIO
) -> None:
    """Write the arrays of one recording, or tables, with their provenance and date."""
    import h5py
    from hdmf.common import DynamicTable, VectorData
    from pynwb import NWBHDF5IO, NWBFile, TimeSeries

    # The tables have no header, so their date is unknown.
    header = exported.headers.get(name, {})
    start, remark = session_start(header)
    about = f"recording {name} of a tactile capsule" if arrays else "tables of an archive"
    file = NWBFile(
        session_description=f"{about}; {remark}" if remark else about,
        identifier=f"{name} {exported.provenance['results_sha256']}",
        session_id=name,
        session_start_time=start,
        experiment_description=f"origin: {exported.provenance['origin']}",
        related_publications=[exported.provenance["method"]],
        data_collection="".join(f"{key}: {value}\n" for key, value in header.items()),
        notes=json.dumps(exported.provenance),
    )
    for array in arrays:
        series = TimeSeries(
            name=array,
            # Time is the first axis in NWB, so a sensor is a column.
            data=exported.arrays[array][name].T,
            unit=exported.unit(array, name),
            rate=exported.rate_hz,
            starting_time=0.0,
            description=f"{described()['tables'][array]}; a column is a sensor",
        )
        if array == "readings":
            file.add_acquisition(series)
        else:
            file.create_processing_module("preprocessing", "pre-processed").add(series)
    if tables:
        module = file.create_processing_module("tables", "tables of the archive")
    for title, table in tables.items():
        columns = [
            VectorData(name=key, description=f"{words} [{unit}]" if unit else "text", data=values)
            for key, values, unit, words in columns_of(table)
        ]
        about = described()["tables"][title]
        module.add(DynamicTable(name=title, description=about, columns=columns))
    with h5py.File(stream, "w") as hdf, NWBHDF5IO(file=hdf, mode="w") as written:
        written.write(file, cache_spec=True)


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


def flat_tables(exported: Exported, arrays: Iterable[str]) -> Tables:
    """Return all tables, and arrays with the recording and the time as their first columns."""
    tables = dict(exported.tables)
    for array in arrays:
        table = exported.long_table(array).add_prefix("sensor_").reset_index()
        tables[array] = table.rename(columns={"time": "time_s"})
    return tables


FORMATS: Mapping[str, Callable[[Exported], Contents]] = {
    "mat": lambda exported: {f"{exported.what}.mat": partial(_mat, exported)},
    "xlsx": lambda exported: {f"{exported.what}.xlsx": partial(_xlsx, exported)},
    "parquet": lambda exported: {
        f"{name}.parquet": partial(_parquet, exported, name, table)
        for name, table in flat_tables(exported, exported.arrays).items()
    },
    "netcdf": lambda exported: {f"{exported.what}.nc": partial(_netcdf, exported)},
    "nwb": _nwb_contents,
}
