"""Convert a column of times to seconds, and find its unit."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.dates import date_order, read_clock, read_dates, since_1970, text_kind
from capsule.importing.question import QuestionError
from capsule.importing.source_table import SourceTable
from capsule.importing.unit_names import TIME_UNITS, plain_unit, split_unit

_SECONDS = {
    "s": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "ns": 1e-9,
    "min": 60.0,
    "h": 3600.0,
    "day": 86_400.0,
}
# Units that are tried if none is named. Minutes and hours are not tried: users name them.
_TRIED = ("s", "ms", "us", "ns", "day")
# Plausible sampling rates: a wave of 3 s needs the lower one, and no sensor is faster than the
# upper one.
_PLAUSIBLE_HZ = (2.0, 4000.0)
# Sampling rates outside this range show that a named unit is wrong.
_POSSIBLE_HZ = (0.2, 100_000.0)
# Largest relative difference of rates that count as the same.
_SAME_RATE = 0.05
# Seconds since 1970 of the years 2000 and 2100.
_EPOCH_S = (946_684_800.0, 4_102_444_800.0)


@dataclass(frozen=True)
class Clock:
    """The time of each sample.

    Attributes
    ----------
    time_s : (K,) array
        Time in s; the first sample is at 0.
    unit : str
        Unit of the column, as lab.yaml names it; ``rate`` if there is no column.
    reason : str
        Reason for this unit.
    first_s : float
        Time of the first sample by the file's own clock, in s.
    started : str
        Date and time of the first sample, ISO 8601; empty if not known.
    date_order : str
        Order of day and month that the dates were read in; empty if it makes no difference.
    """

    time_s: np.ndarray
    unit: str
    reason: str
    first_s: float = 0.0
    started: str = ""
    date_order: str = ""


def read_time(
    table: SourceTable, index: int | None, keys: SimpleNamespace, configured_hz: float
) -> Clock:
    """Return the time of each sample.

    Parameters
    ----------
    table : SourceTable
        The table.
    index : int or None
        Index of the column of the time; None if there is none.
    keys : SimpleNamespace
        The keys of lab.yaml, of which ``time_unit``, ``rate`` and ``date_order`` are used.
    configured_hz : float
        Configured sampling rate.

    Raises
    ------
    CapsuleError
        If the time is not known, or several units fit.
    """
    rate = keys.rate or table.rate_hz
    if index is None:
        if rate is None:
            raise QuestionError(
                "no column gives the time; name one with --time, or give the sampling rate in Hz "
                "with --rate"
            )
        _check_none_between(table)
        count = table.columns[0].values.size
        told = "the option rate" if keys.rate else "the file"
        return Clock(np.arange(count) / rate, "rate", f"{rate:g} Hz by {told}", 0.0, table.started)
    column = table.columns[index]
    texts = column.texts if column.unreadable.size > 0.5 * column.values.size else None
    if texts is not None or keys.time_unit in ("date", "clock"):
        return _from_text(table, index, keys)
    numbers = table.numbers(index)
    empty = np.flatnonzero(np.isnan(numbers))
    if empty.size:
        raise CapsuleError(
            f"{table.line(int(empty[0]))}: the time is missing in column "
            f"{table.column_label(index)}; complete it, or use --time none and --rate"
        )
    if numbers.size < 2:
        raise CapsuleError("there are fewer than two samples; is the table cut off?")
    unit, reason = _unit(table, index, keys, configured_hz)
    if unit == "sample":
        if rate is None:
            raise QuestionError(
                f"column {table.column_label(index)} counts samples; give the sampling rate in Hz "
                "with --rate"
            )
        first_s = float(numbers[0] / rate)
        return Clock((numbers - numbers[0]) / rate, unit, reason, first_s, table.started)
    seconds = (numbers - numbers[0]) * _SECONDS[unit]
    first_s = float(numbers[0] * _SECONDS[unit])
    since = since_1970(first_s) if _EPOCH_S[0] < first_s < _EPOCH_S[1] and unit != "day" else ""
    return Clock(seconds, unit, reason, first_s, table.started or since)


def _check_none_between(table: SourceTable) -> None:
    """Raise an error for lines without a sample if only the row numbers give the time."""
    if table.lines is None:
        return
    first, last = int(table.lines[0]), int(table.lines[-1])
    between = [number for number in table.passed_over if first < number < last]
    if between:
        raise CapsuleError(
            f"line {between[0]} does not hold a whole sample, and no column gives the time, so a "
            "missing sample would shift all later ones; delete the line, or complete it"
        )


def _from_text(table: SourceTable, index: int, keys: SimpleNamespace) -> Clock:
    texts = table.columns[index].texts
    label = table.column_label(index)
    kind = "" if texts is None else text_kind(texts.tolist())
    asked = keys.time_unit
    if texts is None or not kind or (asked and asked != kind):
        shown = "a number" if texts is None else repr(str(texts[0])[:60])
        raise CapsuleError(
            f"{table.line(0)}, column {label}: {shown} is not a "
            f"{asked or 'time'}; name another column with --time, or use another --time-unit"
        )
    places = [f"{table.line(row)}, column {label}" for row in range(texts.size)]
    if kind == "clock":
        seconds = read_clock(texts.tolist(), places)
        return Clock(seconds - seconds[0], kind, "times of day", float(seconds[0]), table.started)
    order = keys.date_order or date_order(texts.tolist(), places)
    seconds, first_s, started = read_dates(texts.tolist(), order, places)
    return Clock(seconds, kind, "dates", first_s, started, order)


def _unit(
    table: SourceTable, index: int, keys: SimpleNamespace, configured_hz: float
) -> tuple[str, str]:
    """Return the unit of a column of numbers, and the reason."""
    numbers, label = table.columns[index].values, table.column_label(index)
    steps = np.diff(numbers)
    step = float(np.median(steps))
    if step <= 0:
        raise CapsuleError(
            f"column {label}: the time does not run forward; name another column with --time"
        )
    column = table.columns[index]
    bare, in_name = split_unit(column.name)
    named = TIME_UNITS.get(plain_unit(column.unit)) or TIME_UNITS.get(plain_unit(in_name))
    named = named or TIME_UNITS.get(bare.strip().lower())
    if told := keys.time_unit or named:
        reason = "given" if keys.time_unit else "named in the file"
        if told != "sample":
            _check_possible(told, step, label, reason)
        return told, reason
    fitting = {unit: 1.0 / (step * _SECONDS[unit]) for unit in _TRIED}
    known = keys.rate or table.rate_hz
    if known:
        fitting = {unit: hz for unit, hz in fitting.items() if abs(hz / known - 1) <= _SAME_RATE}
    else:
        low, high = _PLAUSIBLE_HZ
        fitting = {unit: hz for unit, hz in fitting.items() if low <= hz <= high}
    configured = [unit for unit, hz in fitting.items() if abs(hz / configured_hz - 1) <= _SAME_RATE]
    if len(configured) == 1:
        fitting = {configured[0]: fitting[configured[0]]}
    if np.all(steps == 1.0) and (keys.rate or not configured):
        fitting["sample"] = known or 0.0
    if len(fitting) == 1:
        (unit,) = fitting
        hz = fitting[unit]
        return unit, f"a step of {step:.6g} {unit} is {hz:.4g} Hz" if unit != "sample" else "counts"
    raise QuestionError(_which(label, step, fitting))


def _check_possible(unit: str, step: float, label: str, reason: str) -> None:
    rate = 1.0 / (step * _SECONDS[unit])
    if not _POSSIBLE_HZ[0] <= rate <= _POSSIBLE_HZ[1]:
        raise CapsuleError(
            f"column {label}: with the unit {unit} ({reason}), its usual step of {step:.6g} is a "
            f"sampling rate of {rate:.4g} Hz; use another --time-unit"
        )


def _which(label: str, step: float, fitting: dict[str, float]) -> str:
    options = [
        f"{unit}, {hz:.4g} Hz (--time-unit {unit})"
        if unit != "sample"
        else "numbers of samples (--time-unit sample --rate HZ)"
        for unit, hz in fitting.items()
    ]
    if not options:
        low, high = _PLAUSIBLE_HZ
        return (
            f"column {label}: its usual step of {step:.6g} is a rate between {low:g} and "
            f"{high:g} Hz in no unit; use --time-unit, or name another column with --time"
        )
    return f"column {label}: its usual step of {step:.6g} can be {' or '.join(options)}; choose one"
