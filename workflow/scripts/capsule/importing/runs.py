"""Make recordings from a laboratory's tables, and record how each column was read."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.columns import NO_TIME, choose_columns
from capsule.importing.resampling import DEGREE, STOP_DB, resample, usual_rate
from capsule.importing.table import Table, is_far
from capsule.importing.times import Clock, later, read_time
from capsule.importing.units import WRITTEN, reading_unit
from capsule.recording import Recording

# Keys of a file's own header lines that the recording keeps.
_KNOWN_NOTES = ("adc_bits", "vref_v", "series_ohm", "site", "session", "setup")
_ELECTRONICS = {"adc_bits": "g", "vref_v": "g", "series_ohm": ".6f"}
_MILLI_DIGITS = 9
_MOST_RUNS = 1000
# A longer gap is named.
_LONG_GAP_S = 60.0
# Time stamps that differ by less than this many intervals are the same time.
_SAME_INSTANT = 0.1


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
    """The columns, the time and the unit of the readings that were found in a table.

    Attributes
    ----------
    table : Table
        The table.
    time, run : int or None
        Index of the column of the time, and of the one that names the run; None if there is none.
    sensors : tuple of S int
        Indices of the sensors' columns.
    clock : Clock
        The time of each sample.
    unit, unit_reason : str
        Unit of the readings, as lab.yaml names it, and the reason for it.
    """

    table: Table
    time: int | None
    run: int | None
    sensors: tuple[int, ...]
    clock: Clock
    unit: str
    unit_reason: str


@dataclass(frozen=True)
class Run:
    """A run of a file.

    Attributes
    ----------
    label : str
        Name of the run within the file; empty if the file holds one run.
    recording : Recording
        The run's samples, and its header lines except those on its origin.
    remarks : sequence of str
        Notes for the user.
    """

    label: str
    recording: Recording
    remarks: Sequence[str] = ()


def guess_table(table: Table, keys: SimpleNamespace, bench: Bench) -> Guess:
    """Return how to read the columns of a table.

    Parameters
    ----------
    table : Table
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
    time, sensors, run = choose_columns(table, keys, bench.sensors)
    clock = read_time(table, time, keys, bench.rate_hz)
    unit, reason = reading_unit(table, sensors, keys, bench.full_scale)
    return Guess(table, time, run, sensors, clock, unit, reason)


def readings(guess: Guess) -> tuple[np.ndarray, int]:
    """Return readings (S, K) in the recording's unit, and the number of incomplete samples.

    If one sensor of a sample is missing, the whole sample counts as missing.
    """
    _, factor = WRITTEN[guess.unit]
    values = np.array([guess.table.all_numbers(index) for index in guess.sensors])
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
        header = _header(guess, keys, float(time_s[0]))
        remarks = [guess.table.remark] if guess.table.remark else []
        remarks += _striking(guess, header, time_s, values[:, rows], keys)
        if partly:
            remarks.append(f"{partly} samples lack a sensor and count as missing")
        try:
            recording = _recording(time_s, values[:, rows], header, bench)
        except CapsuleError as fault:
            raise CapsuleError(f"run {label}: {fault}" if label else str(fault)) from None
        runs.append(Run(label, recording, remarks))
    return runs


def _striking(
    guess: Guess,
    header: Mapping[str, str],
    time_s: np.ndarray,
    values: np.ndarray,
    keys: SimpleNamespace,
) -> Iterator[str]:
    """Yield notes on a start that is no date, and on a first sample or a gap that looks wrong."""
    if guess.clock.started and "started" not in header:
        yield (
            f"the file says that it began {guess.clock.started[:60]!r}, which is no date such as "
            "2026-03-04T12:00:00, so the header names none"
        )
    if values.shape[1] > 2 and is_far(values).all():
        shown = ", ".join(f"{value:g}" for value in values[:, 0])
        yield (
            f"the first sample, {shown}, is far from all others; if it is none, leave it out with "
            "--skip-lines"
        )
    for number, row in enumerate(values if values.shape[1] > 2 else (), start=1):
        if np.all(np.diff(row) > 0):
            yield f"sensor_{number} rises from each sample to the next, as a time does"
    steps = np.diff(time_s)
    longest = int(np.argmax(steps)) if steps.size else 0
    if steps.size and steps[longest] >= _LONG_GAP_S and not keys.run_gap_s:
        yield (
            f"a gap of {steps[longest] / 60:.3g} min follows sample {longest + 1}; if another run "
            "begins behind it, give --run-gap-s"
        )


def _split(guess: Guess, keys: SimpleNamespace) -> list[tuple[str, slice]]:
    """Return name and rows of each run, split by the run column, then by gaps."""
    table, index, time_s = guess.table, guess.run, guess.clock.time_s
    parts = [("", slice(0, time_s.size))]
    if index is not None:
        cells = table.numbers[index] if table.texts is None else table.texts[index]
        texts = [cell if isinstance(cell, str) else f"{cell:g}" for cell in cells]
        names = np.array(texts, dtype=object)
        parts = [(str(names[each.start]), each) for each in _slices(names[1:] != names[:-1])]
    if keys.run_gap_s:
        steps = np.diff(time_s)
        # A clock that starts again begins another run, too.
        breaks = (steps > keys.run_gap_s) | (steps < 0)
        parts = [
            (f"{name} {n}".strip(), slice(rows.start + part.start, rows.start + part.stop))
            for name, rows in parts
            for n, part in enumerate(_slices(breaks[rows.start : rows.stop - 1]), start=1)
        ]
    if len(parts) > _MOST_RUNS:
        raise CapsuleError(
            f"{'run_gap_s' if keys.run_gap_s else 'run_column'} splits the table into "
            f"{len(parts)} runs, more than {_MOST_RUNS}; choose another value"
        )
    if len(parts) == 1:
        return [("", parts[0][1])]
    labels = [label for label, _ in parts]
    return [
        (f"{label} {labels[:at].count(label) + 1}" if labels.count(label) > 1 else label, rows)
        for at, (label, rows) in enumerate(parts)
    ]


def _slices(breaks: np.ndarray) -> list[slice]:
    """Return the rows of each part; ``breaks[k]`` is whether a part begins at row k + 1."""
    starts = [0, *(np.flatnonzero(breaks) + 1).tolist()]
    return [slice(a, b) for a, b in zip(starts, [*starts[1:], len(breaks) + 1], strict=True)]


def joined_run(guesses: Sequence[Guess], keys: SimpleNamespace, bench: Bench) -> Run:
    """Return one run from the files of the sensors.

    Parameters
    ----------
    guesses : sequence of S Guess
        One table per sensor, in the order of the sensors.
    keys : SimpleNamespace
        The keys of lab.yaml.
    bench : Bench
        The configured values.

    Raises
    ------
    CapsuleError
        If the files have different units, or do not overlap in time.
    """
    units = {guess.unit for guess in guesses}
    if len(units) > 1:
        raise CapsuleError(
            f"the sensors' files have different units, {' and '.join(sorted(units))}; "
            "give one with --unit"
        )
    times = [guess.clock.first_s + guess.clock.time_s for guess in guesses]
    rows = [readings(guess)[0][0] for guess in guesses]
    rates = [usual_rate(time_s) for time_s in times]
    start, end = max(time_s[0] for time_s in times), min(time_s[-1] for time_s in times)
    if end <= start:
        raise CapsuleError(
            f"the sensors' files have no time in common: the last one begins at {start:g} s, the "
            f"first one ends at {end:g} s of their clocks; give files of one run"
        )
    header = _header(guesses[0], keys, float(start - times[0][0]))
    remarks = [guess.table.remark for guess in guesses if guess.table.remark]
    first = times[0]
    if all(
        time_s.size == first.size and np.abs(time_s - first).max() <= _SAME_INSTANT / rates[0]
        for time_s in times
    ):
        return Run("", _recording(first, _whole(rows), header, bench), remarks)
    parts = []
    for time_s, row in zip(times, rows, strict=True):
        inside = time_s <= end + 0.5 / bench.rate_hz
        parts.append(resample(time_s[inside], row[None, inside], bench.rate_hz, float(start))[1][0])
    values = _whole([part[: min(map(len, parts))] for part in parts])
    header["import_resampled"] = (
        f"from {', '.join(f'{rate:.4g}' for rate in rates)} Hz to {bench.rate_hz:g} Hz and to the "
        "same instants"
    )
    time_s = np.arange(values.shape[1]) / bench.rate_hz
    return Run("", _recording(time_s, values, header, bench), remarks)


def _whole(rows: Sequence[np.ndarray]) -> np.ndarray:
    """Return readings (S, K); if one sensor of a sample is missing, the whole sample is."""
    values = np.array(rows)
    values[:, np.isnan(values).any(axis=0)] = np.nan
    return values


def _header(guess: Guess, keys: SimpleNamespace, first_s: float) -> dict[str, str]:
    """Return the header of a run: the file's own header lines, overridden by lab.yaml."""
    notes = guess.table.notes
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
    header["unit"] = WRITTEN[guess.unit][0]
    started = later(guess.clock.started, first_s) or notes.get("started", "")
    return header | ({"started": started} if started else {})


def _recording(
    time_s: np.ndarray, values: np.ndarray, header: Mapping[str, str], bench: Bench
) -> Recording:
    """Return samples (K,) and (S, K) as a recording at the configured rate."""
    rate_hz, header = usual_rate(time_s), dict(header)
    if abs(rate_hz - bench.rate_hz) > bench.rate_tolerance * bench.rate_hz:
        time_s, values = resample(time_s, values, bench.rate_hz)
        how = (
            f"finite impulse response low-pass, -{STOP_DB:g} dB from {bench.rate_hz / 2:g} Hz on"
            if rate_hz > bench.rate_hz
            else f"spline of degree {DEGREE}"
        )
        header["import_resampled"] = f"from {rate_hz:.4g} Hz to {bench.rate_hz:g} Hz, {how}"
    return Recording(np.round(time_s - time_s[0], 9), values, header)


def as_map(guess: Guess, keys: SimpleNamespace) -> dict[str, object]:
    """Return how a table was read as keys of lab.yaml, so that nothing is left to guess."""
    table, clock = guess.table, guess.clock
    said = {key: value for key, value in vars(keys).items() if value is not None}
    if keys.per_sensor:
        return said
    content: dict[str, object] = {key: text for key, text in table.reading.items() if text}
    content["time"] = NO_TIME if guess.time is None else _column_key(table, guess.time)
    if guess.time is not None:
        content["time_unit"] = clock.unit
    if clock.date_order:
        content["date_order"] = clock.date_order
    content["sensors"] = [_column_key(table, index) for index in guess.sensors]
    return said | content | {"unit": guess.unit}


def _column_key(table: Table, index: int) -> str | int:
    """Return a column's name in lab.yaml, or its number if the name is missing or not unique."""
    name = table.names[index]
    return name if name and table.names.count(name) == 1 and not name.isdecimal() else index + 1
