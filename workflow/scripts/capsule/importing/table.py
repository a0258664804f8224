"""Represent the tables of a laboratory's file, and choose those that are runs."""

import contextlib
import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.stated import UNSURE_RATE
from capsule.recordings.recording import LARGEST_NUMBER

_NAMED_AT_MOST = 20
# Readings far from their neighbours: samples, readings in a row, the share of steps in % that are
# usual, and how many times these the others are.
_LEAST_LONE, _LONGEST_LONE, _USUAL_STEPS, _LONE_STEPS = 50, 5, 95, 4.0


@contextlib.contextmanager
def naming(place: str) -> Iterator[None]:
    """Put the place of an error in front of its message; none if it is empty."""
    try:
        yield
    except CapsuleError as fault:
        if place:
            fault.args = (f"{place}: {fault}",)
        raise


class QuestionError(CapsuleError):
    """The error of a file that can be read in several ways; its text names the deciding options.

    Parameters
    ----------
    text : str
        The question.
    answers : sequence of mappings
        Keys of lab.yaml that answer it, each with its value, as far as they are known. Behind an
        answer, more can be asked.
    """

    def __init__(self, text: str, answers: Sequence[Mapping[str, str]] = ()) -> None:
        super().__init__(text)
        self.answers = answers

    @property
    def subject(self) -> str:
        """The text without its numbers, dates and times, the same for files of one kind."""
        return re.sub(r"(?<![A-Za-z_])[+-]?[0-9][0-9.,:/e+-]*", "0", str(self))


@dataclass(frozen=True, eq=False)
class Channel:
    """A column of a file: its samples, and what the file says of it alone.

    Attributes
    ----------
    name, unit : str
        Name and unit in the file; empty if there is none.
    values : (K,) array of float
        Samples, NaN where one is missing or a cell is not a number.
    words : sequence of K str
        The text of the cells that are not a number, empty for all others; empty if all are numbers.
    stamps : Channel or None
        The times of its samples, if it has its own.
    started : str
        Date and time of the first sample; empty if unknown.
    start_s : float or None
        Time of the first sample by the file's clock; None if unknown.
    rates_hz : mapping of str to float
        Sampling rates that the file states, by their names in it.
    """

    name: str
    values: np.ndarray
    unit: str = ""
    words: Sequence[str] = ()
    stamps: "Channel | None" = None
    started: str = ""
    start_s: float | None = None
    rates_hz: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that each sample has its time; in a damaged file, it may have none."""
        if self.stamps and self.stamps.values.shape != self.values.shape:
            raise ValueError(f"{self.values.size} samples have {self.stamps.values.size} times")

    @property
    def rate_hz(self) -> float | None:
        """The sampling rate that the file states; None for none, several, or another frequency."""
        is_sure = self.sure_rates_hz and len({*self.rates_hz.values()}) == 1
        return self.sure_rates_hz[0] if is_sure else None

    @property
    def sure_rates_hz(self) -> list[float]:
        """The sampling rates that the file states under a name that no other frequency has."""
        return [rate for name, rate in self.rates_hz.items() if not UNSURE_RATE.fullmatch(name)]

    @property
    def holds_numbers(self) -> bool:
        """Whether most of the filled cells are numbers."""
        return bool(np.count_nonzero(~np.isnan(self.values)) > sum(map(bool, self.words)))

    def texts(self, most: int | None = None) -> list[str]:
        """Return the first cells as text, or all; a missing sample is empty."""
        numbers = self.values[:most].tolist()
        return [
            word or ("" if np.isnan(number) else f"{number:.15g}")
            for number, word in zip(numbers, self.words or [""] * len(numbers), strict=False)
        ]

    def without_first(self) -> "Channel":
        """Return the channel without its first sample."""
        return replace(self, values=self.values[1:], words=self.words[1:])


@dataclass(frozen=True)
class Table:
    """A table of a file: a sheet, a variable, a group, a stream, or the whole of a text file.

    Attributes
    ----------
    channels : sequence of C Channel
        The columns.
    kind : str
        Word for a table of this format, and key of lab.yaml that chooses one: ``sheet`` or
        ``variable``; empty if a file holds one table.
    label : str
        The table's name.
    lines : (K,) array of int, or None
        Number of each row's line or row in the file.
    notes : mapping of str to str
        ``key: value`` lines of the file.
    reading : mapping of str to str
        How the file was read, as keys of lab.yaml: encoding, delimiter, decimal, thousands.
    passed_over : sequence of int
        Numbers of the lines without a whole sample.
    restarts : sequence of int
        Indices of the rows above which the names of the columns are repeated.
    warnings : sequence of str
        Notes for the user.
    remarks : sequence of str
        What the file says beside the samples, in words; also its notes, as they stand in it.
    """

    channels: Sequence[Channel]
    kind: str = ""
    label: str = ""
    lines: np.ndarray | None = None
    notes: Mapping[str, str] = field(default_factory=dict)
    reading: Mapping[str, str] = field(default_factory=dict)
    passed_over: Sequence[int] = ()
    restarts: Sequence[int] = ()
    warnings: Sequence[str] = ()
    remarks: Sequence[str] = ()

    @property
    def names(self) -> list[str]:
        """The name of each column."""
        return [channel.name for channel in self.channels]

    @property
    def place(self) -> str:
        """The table's place in its file, for a message; empty if the file holds one table."""
        return f"{self.kind} {self.label!r}" if self.kind else ""

    @property
    def losses(self) -> str:
        """How many lines were passed over, in words; empty if none was."""
        return f"{len(self.passed_over)} lines without a whole sample" if self.passed_over else ""

    def line(self, row: int) -> str:
        """Return the place of a row, for a message."""
        word = "row" if self.kind == "sheet" else "line"
        return f"sample {row + 1}" if self.lines is None else f"{word} {self.lines[row]}"

    def column_label(self, channel: Channel) -> str:
        """Return a column's name, or its number if it has no name."""
        return repr(channel.name) if channel.name else f"{self.channels.index(channel) + 1}"

    def listed(self, indices: Iterable[int]) -> str:
        """Return a list of columns in words."""
        return _listed([self.column_label(self.channels[index]) for index in indices])

    def checked_numbers(self, channel: Channel) -> np.ndarray:
        """Return a column's numbers (K,); NaN where a sample is missing.

        Raises
        ------
        CapsuleError
            If a cell holds something else; the message names its place.
        """
        column, numbers = f"column {self.column_label(channel)}", channel.values
        for row in [row for row, word in enumerate(channel.words) if word][:1]:
            raise CapsuleError(f"{self.line(row)}, {column}: {not_a_number(channel.words[row])}")
        for row in np.flatnonzero(np.abs(numbers) > LARGEST_NUMBER)[:1]:
            raise CapsuleError(
                f"{self.line(row)}, {column}: {numbers[row]:g} is too large for a reading or a "
                "time; name another column"
            )
        return numbers


def not_a_number(word: str) -> str:
    """Return what is wrong with a cell that is no number, and what helps."""
    return (
        f"{word[:60]!r} is not a number; if it marks a missing sample, name it with --missing; if "
        "the table ends above it, delete what follows"
    )


def choose_tables(tables: Sequence[Table], keys: Keys) -> list[Table]:
    """Return the tables of a file that are runs: the named one, all, or the only one that fits.

    Raises
    ------
    CapsuleError
        If the named table does not exist, or several tables fit.
    """
    kind, labels = tables[0].kind, [table.label for table in tables]
    for key, name in (("sheet", keys.sheet), ("variable", keys.variable)):
        if name and key != kind:
            raise CapsuleError(
                f"{key}: {name!r} is given, but the file holds "
                f"{f'{kind}s' if kind else 'one table'}; leave it out"
            )
    if not kind:
        return list(tables)
    held = f"the file holds {_listed([repr(label) for label in labels])}"
    wanted = keys.sheet or keys.variable
    if wanted and wanted != "all":
        if matching := [table for table in tables if table.label == wanted]:
            return matching
        near = difflib.get_close_matches(wanted, labels, n=1)
        hint = f"did you mean {near[0]!r}?" if near else held
        raise CapsuleError(f"{kind}: there is no {wanted!r}; {hint}")
    counts = [sum(each.holds_numbers for each in table.channels) for table in tables]
    fitting = [table for table, n in zip(tables, counts, strict=True) if n >= keys.sensor_count]
    if not fitting:
        # Each stream, group or series may hold one sensor, with a time of its own.
        timed = [[each for each in table.channels if _is_timed(each)] for table in tables]
        channels = [each for part in timed for each in part]
        if all(timed) and len(channels) >= keys.sensor_count:
            return [replace(tables[0], channels=with_stamps(channels), label=", ".join(labels))]
        as_text = "; if its numbers are stored as text, save it as CSV, and import that"
        raise CapsuleError(
            f"no {kind} holds {keys.sensor_count} columns of numbers; {held}"
            f"{as_text if kind == 'sheet' else ''}"
        )
    if len(fitting) > 1 and wanted != "all":
        raise QuestionError(
            f"{len(fitting)} of its parts can be the recording: "
            f"{_listed([repr(table.label) for table in fitting])}; name one with --{kind}, or use "
            f"--{kind} all if each one is a run",
            [{kind: "all"}],
        )
    return fitting


def _is_timed(channel: Channel) -> bool:
    return bool(channel.stamps or channel.rates_hz or channel.start_s is not None)


def with_stamps(channels: Sequence[Channel]) -> list[Channel]:
    """Return channels, below the column of their time stamps if all have the same ones."""
    stamps = [each.stamps for each in channels]
    first = stamps[0]
    if first is None or not all(
        each is not None and np.array_equal(each.values, first.values) for each in stamps
    ):
        return [*channels]
    return [first, *channels]


def _listed(labels: Sequence[str]) -> str:
    more = len(labels) - _NAMED_AT_MOST
    return ", ".join(labels[:_NAMED_AT_MOST]) + (f" and {more} more" if more > 0 else "")


def is_far(values: np.ndarray) -> np.ndarray:
    """Return for each row (S,) whether its first reading is far from all others.

    The readings (S, K) are of more than one sample; NaN where a sample is missing.
    """
    # Unlike nanmin and nanmax, these do not warn of a row without a reading.
    low, high = np.fmin.reduce(values[:, 1:], axis=1), np.fmax.reduce(values[:, 1:], axis=1)
    return np.asarray(np.abs(values[:, 0] - (low + high) / 2) > 1.5 * (high - low))


def lone_runs(values: np.ndarray) -> list[tuple[int, int, int]]:
    """Return the runs of some readings (S, K) that are far from those before and behind them.

    A run is its sensor, its first index and the one behind its last. The readings of a run are less
    than half or more than twice of both neighbours, as numbers with a digit too few or too many
    are, and hardly another step of their sensor is as large.
    """
    sensors, samples = values.shape
    found: list[tuple[int, int, int]] = []
    if samples < _LEAST_LONE:
        return found
    usual = np.percentile(np.nan_to_num(np.abs(np.diff(values))), _USUAL_STEPS, axis=1)[:, None]
    is_known = np.zeros(values.shape, dtype=bool)
    for length in range(1, _LONGEST_LONE + 1):
        # Before the first reading and behind the last one, the other neighbour counts again.
        edge = np.full((sensors, 1), np.nan)
        before = np.hstack([edge, values[:, :-length]])
        after = np.hstack([values[:, length:], edge])
        low, high = np.fmin(np.abs(before), np.abs(after)), np.fmax(np.abs(before), np.abs(after))
        is_run = high < 2 * low
        for at in range(length):
            here = values[:, at : samples - length + 1 + at]
            jump = np.fmin(np.abs(here - before), np.abs(here - after))
            is_far_off = (2 * np.abs(here) < low) | (np.abs(here) > 2 * high)
            is_run &= is_far_off & (jump > _LONE_STEPS * usual)
            is_run &= ~is_known[:, at : samples - length + 1 + at]
        for sensor, first in np.argwhere(is_run).tolist():
            found.append((sensor, first, first + length))
            is_known[sensor, first : first + length] = True
    return sorted(found, key=lambda run: run[1])


def without_first(table: Table, sensors: Sequence[int]) -> Table:
    """Return a table of text without its first row if that is no sample, with a note.

    It counts the columns, as pandas and numpy do; or a reading is far from all others, and less
    than half of the next one: the line, or the file, lacks its beginning.
    """
    if table.lines is None or table.lines.size < _LEAST_LONE:
        return table
    values = np.array([table.channels[index].values for index in sensors])
    first = values[:, 0]
    counts = np.ptp(first - np.array(sensors)) == 0 and abs(first[0] - sensors[0]) <= 1
    is_cut = is_far(values) & (2 * np.abs(first) < np.abs(values[:, 1]))
    if not (counts or is_cut.any()):
        return table
    why = "it counts the columns" if counts else f"{first[is_cut][0]:g} is far from all others"
    shown = ", ".join(f"{value:g}" for value in first)
    return replace(
        table,
        channels=[channel.without_first() for channel in table.channels],
        lines=table.lines[1:],
        restarts=[row - 1 for row in table.restarts if row],
        warnings=[*table.warnings, f"{table.line(0)}, with {shown}, is passed over: {why}"],
    )
