"""Represent a table of a laboratory's file, and choose the tables of a file that are runs."""

import difflib
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from capsule.errors import CapsuleError

# Larger numbers are neither times nor readings.
LARGEST_NUMBER = 1e20
_NAMED_AT_MOST = 20
# A matrix with more columns is probably an image.
_MOST_COLUMNS = 256
_RATE_NAMES = re.compile(
    r"(fs|rate|rate_hz|srate|samplerate|sample_rate|sampling_?rate(_hz)?|samplingfrequency|freq)",
    re.IGNORECASE,
)
# Least number of columns whose numbers are taken for names without a question.
_LEAST_NAMES = 3


class QuestionError(CapsuleError):
    """The error of a file that can be read in several ways; its text names the deciding options."""

    @property
    def subject(self) -> str:
        """The text without its numbers, dates and times, the same for files of one kind."""
        return re.sub(r"(?<![A-Za-z_])[+-]?[0-9][0-9.,:/e+-]*", "0", str(self))


@dataclass(frozen=True)
class Table:
    """A table of a file: a sheet, a variable, a group, a stream, or the whole of a text file.

    Attributes
    ----------
    names, units : tuple of C str
        Name and unit of each column in the file; empty if there is none.
    numbers : (C, K) array
        Numbers; NaN if a cell is empty, marks a missing sample, or is not a number.
    texts : (C, K) array of str, or None
        The cells of a file of text cells.
    unreadable : (C, K) array of bool, or None
        Whether a cell holds something other than a number or a mark of a missing sample.
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
        Date and time of the first sample, as the file states it; empty if unknown.
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

    names: tuple[str, ...]
    units: tuple[str, ...]
    numbers: np.ndarray
    texts: np.ndarray | None = None
    unreadable: np.ndarray | None = None
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

    def line(self, row: int) -> str:
        """Return the place of a row, for a message."""
        return f"sample {row + 1}" if self.lines is None else f"{self.line_word} {self.lines[row]}"

    def column_label(self, index: int) -> str:
        """Return a column's name, or its number if it has no name."""
        return repr(self.names[index]) if self.names[index] else f"{index + 1}"

    def listed(self, indices: Sequence[int]) -> str:
        """Return a list of columns in words."""
        return _listed([self.column_label(index) for index in indices])

    def holds_numbers(self, index: int) -> bool:
        """Return whether most of the filled cells of a column are numbers."""
        others = 0 if self.unreadable is None else np.count_nonzero(self.unreadable[index])
        return bool(np.count_nonzero(~np.isnan(self.numbers[index])) > others)

    def all_numbers(self, index: int) -> np.ndarray:
        """Return a column's numbers (K,).

        Raises
        ------
        CapsuleError
            If a cell holds something else; the message names its place.
        """
        column = f"column {self.column_label(index)}"
        if self.texts is not None and self.unreadable is not None and self.unreadable[index].any():
            row = int(np.argmax(self.unreadable[index]))
            raise CapsuleError(
                f"{self.line(row)}, {column}: {str(self.texts[index, row])[:60]!r} is not a "
                "number; if it marks a missing sample, name it with --missing; if the table ends "
                "above it, delete what follows"
            )
        numbers: np.ndarray = self.numbers[index]
        wild = np.flatnonzero(np.abs(numbers) > LARGEST_NUMBER)
        if wild.size:
            raise CapsuleError(
                f"{self.line(int(wild[0]))}, {column}: {numbers[wild[0]]:g} is too large for a "
                "reading or a time; name another column"
            )
        return numbers


def table_of(
    columns: Sequence[tuple[str, np.ndarray, str]],
    label: str,
    started: str = "",
    rate_hz: float | None = None,
    remark: str = "",
) -> Table:
    """Return a table of a format without text cells.

    Parameters
    ----------
    columns : sequence of (str, (K,) array, str)
        Name, numbers and unit of each column.
    label : str
        The table's name.
    started : str
        Date and time of the first sample, as the file states it.
    rate_hz : float or None
        Sampling rate that the file states.
    remark : str
        Note for the user.
    """
    names, values, units = zip(*columns, strict=True)
    numbers = np.array([np.asarray(each, dtype=float) for each in values])
    return Table(
        names,
        units,
        numbers,
        kind="variable",
        label=label,
        started=started,
        rate_hz=rate_hz,
        remark=remark,
    )


def array_tables(
    arrays: Mapping[str, np.ndarray],
    units: Mapping[str, str],
    separator: str,
    started: str = "",
) -> list[Table]:
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
    list of Table
        Tables named by their parent, or by their first array if a parent has several.
    """
    rates: dict[str, float] = {}
    groups: defaultdict[tuple[str, int], dict[str, Any]] = defaultdict(dict)
    for path, array in arrays.items():
        parent, _, name = path.rpartition(separator)
        if array.size == 1 and _RATE_NAMES.fullmatch(name) and float(array.flat[0]) > 0:
            rates[parent] = float(array.flat[0])
        elif columns := _array_columns(name, array, units.get(path, "")):
            groups[parent, len(columns[0][1])][path] = columns
    parents = [parent for parent, _ in groups]
    tables = []
    for (parent, _), members in groups.items():
        label = parent if parents.count(parent) == 1 and parent else next(iter(members))
        above = parent
        while above and above not in rates:
            above = above.rpartition(separator)[0]
        columns = [column for each in members.values() for column in each]
        tables.append(table_of(columns, label, started, rates.get(above)))
    return tables


def _array_columns(name: str, array: np.ndarray, unit: str) -> list[tuple[str, np.ndarray, str]]:
    """Return an array's columns; none if it is not a series of samples."""
    if array.size < 2:
        return []
    if array.dtype.names:
        fields = [field for field in array.dtype.names if array.dtype[field].kind in "iuf"]
        return [(field, array[field], "") for field in fields] if array.ndim == 1 else []
    array = np.squeeze(array)
    if array.dtype.kind not in "iufb" or array.ndim > 2 or min(array.shape) > _MOST_COLUMNS:
        return []
    if array.ndim == 1:
        return [(name, array, unit)]
    tall = array if array.shape[0] >= array.shape[1] else array.T
    return [(f"{name}({n})", column, unit) for n, column in enumerate(tall.T, start=1)]


def choose_tables(tables: Sequence[Table], keys: SimpleNamespace, needed: int) -> list[Table]:
    """Return the tables that are runs: the named table, all tables, or the only one that fits.

    Parameters
    ----------
    tables : sequence of Table
        The tables of a file.
    keys : SimpleNamespace
        The keys of lab.yaml, of which ``sheet`` and ``variable`` are used.
    needed : int
        Least number of columns of numbers of a run.

    Raises
    ------
    CapsuleError
        If the named table does not exist, or several tables fit.
    """
    kind = tables[0].kind
    for key, name in (("sheet", keys.sheet), ("variable", keys.variable)):
        if name and key != kind:
            raise CapsuleError(
                f"{key}: {name!r} is given, but the file holds "
                f"{f'{kind}s' if kind else 'one table'}; leave it out"
            )
    if not kind:
        return list(tables)
    labels = [table.label for table in tables]
    held = f"the file holds {_listed([repr(label) for label in labels])}"
    wanted = keys.sheet or keys.variable
    if wanted and wanted != "all":
        if matching := [table for table in tables if table.label == wanted]:
            return matching
        near = difflib.get_close_matches(wanted, labels, n=1)
        hint = f"did you mean {near[0]!r}?" if near else held
        raise CapsuleError(f"{kind}: there is no {wanted!r}; {hint}")
    fitting = [
        table
        for table in tables
        if sum(map(table.holds_numbers, range(len(table.names)))) >= needed
    ]
    if not fitting:
        raise CapsuleError(f"no {kind} holds {needed} columns of numbers; {held}")
    if len(fitting) > 1 and wanted != "all":
        raise QuestionError(
            f"{len(fitting)} of its parts can be the recording: "
            f"{_listed([repr(table.label) for table in fitting])}; name one with --{kind}, or use "
            f"--{kind} all if each one is a run"
        )
    return fitting


def _listed(labels: Sequence[str]) -> str:
    more = len(labels) - _NAMED_AT_MOST
    return ", ".join(labels[:_NAMED_AT_MOST]) + (f" and {more} more" if more > 0 else "")


def without_number_head(table: Table, keys: SimpleNamespace) -> Table:
    """Return a table without a first row of consecutive whole numbers, which are names.

    pandas and numpy write such names.

    Parameters
    ----------
    table : Table
        The table; if it has names, it is returned as it is.
    keys : SimpleNamespace
        The keys of lab.yaml, of which ``skip_lines`` is used.

    Raises
    ------
    QuestionError
        If the row can be a sample, too.
    """
    lines, texts, unreadable = table.lines, table.texts, table.unreadable
    if lines is None or texts is None or unreadable is None or len(lines) <= 2 or any(table.names):
        return table
    cells = texts[:, 0].tolist()
    if not _counts_columns(cells):
        return table
    shown = f"{table.line(0)}: {','.join(cells)!r}"
    if len(cells) >= _LEAST_NAMES and np.mean(is_far(table.numbers[1:])) >= 0.5:
        return replace(
            table,
            numbers=table.numbers[:, 1:],
            texts=texts[:, 1:],
            unreadable=unreadable[:, 1:],
            lines=lines[1:],
            remark=f"{shown} is taken for the names of the columns, not for a sample",
        )
    if keys.skip_lines is None:
        raise QuestionError(
            f"{shown} can be the names of the columns (--skip-lines {lines[0]}) or the first "
            f"sample (--skip-lines {lines[0] - 1}); choose one"
        )
    return table


def _counts_columns(cells: Sequence[str]) -> bool:
    """Return whether cells count from 0 or 1; the first may be empty, above the index of pandas."""
    numbers = cells[1:] if not cells[0] else cells
    if len(numbers) < 2 or not all(cell.isdecimal() and len(cell) < 4 for cell in numbers):
        return False
    first = int(numbers[0])
    return first in (0, 1) and list(map(int, numbers)) == list(range(first, first + len(numbers)))


def is_far(values: np.ndarray) -> np.ndarray:
    """Return for each row (S,) whether its first reading is far from all others.

    Parameters
    ----------
    values : (S, K) array
        Readings; NaN where a sample is missing.
    """
    return np.array([_first_is_far(row[0], row[1:][~np.isnan(row[1:])]) for row in values])


def _first_is_far(first: float, others: np.ndarray) -> bool:
    low, high = others.min(initial=np.inf), others.max(initial=-np.inf)
    return bool(others.size and abs(first - (low + high) / 2) > 1.5 * (high - low))
