"""Make recordings from a laboratory's table, and record how each column was read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.clock_readings import Clock, read_time
from capsule.importing.column_choice import NO_TIME, Choice, choose_columns
from capsule.importing.dates import later
from capsule.importing.number_head import is_far
from capsule.importing.reading_units import WRITTEN, ReadingUnit, reading_unit
from capsule.importing.resampling import DEGREE, STOP_DB, resample, usual_rate
from capsule.importing.run_splitting import runs_by_gap, runs_by_value
from capsule.importing.source_table import SourceTable
from capsule.recording import Recording

# Keys of a file's own header lines that the recording keeps.
_KNOWN_NOTES = ("adc_bits", "vref_v", "series_ohm", "site", "session", "setup")
_ELECTRONICS = {"adc_bits": "g", "vref_v": "g", "series_ohm": ".6f"}
_MILLI_DIGITS = 9
# A longer gap is named.
_LONG_GAP_S = 60.0


@dataclass(frozen=True)
class Bench:
    """The configuration's keys about recordings.

    Attributes
    ----------
    sensors : int
        Number of sensors S.
    rate_hz, rate_tolerance : float
        Sampling rate, and the largest relative deviation from it.
    full_scale : float
        Reading of the configured converter at the supply voltage.
    """

    sensors: int
    rate_hz: float
    rate_tolerance: float
    full_scale: float


@dataclass(frozen=True)
class Guess:
    """The columns, the time and the unit of the readings that were found in a table."""

    table: SourceTable
    choice: Choice
    clock: Clock
    unit: ReadingUnit


@dataclass(frozen=True)
class Run:
    """A run of a file.

    Attributes
    ----------
    label : str
        Name of the run within the file; empty if the file holds one run.
    recording : Recording
        The run's samples, and its header lines except those on its origin.
    remarks : tuple of str
        Notes for the user.
    """

    label: str
    recording: Recording
    remarks: tuple[str, ...]


def guess_table(table: SourceTable, keys: SimpleNamespace, bench: Bench) -> Guess:
    """Return how to read the columns of a table.

    Parameters
    ----------
    table : SourceTable
        The table.
    keys : SimpleNamespace
        The keys of lab.yaml.
    bench : Bench
        The configured values.

    Raises
    ------
    CapsuleError
        If the columns, the time or the unit are unknown or ambiguous.
    """
    choice = choose_columns(table, keys, bench.sensors)
    clock = read_time(table, choice.time, keys, bench.rate_hz)
    return Guess(table, choice, clock, reading_unit(table, choice.sensors, keys, bench.full_scale))


def readings(guess: Guess) -> tuple[np.ndarray, int]:
    """Return readings (S, K) in the recording's unit, and the number of incomplete samples.

    If one sensor of a sample is missing, the whole sample counts as missing.
    """
    _, factor = WRITTEN[guess.unit.unit]
    values = np.array([guess.table.numbers(index) for index in guess.choice.sensors])
    if factor != 1.0:
        values = np.round(values * factor, _MILLI_DIGITS)
    lacking = np.isnan(values)
    partly = lacking.any(axis=0) & ~lacking.all(axis=0)
    values[:, partly] = np.nan
    return values, int(np.count_nonzero(partly))


def runs_of(guess: Guess, keys: SimpleNamespace, bench: Bench) -> list[Run]:
    """Return the runs of a table as recordings.

    Parameters
    ----------
    guess : Guess
        How the table's columns are read.
    keys : SimpleNamespace
        The keys of lab.yaml.
    bench : Bench
        The configured values.

    Raises
    ------
    CapsuleError
        If time does not run forward, or the sampling rate is too low.
    """
    values, partly = readings(guess)
    runs = []
    for label, rows in _split(guess, keys):
        time_s = guess.clock.time_s[rows]
        started = later(guess.clock.started, float(time_s[0]))
        header = header_of(guess, keys, started)
        remarks = [guess.table.remark] if guess.table.remark else []
        if guess.clock.started and not started:
            remarks.append(
                f"the file says that it began {guess.clock.started[:60]!r}, which is no date such "
                "as 2026-03-04T12:00:00, so the header names none"
            )
        remarks += _striking(time_s, values[:, rows], keys)
        if partly:
            remarks.append(f"{partly} samples lack a sensor and count as missing")
        try:
            runs.append(make_run(label, time_s, values[:, rows], header, bench, remarks))
        except CapsuleError as fault:
            raise CapsuleError(f"run {label}: {fault}" if label else str(fault)) from None
    return runs


def _striking(time_s: np.ndarray, values: np.ndarray, keys: SimpleNamespace) -> list[str]:
    """Return notes on a first sample or a gap that may not belong to the run."""
    notes = []
    if values.shape[1] > 2 and is_far(values).all():
        shown = ", ".join(f"{value:g}" for value in values[:, 0])
        notes.append(
            f"the first sample, {shown}, is far from all others; if it is none, leave it out with "
            "--skip-lines"
        )
    steps = np.diff(time_s)
    longest = int(np.argmax(steps)) if steps.size else 0
    if steps.size and steps[longest] >= _LONG_GAP_S and not keys.run_gap_s:
        notes.append(
            f"a gap of {steps[longest] / 60:.3g} min follows sample {longest + 1}; if another run "
            "begins behind it, give --run-gap-s"
        )
    return notes


def _split(guess: Guess, keys: SimpleNamespace) -> list[tuple[str, slice]]:
    """Return name and rows of each run, split by the run column, then by gaps."""
    labelled = [("", slice(0, guess.clock.time_s.size))]
    if guess.choice.run is not None:
        column = guess.table.columns[guess.choice.run]
        texts = column.texts
        names = [f"{v:g}" for v in column.values] if texts is None else texts.tolist()
        labelled = runs_by_value(names)
    if keys.run_gap_s:
        labelled = [
            (f"{label} {number}".strip(), slice(rows.start + part.start, rows.start + part.stop))
            for label, rows in labelled
            for number, part in enumerate(
                runs_by_gap(guess.clock.time_s[rows], keys.run_gap_s), start=1
            )
        ]
    if len(labelled) == 1:
        return [("", labelled[0][1])]
    counts = [label for label, _ in labelled]
    return [
        (f"{label} {counts[:at].count(label) + 1}" if counts.count(label) > 1 else label, rows)
        for at, (label, rows) in enumerate(labelled)
    ]


def header_of(guess: Guess, keys: SimpleNamespace, started: str) -> dict[str, str]:
    """Return a run's header: the file's own header lines, overridden by lab.yaml."""
    notes: Mapping[str, str] = guess.table.notes
    own = "format_version" in notes
    header = {
        key: text
        for key, text in notes.items()
        if (own and key not in ("format_version", "rate_hz", "started")) or key in _KNOWN_NOTES
    }
    for key in ("source", "site", "session", "setup"):
        if text := getattr(keys, key):
            header[key] = text
    for key, form in _ELECTRONICS.items():
        if (number := getattr(keys, key)) is not None:
            text = format(number, form)
            header[key] = text.rstrip("0").rstrip(".") if "." in text else text
    header["unit"] = WRITTEN[guess.unit.unit][0]
    told = started or notes.get("started", "")
    return header | ({"started": told} if told else {})


def make_run(
    label: str,
    time_s: np.ndarray,
    values: np.ndarray,
    header: Mapping[str, str],
    bench: Bench,
    remarks: Sequence[str] = (),
) -> Run:
    """Return a run as a recording at the configured rate.

    Parameters
    ----------
    label : str
        Name of the run within the file.
    time_s : (K,) array
        Time of each sample in seconds.
    values : (S, K) array
        Readings; NaN where a sample is missing.
    header : mapping of str to str
        Header lines of the run.
    bench : Bench
        The configured values.
    remarks : sequence of str
        Notes for the user.
    """
    rate_hz = usual_rate(time_s)
    header = dict(header)
    if abs(rate_hz - bench.rate_hz) > bench.rate_tolerance * bench.rate_hz:
        time_s, values = resample(time_s, values, bench.rate_hz)
        how = (
            f"finite impulse response low-pass, -{STOP_DB:g} dB from {bench.rate_hz / 2:g} Hz on"
            if rate_hz > bench.rate_hz
            else f"spline of degree {DEGREE}"
        )
        header["import_resampled"] = f"from {rate_hz:.4g} Hz to {bench.rate_hz:g} Hz, {how}"
    return Run(label, Recording(np.round(time_s - time_s[0], 9), values, header), tuple(remarks))


def as_map(guess: Guess, keys: SimpleNamespace) -> dict[str, object]:
    """Return how a table was read as keys of lab.yaml, so that nothing is left to guess."""
    table, choice = guess.table, guess.choice
    content: dict[str, object] = {key: text for key, text in table.reading.items() if text}
    content["time"] = NO_TIME if choice.time is None else column_key(table, choice.time)
    if choice.time is not None:
        content["time_unit"] = guess.clock.unit
    if guess.clock.date_order:
        content["date_order"] = guess.clock.date_order
    content["sensors"] = [column_key(table, index) for index in choice.sensors]
    content["unit"] = guess.unit.unit
    said = {key: value for key, value in vars(keys).items() if value is not None}
    return said | content if not keys.per_sensor else said


def column_key(table: SourceTable, index: int) -> str | int:
    """Return a column's name in lab.yaml, or its number if the name is missing or not unique."""
    names = [column.name for column in table.columns]
    name = names[index]
    return name if name and names.count(name) == 1 and not name.isdecimal() else index + 1
