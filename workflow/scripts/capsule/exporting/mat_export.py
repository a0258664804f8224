"""Export to MATLAB: one .mat file of version 5, which all later versions of MATLAB open."""

from collections.abc import Callable
from functools import partial
from typing import Any, BinaryIO

import numpy as np
import scipy.io

from capsule.exporting.exported import Exported, Table
from capsule.exporting.legal_names import legal_names


def contents(exported: Exported) -> dict[str, Callable[[BinaryIO], None]]:
    """Return the name of the file, with the function that writes it."""
    return {f"{exported.what}.mat": partial(_write, exported)}


def _write(exported: Exported, stream: BinaryIO) -> None:
    variables: dict[str, Any] = {
        "provenance": dict(exported.provenance),
        "rate_hz": exported.rate_hz,
        "tables": {table.name: _columns(table) for table in exported.tables},
        "units": {
            table.name: {column.name: column.unit for column in table.columns}
            for table in exported.tables
        },
        "long_names": {
            table.name: {column.name: column.long_name for column in table.columns}
            for table in exported.tables
        },
    }
    for matrices in exported.matrices:
        group = variables.setdefault(f"{matrices.of}s", {})
        for name, legal in legal_names(matrices.values).items():
            entry = group.setdefault(legal, {"name": name})
            matrix = matrices.values[name]
            entry[matrices.name] = matrix
            entry[f"{matrices.name}_unit"] = matrices.units.get(name, "")
            entry[matrices.axis] = matrices.coordinate[: matrix.shape[1]].reshape(1, -1)
            entry[f"{matrices.axis}_unit"] = matrices.axis_unit
            if header := exported.headers.get(name):
                keys = legal_names(header)
                entry["header"] = {keys[key]: text for key, text in header.items()}
    scipy.io.savemat(stream, variables, long_field_names=True, do_compression=True)


def _columns(table: Table) -> dict[str, np.ndarray]:
    """Return the columns of a table in a form that MATLAB's ``struct2table`` accepts."""
    names = legal_names(column.name for column in table.columns)
    return {names[column.name]: column.values.reshape(-1, 1) for column in table.columns}
