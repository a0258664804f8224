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
# First cells of a column that tell whether it holds dates or times of day.
_CELLS_TRIED = 50
# Plausible sampling rates: a wave of 3 s needs the lower one, and no sensor is faster than the
# upper one.
_PLAUSIBLE_HZ = (2.0, 4000.0)
# Sampling rates outside this range show that a named unit is wrong.
_POSSIBLE_HZ = (0.2, 100_000.0)
# Largest relative difference of rates that count as the same.
_SAME_RATE = 0.05
# Seconds since 1970 of the years 2000 and 2100.
_EPOCH_S = (946_684_800.0, 4_102_444_800.0)
# A date or none, a time of day, a half of the day (12:00:00 PM is noon), and a zone or none.
_MOMENT = re.compile(
    r"(?:(?:(?P<year>[0-9]{4})[-/.](?P<month>[0-9]{1,2})[-/.](?P<day>[0-9]{1,2})"
    r"|(?P<first>[0-9]{1,2})(?P<sign>[./-])(?P<second>[0-9]{1,2})(?P=sign)(?P<last>[0-9]{4}))"
    r"[ T,]+)?(?P<hour>[0-9]{1,2}):(?P<minute>[0-9]{2}):(?P<s>[0-9]{2})"
    r"(?:[.,:](?P<fraction>[0-9]{1,9}))?\s*(?:(?P<half>[AaPp])\.?[Mm]\.?)?"
    r"\s*(?P<zone>Z|UTC|[+-][0-9]{2}:?[0-9]{2})?"
)
_SUCH = {
    "date": "date such as 2026-03-04 12:34:56.789",
    "clock": "time of day such as 12:34:56.789",
}


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


def read_time(table: Table, index: int | None, keys: SimpleNamespace) -> Clock:
    """Return the time of each sample, from a column or, without an index, from the sampling rate.

    Of the keys, ``time_unit``, ``rate``, ``date_order`` and ``rate_hz`` are used.

    Raises
    ------
    CapsuleError
        If the time is not known, or several units fit.
    """
    rate, told = keys.rate or table.rate_hz, "the option rate" if keys.rate else "the file"
    if index is None:
        if rate is None:
            raise QuestionError(
                "no column gives the time; name one with --time, or give the sampling rate in Hz "
                "with --rate"
            )
        for number in table.passed_over:
            if table.lines is not None and table.lines[0] < number < table.lines[-1]:
                raise CapsuleError(
                    f"line {number} does not hold a whole sample, and no column gives the time, so "
                    "a missing sample would shift all later ones; delete the line, or complete it"
                )
        time_s = np.arange(table.columns[0].size) / _possible(rate, told)
        return Clock(time_s, "rate", f"{rate:g} Hz by {told}", 0.0, table.started)
    label = table.column_label(index)
    if not table.holds_numbers(index) or keys.time_unit in ("date", "clock"):
        return _from_texts(table, index, keys)
    numbers = table.checked_numbers(index)
    for row in np.flatnonzero(np.isnan(numbers))[:1]:
        raise CapsuleError(
            f"{table.line(row)}: the time is missing in column {label}; complete it, or use --time "
            "none and --rate"
        )
    if numbers.size < 2:
        raise CapsuleError("there are fewer than two samples; is the table cut off?")
    unit, reason = _unit(table, index, keys)
    if unit == "sample" and rate is None:
        raise QuestionError(
            f"column {label} counts samples; give the sampling rate in Hz with --rate"
        )
    seconds = 1 / _possible(rate, told) if unit == "sample" and rate else _SECONDS[unit]
    first_s = float(numbers[0] * seconds)
    started = table.started
    if not started and unit not in ("day", "sample") and _EPOCH_S[0] < first_s < _EPOCH_S[1]:
        started = f"{datetime.fromtimestamp(int(first_s), UTC):%Y-%m-%dT%H:%M:%SZ}"
    return Clock((numbers - numbers[0]) * seconds, unit, reason, first_s, started)


def _possible(rate: float, told: str) -> float:
    """Return a sampling rate in Hz, or refuse it; `told` says where it comes from."""
    low, high = _POSSIBLE_HZ
    if not low <= rate <= high:
        raise CapsuleError(
            f"a sampling rate of {rate:g} Hz by {told} is not between {low:g} and {high:g} Hz; "
            "give the right one with --rate"
        )
    return rate


def _unit(table: Table, index: int, keys: SimpleNamespace) -> tuple[str, str]:
    """Return the unit of a column of numbers, and the reason."""
    label, name = table.column_label(index), table.names[index]
    steps = np.diff(table.columns[index])
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
    configured = [unit for unit, hz in fitting.items() if abs(hz / keys.rate_hz - 1) <= _SAME_RATE]
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


def text_kind(table: Table, index: int) -> str:
    """Return whether a column begins with a ``date`` and time, a ``clock``, or neither (empty)."""
    texts = table.texts(index, _CELLS_TRIED)
    matches = [_MOMENT.fullmatch(text.strip()) for text in texts if text.strip()]
    kinds = {"" if match is None else "date" if _has_date(match) else "clock" for match in matches}
    return kinds.pop() if len(kinds) == 1 else ""


def _has_date(match: re.Match[str]) -> bool:
    return bool(match["year"] or match["last"])


def _from_texts(table: Table, index: int, keys: SimpleNamespace) -> Clock:
    texts = table.texts(index)
    kind = keys.time_unit or text_kind(table, index) or "date"

    def refusal(row: int, what: str) -> CapsuleError:
        place = f"{table.line(row)}, column {table.column_label(index)}"
        return CapsuleError(f"{place}: {texts[row][:60]!r} {what}")

    matches = [_MOMENT.fullmatch(text.strip()) if kind in _SUCH else None for text in texts]
    orders = [keys.date_order] if keys.date_order or kind != "date" else _date_orders(matches)
    if len(orders) > 1:
        options = "the day first (--date-order day_first) or the month (--date-order month_first)"
        raise QuestionError(str(refusal(0, f"can name {options}; choose one")))
    moments = []
    for row, match in enumerate(matches):
        try:
            moments.append(_moment(match, kind, orders[0]))
        except (ValueError, OverflowError):
            raise refusal(
                row,
                f"is not a {_SUCH.get(kind, kind)}; correct the line, use another --time-unit or "
                "--date-order, or name another column with --time",
            ) from None
    seconds = np.array([(moment - moments[0]).total_seconds() for moment in moments])
    first_s = (moments[0] - datetime(1970, 1, 1)).total_seconds()
    if kind == "clock":
        # After midnight the times continue to rise.
        days = np.concatenate([[0], np.cumsum(np.diff(seconds) < -_SECONDS["day"] / 2)])
        seconds += _SECONDS["day"] * days
        return Clock(seconds, kind, "times of day", first_s, table.started)
    has_zone = matches[0] and matches[0]["zone"]
    started = moments[0].isoformat(timespec="seconds") + ("Z" if has_zone else "")
    return Clock(seconds, kind, "dates", first_s, started, orders[0])


def _date_orders(matches: Sequence[re.Match[str] | None]) -> list[str]:
    """Return the possible orders of day and month in dates; an empty one if none is needed."""
    ordered = [match for match in matches if match and match["first"]]
    pairs = {(int(match["first"]), int(match["second"])) for match in ordered}
    if not pairs or (len(pairs) == 1 and len(set(*pairs)) == 1):
        return [""]
    if any(first > 12 for first, _ in pairs):
        return ["day_first"]
    if any(second > 12 for _, second in pairs):
        return ["month_first"]
    # Countries that write points between day and month write the day first.
    has_points = all(match["sign"] == "." for match in ordered)
    return ["day_first"] if has_points else ["day_first", "month_first"]


def _moment(match: re.Match[str] | None, kind: str, order: str) -> datetime:
    """Return a date and time, in UTC if it names a zone; without a date, on 1 January 1970.

    Raises a ValueError or an OverflowError if there is no such date or time.
    """
    # Some clocks count a leap second as second 60.
    if not match or _has_date(match) != (kind == "date") or int(match["s"]) > 60:
        raise ValueError
    year, month, day = match["year"] or match["last"], match["month"], match["day"]
    if match["first"]:
        day, month = match.group("first", "second")
        if order == "month_first":
            day, month = month, day
    hour, zone = int(match["hour"]), match["zone"]
    if match["half"]:
        hour = hour % 12 + 12 * (match["half"] in "pP")
    moment = datetime(int(year or 1970), int(month or 1), int(day or 1), hour, int(match["minute"]))
    moment += timedelta(seconds=float(f"{match['s']}.{match['fraction'] or 0}"))
    if zone and zone not in ("Z", "UTC"):
        east = timedelta(hours=int(zone[1:3]), minutes=int(zone[-2:]))
        moment += east if zone[0] == "-" else -east
    return moment


def later(started: str, seconds: float) -> str:
    """Return a date and time that a file states, moved by seconds, as ISO 8601.

    With a zone, it is in coordinated universal time and ends in ``Z``. It is empty if `started` is
    empty, or is no date with a time that ISO 8601 knows.
    """
    try:
        moment = datetime.fromisoformat(started.strip()) + timedelta(seconds=seconds)
        if moment.tzinfo is not None:
            moment = moment.astimezone(UTC)
    except (ValueError, OverflowError):
        return ""
    return moment.isoformat(timespec="seconds").replace("+00:00", "Z")
