"""Make tables from named arrays, as in numpy, MATLAB and HDF5 files."""

import io
import re
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.extra import damage_named
from capsule.importing.source_table import Column, SourceTable, bare_column

# A matrix with more columns is probably an image.
_MOST_COLUMNS = 256
_RATE_NAMES = re.compile(
    r"(fs|rate|rate_hz|srate|samplerate|sample_rate|sampling_?rate(_hz)?|samplingfrequency|freq)",
    re.IGNORECASE,
)
_LEAST_ROWS = 2


def read_numpy(content: bytes, name: str) -> list[SourceTable]:
    """Read the array of numpy's file format ``.npy``; fields of a structured array are columns.

    Parameters
    ----------
    content : bytes
        The file.
    name : str
        Name of the array.

    Raises
    ------
    CapsuleError
        The file is damaged, or holds no series of numbers.
    """
    with damage_named("numpy file", "save it again: numpy.save(file, array)"):
        array = np.load(io.BytesIO(content), allow_pickle=False)
    tables = array_tables({name: array}, {}, "/")
    if not tables:
        raise CapsuleError(
            f"an array of shape {array.shape} and type {array.dtype} is no table of numbers; save "
            "an array with one row a sample"
        )
    return [replace(table, kind="", label="") for table in tables]


def array_tables(
    arrays: Mapping[str, np.ndarray],
    units: Mapping[str, str],
    separator: str,
    started: str = "",
) -> list[SourceTable]:
    """Return tables that join arrays with the same length and the same parent.

    Parameters
    ----------
    arrays : mapping of str to array
        Arrays by path, such as ``run.time``. The longer side of a matrix counts samples. A single
        number called rate or fs is the sampling rate of arrays with that parent, or below it.
    units : mapping of str to str
        Units by path.
    separator : str
        Separator of the parts of a path.
    started : str
        Date and time of the first sample.

    Returns
    -------
    list of SourceTable
        Tables named by their parent, or by their first array if a parent has several.
    """
    rates: dict[str, float] = {}
    groups: defaultdict[tuple[str, int], dict[str, list[Column]]] = defaultdict(dict)
    for path, array in arrays.items():
        parent, _, name = path.rpartition(separator)
        if array.size == 1 and _RATE_NAMES.fullmatch(name) and float(array.flat[0]) > 0:
            rates[parent] = float(array.flat[0])
        elif (columns := _columns(path, name, array, units)) is not None:
            groups[parent, columns[0].values.size][path] = columns
    several = [parent for parent, _ in groups]
    tables = []
    for (parent, _), members in groups.items():
        first = next(iter(members))
        label = parent if several.count(parent) == 1 and parent else first
        side_by_side = tuple(column for each in members.values() for column in each)
        rate = _nearest_rate(parent, rates, separator)
        tables.append(SourceTable(side_by_side, "variable", label, started=started, rate_hz=rate))
    return tables


def _columns(
    path: str, name: str, array: np.ndarray, units: Mapping[str, str]
) -> list[Column] | None:
    """Return an array's columns; None if it is not a series of samples."""
    unit = units.get(path, "")
    if array.dtype.names:
        fields = [field for field in array.dtype.names if array.dtype[field].kind in "iuf"]
        if array.ndim != 1 or not fields or array.size < _LEAST_ROWS:
            return None
        return [bare_column(field, array[field]) for field in fields]
    if array.dtype.kind not in "iufb" or array.size < _LEAST_ROWS:
        return None
    array = np.squeeze(array)
    if array.ndim == 1:
        return [bare_column(name, array, unit)]
    if array.ndim != 2 or min(array.shape) > _MOST_COLUMNS:
        return None
    tall = array if array.shape[0] >= array.shape[1] else array.T
    return [
        bare_column(f"{name}({number})", column, unit)
        for number, column in enumerate(tall.T, start=1)
    ]


def _nearest_rate(parent: str, rates: Mapping[str, float], separator: str) -> float | None:
    while parent and parent not in rates:
        parent = parent.rpartition(separator)[0]
    return rates.get(parent)
