"""A table as it lies in a laboratory's file, whatever the format of the file."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.number_style import LARGEST_NUMBER

_NAMED_AT_MOST = 20


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name : str
        As the file has it; empty where it has none.
    values : (K,) array
        Numbers; NaN where a cell is empty, stands for a missing sample, or is no number.
    unit : str
        As the file has it; empty where it has none.
    texts : (K,) array of str, or None
        The cells as they stand in a text file.
    unreadable : (B,) array of int
        Indices of the cells that hold something that is no number.
    """

    name: str
    values: np.ndarray
    unit: str = ""
    texts: np.ndarray | None = None
    unreadable: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=int))

    @property
    def holds_numbers(self) -> bool:
        """Whether most of what stands in the cells is a number."""
        numbers = int(np.count_nonzero(~np.isnan(self.values)))
        return numbers > self.unreadable.size


@dataclass(frozen=True)
class SourceTable:
    """A table of a file: a sheet, a variable, a group, a stream, or the whole of a text file.

    Attributes
    ----------
    columns : tuple of Column
        All of the same length.
    kind : str
        What a table of this format is called, and the key of lab.yaml that chooses one:
        ``sheet`` or ``variable``; empty where a file holds one table.
    label : str
        The table's name.
    lines : (K,) array of int, or None
        Where each row stands: the number of its line or row.
    line_word : str
        What `lines` counts.
    started : str
        When the first sample was taken, ISO 8601; empty where it is unknown.
    rate_hz : float or None
        Sampling rate that the file gives beside the readings.
    notes : mapping of str to str
        ``key: value`` lines of the file.
    reading : mapping of str to str
        How the file was read, as keys of lab.yaml: encoding, delimiter, decimal.
    passed_over : tuple of int
        Numbers of the lines that hold no sample, or less than a whole one.
    remark : str
        What the user should know of the file; empty where nothing is odd.
    """

    columns: tuple[Column, ...]
    kind: str = ""
    label: str = ""
    lines: np.ndarray | None = None
    line_word: str = "line"
    started: str = ""
    rate_hz: float | None = None
    notes: Mapping[str, str] = field(default_factory=dict)
    reading: Mapping[str, str] = field(default_factory=dict)
    passed_over: tuple[int, ...] = ()
    remark: str = ""

    @property
    def place(self) -> str:
        """The table's place in its file, for a message; empty where there is but one."""
        return f"{self.kind} {self.label!r}" if self.kind else ""

    def line(self, index: int) -> str:
        """Name the place of a row."""
        if self.lines is None:
            return f"sample {index + 1}"
        return f"{self.line_word} {self.lines[index]}"

    def column_label(self, index: int) -> str:
        """Name a column by what stands above it, or by its number."""
        return repr(self.columns[index].name) if self.columns[index].name else f"{index + 1}"

    def listed(self, indices: list[int]) -> str:
        """List columns in words."""
        shown = [self.column_label(index) for index in indices[:_NAMED_AT_MOST]]
        more = len(indices) - len(shown)
        return ", ".join(shown) + (f" and {more} more" if more else "")

    def numbers(self, index: int) -> np.ndarray:
        """Return a column's numbers (K,).

        Raises
        ------
        CapsuleError
            A cell holds something else; the text names its place.
        """
        column = self.columns[index]
        if column.unreadable.size:
            row = int(column.unreadable[0])
            text = "" if column.texts is None else str(column.texts[row])[:60]
            raise CapsuleError(
                f"{self.line(row)}, column {self.column_label(index)}: {text!r} is not a number; "
                "if it stands for a missing sample, name it by --missing; if the table ends above "
                "it, delete what follows"
            )
        wild = np.flatnonzero(np.abs(column.values) > LARGEST_NUMBER)
        if wild.size:
            raise CapsuleError(
                f"{self.line(int(wild[0]))}, column {self.column_label(index)}: "
                f"{column.values[wild[0]]:g} is too large for a reading or a time; "
                "name another column"
            )
        return column.values


def bare_column(name: str, values: np.ndarray, unit: str = "") -> Column:
    """Make a column of numbers of a file that holds no text."""
    return Column(name, np.asarray(values, dtype=float), unit)
