"""Represent a table of a laboratory's file, for all file formats."""

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
        Name in the file; empty if there is none.
    values : (K,) array
        Numbers; NaN if a cell is empty, marks a missing sample, or is not a number.
    unit : str
        Unit in the file; empty if there is none.
    texts : (K,) array of str, or None
        The cells' text in a text file.
    unreadable : (B,) array of int
        Indices of the cells that hold something other than a number.
    """

    name: str
    values: np.ndarray
    unit: str = ""
    texts: np.ndarray | None = None
    unreadable: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=int))

    @property
    def holds_numbers(self) -> bool:
        """Return whether most of the filled cells are numbers."""
        numbers = int(np.count_nonzero(~np.isnan(self.values)))
        return numbers > self.unreadable.size

    def without_first(self) -> "Column":
        """Return the column without its first cell."""
        texts = None if self.texts is None else self.texts[1:]
        unreadable = self.unreadable[self.unreadable > 0] - 1
        return Column(self.name, self.values[1:], self.unit, texts, unreadable)


@dataclass(frozen=True)
class SourceTable:
    """A table of a file: a sheet, a variable, a group, a stream, or the whole of a text file.

    Attributes
    ----------
    columns : tuple of Column
        All of the same length.
    kind : str
        Word for a table of this format, and key of lab.yaml that chooses one: ``sheet`` or
        ``variable``; empty if a file holds one table.
    label : str
        The table's name.
    lines : (K,) array of int, or None
        Number of each row's line or row in the file.
    line_word : str
        Word for what `lines` counts.
    started : str
        Date and time of the first sample, ISO 8601; empty if unknown.
    rate_hz : float or None
        Sampling rate that the file states.
    notes : mapping of str to str
        ``key: value`` lines of the file.
    reading : mapping of str to str
        How the file was read, as keys of lab.yaml: encoding, delimiter, decimal.
    passed_over : tuple of int
        Numbers of the lines without a whole sample.
    remark : str
        Note for the user; empty if there is none.
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
        """The table's place in its file, for a message; empty if the file holds one table."""
        return f"{self.kind} {self.label!r}" if self.kind else ""

    def line(self, index: int) -> str:
        """Return the place of a row, for a message."""
        if self.lines is None:
            return f"sample {index + 1}"
        return f"{self.line_word} {self.lines[index]}"

    def column_label(self, index: int) -> str:
        """Return a column's name, or its number if it has no name."""
        return repr(self.columns[index].name) if self.columns[index].name else f"{index + 1}"

    def listed(self, indices: list[int]) -> str:
        """Return a list of columns in words."""
        shown = [self.column_label(index) for index in indices[:_NAMED_AT_MOST]]
        more = len(indices) - len(shown)
        return ", ".join(shown) + (f" and {more} more" if more else "")

    def numbers(self, index: int) -> np.ndarray:
        """Return a column's numbers (K,).

        Raises
        ------
        CapsuleError
            If a cell holds something else; the message names its place.
        """
        column = self.columns[index]
        if column.unreadable.size:
            row = int(column.unreadable[0])
            text = "" if column.texts is None else str(column.texts[row])[:60]
            raise CapsuleError(
                f"{self.line(row)}, column {self.column_label(index)}: {text!r} is not a number; "
                "if it marks a missing sample, name it with --missing; if the table ends above "
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
    """Return a column of numbers, for a file format without text cells."""
    return Column(name, np.asarray(values, dtype=float), unit)
