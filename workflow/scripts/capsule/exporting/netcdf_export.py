"""Export to NetCDF: one file with the matrices by recording, sensor and time, and the tables.

Each table, except that of the recordings, is a group.
"""

import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

import numpy as np

from capsule.exporting.exported import Exported, Matrices, Table

if TYPE_CHECKING:
    import xarray

_RECORDINGS = "recordings"
_PACKED = {"zlib": True, "complevel": 4}


def contents(exported: Exported) -> dict[str, Callable[[BinaryIO], None]]:
    """Return the name of the file, with the function that writes it."""
    return {f"{exported.what}.nc": partial(_write, exported)}


def _write(exported: Exported, stream: BinaryIO) -> None:
    import xarray

    tables = {table.name: table for table in exported.tables}
    variables = _variables(tables.pop(_RECORDINGS), "recording")
    for matrices in exported.matrices:
        variables = {**_stacked(matrices), **variables}
    root = xarray.Dataset(variables, attrs=exported.provenance)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "export.nc"
        _save(root, path, "w", None)
        for name, table in tables.items():
            about = {"long_name": table.long_name}
            _save(xarray.Dataset(_variables(table, "row"), attrs=about), path, "a", name)
        stream.write(path.read_bytes())


def _variables(table: Table, dimension: str) -> dict[str, tuple[Any, ...]]:
    """Return a variable for each column; NetCDF has no truth values, so these become 0 or 1."""
    return {
        column.name: (
            dimension,
            column.values.astype(np.int8) if column.values.dtype == bool else column.values,
            {"long_name": column.long_name} | ({"units": column.unit} if column.unit else {}),
        )
        for column in table.columns
    }


def _stacked(matrices: Matrices) -> Mapping[str, tuple[Any, ...]]:
    """Return the variables of stacked matrices; shorter matrices are padded with NaN."""
    shape = len(matrices.values), matrices.sensors, matrices.coordinate.size
    stack = np.full(shape, np.nan)
    for page, matrix in zip(stack, matrices.values.values(), strict=True):
        page[: matrix.shape[0], : matrix.shape[1]] = matrix
    # Templates can have another number of columns than recordings, so their axis has its own name.
    axis = matrices.axis if matrices.of == "recording" else f"{matrices.of}_{matrices.axis}"
    lengths = np.array([matrix.shape[1] for matrix in matrices.values.values()])
    along = {"units": matrices.axis_unit, "long_name": axis.replace("_", " ")}
    about = {"units": matrices.unit, "long_name": matrices.long_name}
    named = {"long_name": f"name of the {matrices.of}"}
    many = {"units": "1", "long_name": f"number of columns of {matrices.name} that are filled"}
    return {
        matrices.of: (matrices.of, np.array(list(matrices.values), dtype=object), named),
        "sensor": ("sensor", np.arange(1, shape[1] + 1), {"long_name": "sensor, from the head"}),
        axis: (axis, matrices.coordinate, along),
        matrices.name: ((matrices.of, "sensor", axis), stack, about),
        f"{matrices.name}_columns": (matrices.of, lengths, many),
    }


def _save(
    dataset: "xarray.Dataset", path: Path, mode: Literal["w", "a"], group: str | None
) -> None:
    packed: Any = {
        name: _PACKED for name, variable in dataset.variables.items() if variable.dtype != object
    }
    dataset.to_netcdf(path, mode=mode, group=group, engine="h5netcdf", encoding=packed)
