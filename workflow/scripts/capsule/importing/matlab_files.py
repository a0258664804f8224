"""Read MATLAB files up to version 7.2 with scipy."""

import io
from collections.abc import Iterator

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError, mat_struct

from capsule.errors import CapsuleError
from capsule.importing.array_tables import array_tables
from capsule.importing.extra import damage_named
from capsule.importing.source_table import SourceTable

SEPARATOR = "."


def read_matlab(content: bytes) -> list[SourceTable]:
    """Read the arrays of a MATLAB file; fields of a structure are named ``run.time``.

    Parameters
    ----------
    content : bytes
        The file.

    Raises
    ------
    CapsuleError
        The file is damaged, or holds no series of numbers.
    """
    with damage_named("MATLAB file", "save it again: save -v7", MatReadError):
        variables = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=True)
    named = {name: value for name, value in variables.items() if not name.startswith("__")}
    arrays = dict(_arrays(named, ""))
    tables = array_tables(arrays, {}, SEPARATOR)
    if not tables:
        raise CapsuleError(
            f"no variable holds a series of numbers; it holds {', '.join(named) or 'nothing'}. "
            "Only MATLAB can read a table or timetable: save its columns as arrays, "
            "x = table2array(T)"
        )
    return tables


def _arrays(variables: dict[str, object], prefix: str) -> Iterator[tuple[str, np.ndarray]]:
    for name, value in variables.items():
        if isinstance(value, mat_struct):
            fields = {field: getattr(value, field) for field in value._fieldnames}
            yield from _arrays(fields, f"{prefix}{name}{SEPARATOR}")
            continue
        array = np.asarray(value)
        if array.dtype == object and all(isinstance(each, mat_struct) for each in array.flat):
            for number, each in enumerate(array.flat, start=1):
                yield from _arrays({f"{name}({number})": each}, prefix)
        elif array.dtype.kind in "iufb":
            yield f"{prefix}{name}", array
