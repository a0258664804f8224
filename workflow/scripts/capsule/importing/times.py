"""Convert a column of times, dates or times of day to seconds, and find its unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.table import QuestionError, Table
from capsule.importing.units import TIME_UNITS, plain_unit, split_unit

_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "day": 86_400.0}
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
_CLOCK = re.compile(r"([0-9]{1,2}):([0-9]{2}):([0-9]{2})(?:[.,:]([0-9]{1,9}))?")
_DAY_AND_MONTH = re.compile(r"([0-9]{1,2})([./-])([0-9]{1,2})\2([0-9]{4})[ T,]+(.*)")
_YEAR_FIRST = re.compile(r"([0-9]{4})[-/.]([0-9]{1,2})[-/.]([0-9]{1,2})[ T,]+(.*)")
_ZONE = re.compile(r"(.*?)\s*(Z|UTC|[+-][0-9]{2}:?[0-9]{2})?")
# A time with AM or PM; 12:00:00 PM is noon.
_NOON = re.compile(r"(.*?)\s*([AaPp])\.?[Mm]\.?")


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
        Date and time of the first sample, as the file states it; empty if not known.
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
    table: Table, index: int | None, keys: SimpleNamespace, configured_hz: float
) -> Clock:
    """Return the time of each sample.

    Parameters
    ----------
    table : Table
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
        _refuse_lines_between(table)
        told = "the option rate" if keys.rate else "the file"
        time_s = np.arange(table.numbers.shape[1]) / rate
        return Clock(time_s, "rate", f"{rate:g} Hz by {told}", 0.0, table.started)
    are_texts = table.unreadable is not None and np.mean(table.unreadable[index]) > 0.5
    if are_texts or keys.time_unit in ("date", "clock"):
        return _from_texts(table, index, keys)
    numbers, label = table.all_numbers(index), table.column_label(index)
    if np.isnan(numbers).any():
        raise CapsuleError(
            f"{table.line(int(np.argmax(np.isnan(numbers))))}: the time is missing in column "
            f"{label}; complete it, or use --time none and --rate"
        )
    if numbers.size < 2:
        raise CapsuleError("there are fewer than two samples; is the table cut off?")
    unit, reason = _unit(table, index, keys, configured_hz)
    if unit == "sample" and rate is None:
        raise QuestionError(
            f"column {label} counts samples; give the sampling rate in Hz with --rate"
        )
    seconds = 1 / rate if unit == "sample" and rate else _SECONDS[unit]
    first_s = float(numbers[0] * seconds)
    started = table.started
    if not started and unit not in ("day", "sample") and _EPOCH_S[0] < first_s < _EPOCH_S[1]:
        started = later(datetime.fromtimestamp(int(first_s), UTC).isoformat(), 0.0)
    return Clock((numbers - numbers[0]) * seconds, unit, reason, first_s, started)


def _refuse_lines_between(table: Table) -> None:
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


def _unit(table: Table, index: int, keys: SimpleNamespace, configured_hz: float) -> tuple[str, str]:
    """Return the unit of a column of numbers, and the reason."""
    label, name = table.column_label(index), table.names[index]
    steps = np.diff(table.numbers[index])
    step = float(np.median(steps))
    if step <= 0:
        raise CapsuleError(
            f"column {label}: the time does not run forward; name another column with --time"
        )
    bare, in_name = split_unit(name)
    words = (plain_unit(table.units[index]), plain_unit(in_name), bare.strip().lower())
    named = next((TIME_UNITS[word] for word in words if word in TIME_UNITS), None)
    if told := keys.time_unit or named:
        reason = "given" if keys.time_unit else "named in the file"
        rate = 1.0 / (step * _SECONDS.get(told, 1.0))
        if told != "sample" and not _POSSIBLE_HZ[0] <= rate <= _POSSIBLE_HZ[1]:
            raise CapsuleError(
                f"column {label}: with the unit {told} ({reason}), its usual step of {step:.6g} is "
                f"a sampling rate of {rate:.4g} Hz; use another --time-unit"
            )
        return told, reason
    known = keys.rate or table.rate_hz
    low, high = (known * (1 - _SAME_RATE), known * (1 + _SAME_RATE)) if known else _PLAUSIBLE_HZ
    rates = {unit: 1.0 / (step * _SECONDS[unit]) for unit in _TRIED}
    fitting = {unit: hz for unit, hz in rates.items() if low <= hz <= high}
    configured = [unit for unit, hz in fitting.items() if abs(hz / configured_hz - 1) <= _SAME_RATE]
    if len(configured) == 1:
        fitting = {configured[0]: fitting[configured[0]]}
    if np.all(steps == 1.0) and (keys.rate or not configured):
        fitting["sample"] = known or 0.0
    if len(fitting) == 1:
        ((unit, hz),) = fitting.items()
        return unit, "counts" if unit == "sample" else f"a step of {step:.6g} {unit} is {hz:.4g} Hz"
    if not fitting:
        raise QuestionError(
            f"column {label}: its usual step of {step:.6g} is a rate between {low:g} and "
            f"{high:g} Hz in no unit; use --time-unit, or name another column with --time"
        )
    options = [
        "numbers of samples (--time-unit sample --rate HZ)"
        if unit == "sample"
        else f"{unit}, {hz:.4g} Hz (--time-unit {unit})"
        for unit, hz in fitting.items()
    ]
    raise QuestionError(
        f"column {label}: its usual step of {step:.6g} can be {' or '.join(options)}; choose one"
    )


def text_kind(texts: Sequence[str]) -> str:
    """Return whether a column of text holds a ``date``, a ``clock`` or neither (empty)."""
    some = [text.strip() for text in texts[:50] if text.strip()]
    if some and all(_CLOCK.fullmatch(_NOON.sub(r"\1", text)) for text in some):
        return "clock"
    if some and all(_YEAR_FIRST.fullmatch(text) or _DAY_AND_MONTH.fullmatch(text) for text in some):
        return "date"
    return ""


def _from_texts(table: Table, index: int, keys: SimpleNamespace) -> Clock:
    texts = [] if table.texts is None else table.texts[index].tolist()
    kind, asked = text_kind(texts), keys.time_unit
    places = [f"{table.line(row)}, column {table.column_label(index)}" for row in range(len(texts))]
    if not kind or (asked and asked != kind):
        place = places[0] if places else f"{table.line(0)}, column {table.column_label(index)}"
        shown = repr(texts[0][:60]) if texts else "a number"
        raise CapsuleError(
            f"{place}: {shown} is not a {asked or 'time'}; name another column with --time, or "
            "use another --time-unit"
        )
    if kind == "clock":
        seconds = np.array([_time_of_day(*each) for each in zip(texts, places, strict=True)])
        # After midnight the times continue to rise.
        days = np.concatenate([[0], np.cumsum(np.diff(seconds) < -_SECONDS["day"] / 2)])
        seconds += _SECONDS["day"] * days
        return Clock(seconds - seconds[0], kind, "times of day", float(seconds[0]), table.started)
    order = keys.date_order or _date_order(texts, places[0])
    dates = [_date(text, order, place) for text, place in zip(texts, places, strict=True)]
    first, has_zone = dates[0]
    seconds = np.array([(date - first).total_seconds() for date, _ in dates])
    since_1970 = (first - datetime(1970, 1, 1)).total_seconds()
    started = first.isoformat(timespec="seconds") + ("Z" if has_zone else "")
    return Clock(seconds, kind, "dates", since_1970, started, order)


def _time_of_day(text: str, place: str) -> float:
    noon = _NOON.fullmatch(text.strip())
    match = _CLOCK.fullmatch(noon[1] if noon else text.strip())
    if not match or int(match[1]) > 23 or int(match[2]) > 59 or int(match[3]) > 60:
        raise CapsuleError(
            f"{place}: {text[:60]!r} is not a time of day such as 12:34:56.789; "
            "correct the line, or name another column with --time"
        )
    hour = int(match[1]) % 12 + 12 * (noon[2].lower() == "p") if noon else int(match[1])
    return 3600.0 * hour + 60.0 * int(match[2]) + int(match[3]) + float(f"0.{match[4] or 0}")


def _date_order(texts: Sequence[str], place: str) -> str:
    """Return the order of day and month in dates; empty if it makes no difference."""
    matches = [match for text in texts if (match := _DAY_AND_MONTH.fullmatch(text.strip()))]
    pairs = {(int(match[1]), int(match[3])) for match in matches}
    if not pairs or (len(pairs) == 1 and len(set(*pairs)) == 1):
        return ""
    if any(first > 12 for first, _ in pairs):
        return "day_first"
    if any(second > 12 for _, second in pairs):
        return "month_first"
    # Countries that write points between day and month write the day first.
    if all(match[2] == "." for match in matches):
        return "day_first"
    day, month = next(iter(pairs))
    raise QuestionError(
        f"{place}: {texts[0][:60]!r} can be day {day} of month {month} (--date-order day_first) or "
        f"day {month} of month {day} (--date-order month_first); choose one"
    )


def _date(text: str, order: str, place: str) -> tuple[datetime, bool]:
    """Return a date, and whether the text names a time zone."""
    if match := _YEAR_FIRST.fullmatch(text.strip()):
        year, month, day, rest = int(match[1]), int(match[2]), int(match[3]), match[4]
    elif match := _DAY_AND_MONTH.fullmatch(text.strip()):
        year, rest = int(match[4]), match[5]
        first, second = int(match[1]), int(match[3])
        day, month = (second, first) if order == "month_first" else (first, second)
    else:
        raise CapsuleError(
            f"{place}: {text[:60]!r} is not a date with a time, such as 2026-03-04 12:34:56.789; "
            "correct the line, or name another column with --time"
        )
    zone = _ZONE.fullmatch(rest)
    seconds = _time_of_day(zone[1] if zone else rest, place)
    named = zone[2] if zone else None
    try:
        date = datetime(year, month, day) + timedelta(seconds=seconds)
        if named and named not in ("Z", "UTC"):
            east = timedelta(hours=int(named[1:3]), minutes=int(named[-2:]))
            date += east if named[0] == "-" else -east
    except (ValueError, OverflowError):
        raise CapsuleError(
            f"{place}: there is no day {day} of month {month} in {year}; "
            "correct the line, or use the other --date-order"
        ) from None
    return date, named is not None


def later(started: str, seconds: float) -> str:
    """Return a date and time that a file states, moved by seconds, as ISO 8601.

    Parameters
    ----------
    started : str
        Date and time; with a zone, the result is in coordinated universal time and ends in ``Z``.
    seconds : float
        Time to add, in s.

    Returns
    -------
    str
        Empty if `started` is empty, or is no date with a time that ISO 8601 knows.
    """
    try:
        moment = datetime.fromisoformat(started.strip()) + timedelta(seconds=seconds)
        if moment.tzinfo is not None:
            moment = moment.astimezone(UTC)
    except (ValueError, OverflowError):
        return ""
    return moment.isoformat(timespec="seconds").replace("+00:00", "Z")
