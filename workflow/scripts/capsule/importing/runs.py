"""Make recordings from a laboratory's tables, and record how each column was read."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.columns import choose_columns, reading_unit
from capsule.importing.joining import at_same_instants
from capsule.importing.lab_yaml import Keys
from capsule.importing.resampling import DEGREE, STOP_DB, resample, usual_rate
from capsule.importing.stated import scaling_remarks, starts, unsure_start
from capsule.importing.table import (
    Channel,
    QuestionError,
    Table,
    is_far,
    lone_runs,
    naming,
    without_first,
)
from capsule.importing.times import NO_TIME, Clock, later, read_time
from capsule.importing.units import WRITTEN
from capsule.recordings.names import displayed
from capsule.recordings.recording import Recording

# Header lines that the recording keeps from its file, or takes from lab.yaml.
_KEPT = ("site", "session", "setup", "adc_bits", "vref_v", "series_ohm")
_MILLI_DIGITS = 9
_MOST_RUNS = 1000
# Readings far from their neighbours that are named, and scalings that are quoted.
_MOST_LONE = _MOST_QUOTED = 5
# A longer gap is named.
_LONG_GAP_S = 60.0
# Characters of a header line that the import adds.
_LONGEST_ENTRY = 300


@dataclass(frozen=True)
class Reading:
    """How a table is read, and its samples.

    Attributes
    ----------
    table : Table
        The table; that of the first sensor, if each sensor has a file.
    time, run : int or None
        Index of the column of the time, and of the one that names the run; None if there is none.
    sensors : tuple of S int
        Indices of the sensors' columns.
    columns : tuple of S str
        Names of the sensors' columns.
    clock : Clock
        The time of each sample.
    unit, unit_reason : str
        Unit of the readings, as lab.yaml names it, and the reason for it.
    values : (S, K) array
        Readings in the unit of the recording; NaN where one is missing.
    resampled : str
        How the files of the sensors were brought to the same instants; empty if they were not.
    """

    table: Table
    time: int | None
    run: int | None
    sensors: tuple[int, ...]
    columns: tuple[str, ...]
    clock: Clock
    unit: str
    unit_reason: str
    values: np.ndarray
    resampled: str = ""


def read_columns(table: Table, keys: Keys) -> Reading:
    """Return how to read the columns of a table, and the samples in it.

    Raises
    ------
    CapsuleError
        If the columns, the time or the unit are unknown or ambiguous.
    """
    questions = list[str]()
    time, sensors, run = choose_columns(table, keys, questions)
    table = without_first(table, sensors)
    _ask(table, time, sensors, questions, keys)
    channels = [table.channels[index] for index in sensors]
    _check_lengths(table, time, channels, keys)
    if time is None:
        clocks = [read_time(table, None, channel, keys) for channel in channels]
    else:
        clocks = [read_time(table, table.channels[time], channels[0], keys)] * len(channels)
    unit, reason = reading_unit(table, sensors, keys)
    rows = [table.checked_numbers(channel) for channel in channels]
    if (factor := WRITTEN[unit][1]) != 1.0:
        rows = [np.round(row * factor, _MILLI_DIGITS) for row in rows]
    clock, values, resampled = at_same_instants(clocks, rows, keys)
    if run is not None and table.channels[run].values.size != values.shape[1]:
        raise CapsuleError(
            f"run_column: {table.listed([run])} cannot split channels with times of their own; "
            "leave it out, or give --run-gap-s"
        )
    columns = tuple(map(table.column_label, channels))
    return Reading(table, time, run, sensors, columns, clock, unit, reason, values, resampled)


def _ask(
    table: Table, time: int | None, sensors: tuple[int, ...], questions: list[str], keys: Keys
) -> None:
    """Raise one question that names all that must be known of the columns, if anything is not."""

    def missing(read: Callable[[], object]) -> str:
        try:
            read()
        except QuestionError as question:
            return str(question)
        except CapsuleError:
            pass  # It is raised if nothing is asked.
        return ""

    if sensors and not any("--time" in each for each in questions):
        stamps = None if time is None else table.channels[time]
        questions.append(
            missing(lambda: read_time(table, stamps, table.channels[sensors[0]], keys))
        )
    # Of columns that can be sensors, each one may have a unit of its own.
    choices = [sensors] if len(sensors) == keys.sensor_count else [(index,) for index in sensors]
    units = [missing(partial(reading_unit, table, columns, keys)) for columns in choices]
    questions.append(units[0] if units and all(units) else "")
    if asked := list(filter(None, questions)):
        raise QuestionError("; and ".join(asked))


def _check_lengths(table: Table, time: int | None, channels: Sequence[Channel], keys: Keys) -> None:
    """Raise an error if columns differ by more than a sample, and no rate of each tells why."""
    is_told = all(each.rates_hz or each.stamps for each in channels)
    if is_told and time is None and not keys.rate:
        return
    used = [*channels] if time is None else [table.channels[time], *channels]
    used.sort(key=lambda channel: channel.values.size)
    shortest, longest = used[0], used[-1]
    if longest.values.size - shortest.values.size > 1:
        remedy = "export all with one rate"
        if is_told:
            remedy = "the file states a rate of each: use --time none, without --rate"
        raise CapsuleError(
            f"column {table.column_label(shortest)} has {shortest.values.size} samples, but "
            f"{table.column_label(longest)} has {longest.values.size}; {remedy}"
        )


def joined(readings: Sequence[Reading], keys: Keys) -> Reading:
    """Return one reading from those of S files, one for each sensor, in the sensors' order.

    Raises
    ------
    CapsuleError
        If the files have different units, or do not overlap in time.
    """
    columns, units = tuple(each.columns[0] for each in readings), {each.unit for each in readings}
    if len(units) > 1:
        raise CapsuleError(
            f"the sensors' files have different units, {' and '.join(sorted(units))}; "
            "give one with --unit"
        )
    clocks = list(map(_told_clock, readings))
    unsure = [unsure_start(each.table.remarks) for each in readings]
    if not any(each.started or each.first_s for each in clocks) and len({*unsure}) > 1:
        clocks = [replace(each, started=text) for each, text in zip(clocks, unsure, strict=True)]
    clock, values, resampled = at_same_instants(clocks, [each.values[0] for each in readings], keys)
    if not any(each.started or each.first_s for each in clocks):
        begun = (
            "no file says when it began, so all are taken to begin at the same instant; if not, "
        )
        begun += "name it in the first line of each, as # started: 2026-03-04T12:00:02.5Z"
        clock = replace(clock, warnings=[*clock.warnings, begun])
    return replace(readings[0], columns=columns, clock=clock, values=values, resampled=resampled)


def _told_clock(reading: Reading) -> Clock:
    """Return the clock of a sensor's file, with the start that a line of it tells."""
    told, clock = starts(reading.table.notes), reading.clock
    first_s = clock.first_s + told.get("start_s", 0.0)
    return replace(clock, started=clock.started or told.get("started", ""), first_s=first_s)


def runs_of(
    reading: Reading, origin: dict[str, str], keys: Keys
) -> Iterator[tuple[str, Recording, list[str]]]:
    """Yield the runs of a table: name within the file, recording, and notes for the user.

    The name is empty if there is one run. `origin` holds the header lines on the file.

    Raises
    ------
    CapsuleError
        If time does not run forward, or the sampling rate is too low.
    """
    for label, rows in _split(reading, keys):
        time_s, values = reading.clock.time_s[rows], reading.values[:, rows]
        lacking = np.isnan(values)
        partly = lacking.any(axis=0) & ~lacking.all(axis=0)
        values = np.where(partly, np.nan, values)
        header = _header(reading, origin, keys, label, float(time_s[0]))
        remarks = list(_remarks(reading, rows.start, Recording(time_s, values, header), keys))
        if partly.any():
            remarks.append(f"{np.count_nonzero(partly)} samples lack a sensor and count as missing")
        with naming(f"run {displayed(label)}" if label else ""):
            rate_hz = usual_rate(time_s)
            if abs(rate_hz - keys.rate_hz) > keys.rate_tolerance * keys.rate_hz:
                time_s, values = resample(time_s, values, keys.rate_hz)
                how = f"spline of degree {DEGREE}"
                if rate_hz > keys.rate_hz:
                    how = "finite impulse response low-pass, "
                    how += f"-{STOP_DB:g} dB from {keys.rate_hz / 2:g} Hz on"
                header["import_resampled"] = f"from {rate_hz:.4g} Hz to {keys.rate_hz:g} Hz, {how}"
        yield label, Recording(np.round(time_s - time_s[0], 9), values, header), remarks


def _remarks(reading: Reading, first: int, run: Recording, keys: Keys) -> Iterator[str]:
    """Yield notes for the user, such as on a first sample or a gap that looks wrong.

    The run begins at the reading's sample of index `first`.
    """
    header, values = run.header, run.values
    table = reading.table
    yield from [*table.warnings, *reading.clock.warnings]
    if told := "; ".join(scaling_remarks(table.remarks)[:_MOST_QUOTED]):
        yield f"the file says {told}; that is not applied to the readings"
    if reading.clock.started and "started" not in header:
        yield (
            f"the file says that it began {reading.clock.started[:60]!r}, which is no date such as "
            "2026-03-04T12:00:00, so the header names none"
        )
    steps = np.diff(run.time_s)
    if steps.size > 1:
        if is_far(values).all():
            shown = ", ".join(f"{value:g}" for value in values[:, 0])
            yield (
                f"the first sample, {shown}, is far from all others; if it is none, leave it out "
                "with --skip-lines"
            )
        for sensor in np.flatnonzero(np.all(np.diff(values) > 0, axis=1)):
            yield f"sensor_{sensor + 1} rises from each sample to the next, as a time does"
    if steps.size > 2 and steps[0] > 2 * np.median(steps) and reading.table.lines is not None:
        yield (
            f"{steps[0]:g} s lie between the first two samples; if the first line lacks digits, "
            f"leave it out with --skip-lines {reading.table.lines[first]}"
        )
    if steps.max(initial=0) >= _LONG_GAP_S and not keys.run_gap_s:
        yield (
            f"a gap of {steps.max() / 60:.3g} min follows sample {np.argmax(steps) + 1}; if "
            "another run begins behind it, give --run-gap-s"
        )
    for lone, begin, end in lone_runs(values)[:_MOST_LONE]:
        places = " and ".join(table.line(first + row) for row in range(begin, end))
        here = " and ".join(f"{each:g}" for each in values[lone, begin:end])
        sides = [f"{each:g} before" for each in values[lone, begin - 1 : begin]]
        sides += [f"{each:g} after" for each in values[lone, end : end + 1]]
        yield (
            f"{places}: {here} of sensor_{lone + 1} is far from {' and '.join(sides)} it; if "
            "digits were lost, correct the line"
        )
    highest = np.nanmax(values, initial=0.0)
    if header["unit"] == "V" and "vref_v" not in header:
        yield "the supply voltage is unknown, so volts are judged as they are; use --vref-v"
    if header["unit"] == "counts" and "adc_bits" not in header and highest >= keys.full_scale:
        yield (
            f"readings reach {highest:g}, but diagonal.full_scale is {keys.full_scale:g}; use "
            "--adc-bits"
        )


def _split(reading: Reading, keys: Keys) -> Iterator[tuple[str, slice]]:
    """Yield name and rows of each run, split by the run column, then by gaps."""
    steps = np.diff(reading.clock.time_s)
    names = np.full(steps.size + 1, "", dtype=object)
    if reading.run is not None:
        names[:] = reading.table.channels[reading.run].texts()
    renamed = names[1:] != names[:-1]
    # A clock or a board that starts again begins another run, too.
    breaks = renamed | (((steps > keys.run_gap_s) | (steps < 0)) if keys.run_gap_s else False)
    if keys.run_gap_s:
        breaks[[row - 1 for row in reading.table.restarts if 0 < row <= breaks.size]] = True
    starts = [0, *(np.flatnonzero(breaks) + 1).tolist()]
    if len(starts) > _MOST_RUNS:
        raise CapsuleError(
            f"{'run_gap_s' if keys.run_gap_s else 'run_column'} splits the table into "
            f"{len(starts)} runs, more than {_MOST_RUNS}; choose another value"
        )
    labels, seen = names[starts].tolist() if len(starts) > 1 else [""], Counter[str]()
    for label, rows in zip(labels, map(slice, starts, [*starts[1:], names.size]), strict=True):
        seen[label] += 1
        is_numbered = labels.count(label) > 1 or (keys.run_gap_s and len(labels) > 1)
        yield f"{label} {seen[label]}".strip() if is_numbered else label, rows


def _header(
    reading: Reading, origin: dict[str, str], keys: Keys, label: str, first_s: float
) -> dict[str, str]:
    """Return the header of a run: how it was read; the file's header lines, or else lab.yaml's."""
    table, clock, notes = reading.table, reading.clock, reading.table.notes
    columns = {"time": "none" if reading.time is None else table.listed([reading.time])}
    columns |= {f"sensor_{number}": name for number, name in enumerate(reading.columns, start=1)}
    said = origin | {
        f"import_{table.kind}": table.label if table.kind else "",
        "import_run": label,
        "import_columns": "; ".join(f"{key} = {name}" for key, name in columns.items()),
        "import_time": f"{clock.unit}, {clock.reason}",
        "import_unit": f"{reading.unit}, {reading.unit_reason}",
        "import_passed_over": table.losses,
        "import_resampled": reading.resampled,
    }
    header = {key: displayed(text)[:_LONGEST_ENTRY] for key, text in said.items() if text}
    # A recording of this project keeps all of its lines.
    own = notes.keys() - {"format_version", "rate_hz", "started"}
    kept = own if "format_version" in notes else set(_KEPT)
    header |= {key: text for key, text in notes.items() if key in kept}
    for key in ("source", *_KEPT):
        if (value := getattr(keys, key)) is not None:
            header[key] = value if isinstance(value, str) else f"{value:.12g}"
    header["unit"] = WRITTEN[reading.unit][0]
    if started := later(clock.started, first_s) or notes.get("started", ""):
        header["started"] = started
    return header


def as_map(reading: Reading, keys: Keys) -> dict[str, object]:
    """Return how a table was read as keys of lab.yaml, so that nothing is left to guess."""
    table, clock = reading.table, reading.clock
    content = dict(table.reading) | {
        "time": NO_TIME if reading.time is None else _column_key(table, reading.time),
        "time_unit": "" if reading.time is None else clock.unit,
        "date_order": clock.date_order,
        "sensors": [_column_key(table, index) for index in reading.sensors],
        "unit": reading.unit,
    }
    return dict(keys.given) | {key: value for key, value in content.items() if value}


def _column_key(table: Table, index: int) -> str | int:
    """Return a column's name in lab.yaml, or its number if the name is missing or not unique."""
    name = table.names[index]
    return name if name and table.names.count(name) == 1 and not name.isdecimal() else index + 1
