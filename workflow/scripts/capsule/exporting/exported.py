"""Classes for exported data: tables, matrices with named axes, and provenance."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

NO_UNIT = "1"


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    name : str
        Name of the column in the results.
    unit : str
        Unit of the numbers; ``1`` for numbers without a unit, empty for text.
    long_name : str
        Description in words.
    values : (n,) array
        Values as float64 (NaN: unknown), int64, bool, or objects that are text.
    """

    name: str
    unit: str
    long_name: str
    values: np.ndarray


@dataclass(frozen=True)
class Table:
    """A table: columns of equal length.

    Attributes
    ----------
    name : str
        Name of letters, digits and underscores.
    long_name : str
        Description of the rows.
    columns : tuple of Column
        The columns in their order.
    """

    name: str
    long_name: str
    columns: tuple[Column, ...]

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.columns[0].values)

    def values(self, name: str) -> np.ndarray:
        """Return the values of a column."""
        return next(column.values for column in self.columns if column.name == name)


@dataclass(frozen=True)
class Matrices:
    """A group of matrices: one for each recording, or one for each size of a template.

    Attributes
    ----------
    name, long_name : str
        Name and description of the group.
    units : mapping of str to str
        Unit of the values of each matrix, by the same names as `values`.
    of : {"recording", "size"}
        Kind of item that each matrix belongs to.
    axis : str
        Name of the second axis; the first axis is ``sensor``, counted from 1.
    axis_unit : str
        Unit of the second axis.
    coordinate : (n,) array
        Positions on the second axis of the columns of the longest matrix.
    values : mapping of str to (S, K) array
        Matrices by names such as ``3mm/r07`` or ``3mm``; NaN if a sample is missing. A rejected
        recording has K = 0.
    """

    name: str
    long_name: str
    units: Mapping[str, str]
    of: str
    axis: str
    axis_unit: str
    coordinate: np.ndarray
    values: Mapping[str, np.ndarray]

    @property
    def unit(self) -> str:
        """The common unit; if the recordings differ, all units, joined by "or"."""
        return " or ".join(sorted(set(self.units.values()))) or NO_UNIT

    @property
    def sensors(self) -> int:
        """Number of sensors S."""
        return max((matrix.shape[0] for matrix in self.values.values()), default=0)


@dataclass(frozen=True)
class Exported:
    """All data of one export.

    Attributes
    ----------
    what : str
        Kind of the exported data, such as ``recordings`` or ``all``.
    rate_hz : float
        Sampling rate of readings and matrices.
    tables : tuple of Table
        The tables.
    matrices : tuple of Matrices
        The matrices.
    headers : mapping of str to mapping
        The ``# key: value`` lines of each recording.
    provenance : mapping of str to str
        Provenance of the data; the keys are plain names.
    """

    what: str
    rate_hz: float
    tables: tuple[Table, ...]
    matrices: tuple[Matrices, ...]
    headers: Mapping[str, Mapping[str, str]]
    provenance: Mapping[str, str]

    def table(self, name: str) -> Table | None:
        """Return a table; None if it is not exported."""
        return next((table for table in self.tables if table.name == name), None)


def long_table(matrices: Matrices) -> Table:
    """Return matrices as one long table; each row is a column of a matrix.

    Parameters
    ----------
    matrices : Matrices
        The matrices.

    Returns
    -------
    Table
        Columns for the names, for the second axis and for each sensor.
    """
    names = list(matrices.values)
    lengths = [matrices.values[name].shape[1] for name in names]
    of = np.repeat(np.array(names, dtype=object), lengths)
    along = np.concatenate([matrices.coordinate[:length] for length in lengths] or [np.empty(0)])
    axis = f"{matrices.axis}_{matrices.axis_unit}" if matrices.axis_unit != "1" else matrices.axis
    columns = [Column(matrices.of, "", f"name of the {matrices.of}", of)]
    columns += [Column(axis, matrices.axis_unit, matrices.axis, along)]
    for sensor in range(matrices.sensors):
        parts = [matrix[sensor] for matrix in matrices.values.values()]
        what = f"{matrices.long_name}, sensor {sensor + 1}"
        column = np.concatenate(parts or [np.empty(0)])
        columns.append(Column(f"sensor_{sensor + 1}", matrices.unit, what, column))
    return Table(matrices.name, matrices.long_name, tuple(columns))
