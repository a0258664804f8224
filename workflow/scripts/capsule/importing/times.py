"""Convert a column of times, dates or times of day to seconds, and find its unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.stated import UNSURE_RATE, said_of_clock
from capsule.importing.table import Channel, QuestionError, Table, naming
from capsule.importing.units import SECONDS, is_time_unit, is_unit, split_unit, unit_of

# The key ``time`` of files without a column of times.
NO_TIME = "none"
# Units that are tried if none is named. Minutes and hours are not tried: users name them.
_TRIED = ("s", "ms", "us", "ns", "day")
# A rate is far from the configured one if it is more than twice as high or low.
_FAR = np.log(2.1)
# Of a clock that counts in powers of 2, the units that are nearly these.
_BINARY = {"ms": 2.0**-10, "us": 2.0**-20}
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
# Seconds of a year: no clock of a bench runs so long.
_YEAR_S = 31_557_600.0
# Steps of numbers such as 120059.9 over a minute, an hour and a day, less the time that passes.
_SKIPPED = (40.0, 4040.0, 764_040.0)
# A counter of so many bits, in its own unit or in one a thousand or a million times larger, begins
# again from 0.
WRAPS = [2.0**bits / scale for bits in (32, 31, 16, 15) for scale in (1, 1e3, 1e6)]
# At the end of summer time, a clock goes back by an hour; and without hours, from 59:59.9 to 00:00.
_HOUR = 3600.0
# In usual steps: the longest step over a wrap, and the least wrap that jitter cannot be.
_LONGEST_STEP, _LEAST_WRAP = 3.0, 100.0
_REMEDY = "--time-unit, or else --time none and the sampling rate with --rate"
_OTHER_UNIT = (
    f"the file names the unit {{!r}}, which is none of {', '.join(SECONDS)}; if it is one of "
    f"these, give {_REMEDY}"
)
_NO_UNITS = re.compile(r"utc|gmt|local|unix|epoch|posix|elapsed|rel(ative)?|abs(olute)?|start")
_DAY, _MONTH, _YEAR = "(?P<day>[0-9]{1,2})", "(?P<month>[0-9]{1,2})", "(?P<year>[0-9]{4})"
# A half of the day (12:00:00 PM is noon), and a zone or none, may follow a time of day.
_SECOND = (
    r"(?P<minute>[0-5]?[0-9]):(?P<s>[0-9]{2})(?:[.,:](?P<fraction>[0-9]{1,9}))?"
    r"\s*(?:(?P<half>[AaPp])\.?[Mm]\.?)?\s*(?P<zone>Z|UTC|[+-][0-9]{2}:?[0-9]{2})?"
)
_CLOCK = rf"(?P<hour>[0-9]{{1,2}}):{_SECOND}"
# A clock may have counted for days; and a program that leaves out the hours writes a fraction.
_HOURS = r"(?:(?:(?P<days>[0-9]{1,4}) days?,? )?(?P<hour>[0-9]{1,4}):|(?=[0-9]+:[0-9]+[.,]))"
_MONTHS = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"]
# By kind of the column, and order of day and month where it matters.
_MOMENTS = {
    ("date", ""): re.compile(rf"{_YEAR}[-/.]{_MONTH}[-/.]{_DAY}[ T,]+{_CLOCK}"),
    ("date", "day_first"): re.compile(rf"{_DAY}([./-]){_MONTH}\2{_YEAR}[ T,]+{_CLOCK}"),
    ("date", "month_first"): re.compile(rf"{_MONTH}([./-]){_DAY}\2{_YEAR}[ T,]+{_CLOCK}"),
    ("date", "name"): re.compile(
        rf"[A-Z][a-z]{{2}} (?P<month>{'|'.join(_MONTHS)}) +{_DAY} {_CLOCK} {_YEAR}"
    ),
    ("clock", ""): re.compile(_HOURS + _SECOND),
}
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
    warnings : sequence of str
        Notes for the user.
    """

    time_s: np.ndarray
    unit: str
    reason: str
    first_s: float = 0.0
    started: str = ""
    date_order: str = ""
    warnings: Sequence[str] = ()


def read_time(table: Table, time: Channel | None, channel: Channel, keys: Keys) -> Clock:
    """Return the time of each sample of a channel.

    It follows from the column `time`; without one, from the channel's own time stamps, or its
    sampling rate. Of the keys, ``time_unit``, ``rate``, ``date_order`` and ``rate_hz`` are used.

    Raises
    ------
    CapsuleError
        If the time is not known, or several units fit.
    """
    is_none = keys.time == NO_TIME and channel.rate_hz is not None
    if time is None and (keys.rate or is_none or channel.stamps is None):
        return _by_rate(table, channel, keys)
    stamps = time or channel.stamps
    assert stamps is not None
    is_text = not stamps.holds_numbers or keys.time_unit in ("date", "clock")
    clock = (_from_texts if is_text else _from_numbers)(table, stamps, channel, keys)
    is_decided = keys.time_unit or keys.rate or clock.unit == "sample"
    step_s = float(np.median(np.diff(clock.time_s))) if clock.time_s.size > 1 else 0.0
    others = [hz for hz in channel.sure_rates_hz if abs(step_s * hz - 1) > _SAME_RATE]
    if others and not is_decided and step_s > 0:
        raise QuestionError(
            f"column {table.column_label(stamps)}: its usual step of {step_s:.6g} s is "
            f"{1 / step_s:.4g} Hz, but the file states {_stated(channel)}; give --time-unit "
            f"{clock.unit} if the times are right, or --time none if the rate is"
        )
    return clock


def _from_numbers(table: Table, stamps: Channel, channel: Channel, keys: Keys) -> Clock:
    """Return the time from numbers, in the unit that is named, or the only one that fits."""
    numbers, column = table.checked_numbers(stamps), f"column {table.column_label(stamps)}"
    for row in np.flatnonzero(np.isnan(numbers))[:1]:
        raise CapsuleError(
            f"{table.line(row)}: the time is missing in {column}; complete it, or use --time none "
            "and --rate"
        )
    if numbers.size < 2:
        raise CapsuleError("there are fewer than two samples; is the table cut off?")
    numbers, warnings = unwrapped(numbers, WRAPS)
    with naming(column):
        unit, reason = _unit(table, stamps, numbers, channel, keys)
    if unit == "sample":
        no_rate = f"{column} counts samples; give the sampling rate in Hz with --rate"
        seconds = 1 / _rate(channel, keys, no_rate)[0]
    else:
        seconds = SECONDS[unit]
    first_s, started = float(numbers[0] * seconds), stamps.started or channel.started
    if not started and unit not in ("day", "sample") and _EPOCH_S[0] < first_s < _EPOCH_S[1]:
        started = _iso(datetime.fromtimestamp(int(first_s), UTC))
    time_s = (numbers - numbers[0]) * seconds
    return Clock(time_s, unit, reason, first_s, started, warnings=warnings)


def _by_rate(table: Table, channel: Channel, keys: Keys) -> Clock:
    """Return the time of each sample from the sampling rate."""
    no_rate = "no column gives the time; name one with --time, or give the sampling rate in Hz "
    rate, told = _rate(channel, keys, f"{no_rate}with --rate")
    if table.restarts and table.lines is not None and not keys.run_gap_s:
        raise CapsuleError(
            f"above line {table.lines[table.restarts[0]]} the names of the columns are repeated, "
            "as by a board that starts again; give --run-gap-s 5 if another run begins there, or "
            "delete the names"
        )
    for number in table.passed_over:
        if table.lines is not None and table.lines[0] < number < table.lines[-1]:
            raise CapsuleError(
                f"line {number} does not hold a whole sample, and no column gives the time, so a "
                "missing sample would shift all later ones; delete the line, or complete it"
            )
    time_s, first_s = np.arange(channel.values.size) / rate, channel.start_s or 0.0
    return Clock(time_s, "rate", f"{rate:g} Hz by {told}", first_s, channel.started)


def unwrapped(times: np.ndarray, wraps: Sequence[float]) -> tuple[np.ndarray, list[str]]:
    """Return times that run on where they step back by exactly a wrap, (K,), and notes.

    The times are in any unit, as `wraps` are.
    """
    steps = np.diff(times)
    forward = steps[steps > 0]
    if not forward.size:
        return times, []
    step = float(np.median(forward))
    added, warnings = np.zeros(times.size), list[str]()
    for wrap in wraps:
        # A counter never shows more than it holds.
        if wrap < _LEAST_WRAP * step or (wrap != _HOUR and np.any(np.abs(times) > wrap)):
            continue
        back = (steps < 0) & (steps + wrap > 0) & (steps + wrap <= _LONGEST_STEP * step)
        # At the begin of summer time, a clock goes on by an hour.
        ahead = (steps > wrap) & (steps <= wrap + _LONGEST_STEP * step) & (wrap == _HOUR)
        added[1:] += wrap * np.cumsum(back.astype(int) - ahead)
        for row in np.flatnonzero(back | ahead)[:1]:
            how = f"{wrap:.10g}"
            if wrap == _HOUR:
                how = "an hour, as with summer time or without hours"
            jump = f"the clock jumps by {how}, at sample {row + 2}"
            warnings.append(f"{jump}, and is taken to run on")
    return times + added, warnings


def _rate(channel: Channel, keys: Keys, question: str) -> tuple[float, str]:
    """Return the sampling rate in Hz and where it comes from; ask for it if it is unknown."""
    rate, told = keys.rate or channel.rate_hz, "the option rate" if keys.rate else "the file"
    low, high = _POSSIBLE_HZ
    if rate is None and channel.rates_hz:
        question = f"the file states {_stated(channel)}; give the sampling rate in Hz with --rate"
        raise QuestionError(question)
    if rate is None:
        raise QuestionError(question)
    if not low <= rate <= high:
        raise CapsuleError(
            f"a sampling rate of {rate:g} Hz by {told} is not between {low:g} and {high:g} Hz; "
            "give the right one with --rate"
        )
    return rate, told


def _stated(channel: Channel) -> str:
    return " and ".join(f"{name} = {value:g}" for name, value in channel.rates_hz.items())


def _unit(
    table: Table, stamps: Channel, numbers: np.ndarray, channel: Channel, keys: Keys
) -> tuple[str, str]:
    """Return the unit of a column of numbers (K,), and the reason."""
    steps = np.diff(numbers)
    step = float(np.median(steps))
    if step <= 0:
        raise QuestionError(
            "the time does not run forward: if its clock is too coarse, use --time none and give "
            "the sampling rate with --rate, or name another column with --time"
        )
    bare, in_name = split_unit(stamps.name)
    # As in "seconds since 2026-03-04".
    in_units = stamps.unit.partition(" since ")[0].strip("[]()<> ")
    texts = [in_units, in_name, table.notes.get("time unit", "")]
    texts = [text for text in texts if text and not _NO_UNITS.fullmatch(text.lower())]
    if not any(map(is_time_unit, texts)):
        texts += [bare] if is_time_unit(bare) or (len(bare) > 1 and is_unit(bare)) else []
    units = {unit_of(text) or "": text for text in texts if is_time_unit(text)}
    # Beside a unit, other words are names.
    unknown = [
        text for text in texts if unit_of(text) not in units and (is_unit(text) or not units)
    ]
    named = next(iter(units), None)
    if unknown and not keys.time_unit:
        raise QuestionError(_OTHER_UNIT.format(unknown[0][:60]))
    if len(units) > 1 and not keys.time_unit:
        several = " and ".join(units.values())
        raise QuestionError(f"the file names {several}; give the right {_REMEDY}")
    rates = {unit: 1.0 / (step * seconds) for unit, seconds in SECONDS.items()}
    if told := keys.time_unit or named:
        reason = "given" if keys.time_unit else "named in the file"
        if told != "sample" and not _POSSIBLE_HZ[0] <= rates[told] <= _POSSIBLE_HZ[1]:
            raise CapsuleError(
                f"with the unit {told} ({reason}), its usual step of {step:.6g} is a sampling rate "
                f"of {rates[told]:.4g} Hz; use another --time-unit"
            )
        return told, reason
    known = keys.rate or channel.rate_hz
    low, high = (known * (1 - _SAME_RATE), known * (1 + _SAME_RATE)) if known else _PLAUSIBLE_HZ
    said = _said_of_clock(table, stamps, channel, numbers, step)
    fitting = [unit for unit in (SECONDS if said else _TRIED) if low <= rates[unit] <= high]
    # Other programs count 100 ns, from the year 1 or 1601 on.
    if _YEAR_S < numbers[0] * SECONDS["ns"] < _EPOCH_S[0]:
        fitting = [unit for unit in fitting if unit != "ns"]
    skips = np.abs(steps[:, None] - step - _SKIPPED) < 0.5 * step
    if step < 1 and np.all(numbers % 100 < 60) and skips.any():
        raise QuestionError(
            f"{numbers[0]:.15g} seems to be a clock without colons, as 120059.9 for 12:00:59.9; "
            "write it with colons, or give --time none and the sampling rate with --rate"
        )
    configured = [unit for unit in fitting if _same(rates[unit], keys.rate_hz)]
    fitting = configured if len(configured) == 1 else fitting
    for text, seconds in said:
        meant = [
            each
            for each, length in SECONDS.items()
            if np.isclose(length, seconds, rtol=1e-3, atol=0)
        ]
        fitting = [each for each in fitting if each in meant]
        if meant and not fitting:
            raise QuestionError(
                f"the file says {text!r}, and then its usual step of {step:.6g} is "
                f"{1 / (step * seconds):.4g} Hz; give the right {_REMEDY}"
            )
        if not fitting:
            raise QuestionError(_OTHER_UNIT.format(text))
    options = {unit: f"{unit}, {rates[unit]:.4g} Hz (--time-unit {unit})" for unit in fitting}
    if np.all(steps == 1.0) and (keys.rate or not configured):
        options["sample"] = "numbers of samples (--time-unit sample --rate HZ)"
    if fitting and not (known or said):
        options |= _other_clocks(numbers, step, fitting[0], keys.rate_hz)
    if not options and channel.rate_hz and not keys.rate:
        raise QuestionError(
            f"its usual step of {step:.6g} is in no unit the rate that the file states, "
            f"{_stated(channel)}; give --time-unit if the times are right, or --time none if the "
            "rate is"
        )
    if not options:
        raise QuestionError(
            f"its usual step of {step:.6g} is a rate between {low:g} and {high:g} Hz in no unit; "
            "use --time-unit, or name another column with --time"
        )
    if len(options) > 1:
        can_be = " or ".join(options.values())
        raise QuestionError(f"its usual step of {step:.6g} can be {can_be}; choose one")
    unit = next(iter(options))
    if unit == "sample":
        return unit, "counts"
    return unit, f"a step of {step:.6g} {unit} is {rates[unit]:.4g} Hz"


def _said_of_clock(
    table: Table, stamps: Channel, channel: Channel, numbers: np.ndarray, step: float
) -> list[tuple[str, float]]:
    """Return what the file says of the unit of times (K,), in words and in s; NaN if unclear.

    A clock that can hardly count these times is another one, as that of the processor.
    """
    rates_hz = {} if stamps.rates_hz == channel.rates_hz else dict(stamps.rates_hz)
    rates_hz |= {name: hz for name, hz in channel.rates_hz.items() if UNSURE_RATE.fullmatch(name)}
    said = [*filter(None, map(said_of_clock, table.remarks))]
    said += [(f"{name} = {hz:g}", 1 / hz) for name, hz in rates_hz.items()]
    is_whole, (low, high) = _are_whole(numbers), _PLAUSIBLE_HZ
    return [
        (text, seconds)
        for text, seconds in said
        if is_unit(text) or np.isnan(seconds) or (is_whole and low <= 1 / (step * seconds) <= high)
    ]


def _other_clocks(numbers: np.ndarray, step: float, unit: str, rate_hz: float) -> dict[str, str]:
    """Return other units in which times (K,) may have the configured rate, and the options of each.

    A clock can count whole steps of any length, unless `unit` is near this rate, too, or counts
    from 1970.
    """
    options = {
        other: f"{other}, {rate_hz:g} Hz (--time-unit {other})"
        for other in ("min", "h")
        if _same(1 / (step * SECONDS[other]), rate_hz)
    }
    mean = mean_step(np.diff(numbers))
    off, binary_off = (
        abs(np.log(mean * length * rate_hz))
        for length in (SECONDS[unit], _BINARY.get(unit, np.inf))
    )
    is_whole = _are_whole(numbers) and mean > 1
    is_epoch = _EPOCH_S[0] < numbers[0] * SECONDS[unit] < _EPOCH_S[1]
    if is_whole and not is_epoch and (off > _FAR or 10 * binary_off < off):
        length = f"steps of {1 / (mean * rate_hz):.4g} s"
        options[length] = f"{length}, {rate_hz:g} Hz (--time none --rate {rate_hz:g})"
    return options


def mean_step(steps: np.ndarray) -> float:
    """Return the mean of the steps (K,) of a time without its gaps.

    These are near the median; that of an even number can be near none, and then all count.
    """
    median = float(np.median(steps))
    near = steps[np.abs(steps - median) <= 0.4 * median]
    return float(np.mean(near if near.size else steps))


def _are_whole(numbers: np.ndarray) -> bool:
    """Return whether times (K,) are whole numbers, as those of a counter."""
    return np.allclose(numbers, np.rint(numbers), rtol=0, atol=1e-4)


def _same(rate_hz: float, other_hz: float) -> bool:
    return abs(rate_hz / other_hz - 1) <= _SAME_RATE


def text_kind(channel: Channel) -> str:
    """Return whether a column begins with a ``date`` and time, a ``clock``, or neither (empty)."""
    texts = [text.strip() for text in channel.texts(_CELLS_TRIED) if text.strip()]
    fitting = (kind for (kind, _), way in _MOMENTS.items() if all(map(way.fullmatch, texts)))
    return next(fitting, "") if texts else ""


def _from_texts(table: Table, stamps: Channel, channel: Channel, keys: Keys) -> Clock:
    """Return the time from dates or times of day; of the orders of a date, one must fit."""
    texts = [text.strip() for text in stamps.texts()]
    kind = keys.time_unit or text_kind(stamps) or "date"
    read = {
        order: _moments(texts, way)
        for (each, order), way in _MOMENTS.items()
        if each == kind and (not order.endswith("first") or keys.date_order in (None, order))
    }
    whole = {order: moments for order, moments in read.items() if len(moments) == len(texts)}
    row = 0 if whole else max(map(len, read.values()), default=0)
    shown = f"{table.line(row)}, column {table.column_label(stamps)}: {texts[row][:60]!r}"
    if not whole:
        raise CapsuleError(
            f"{shown} is not a {_SUCH.get(kind, kind)}; correct the line, use another --time-unit "
            "or --date-order, or name another column with --time"
        )
    (order, moments), *others = whole.items()
    if (others and others[0][1] == moments) or order == "name":
        order = ""
    # Countries that write points between day and month write the day first.
    elif others and not all(re.match(r"[0-9]+\.", text) for text in texts):
        raise QuestionError(
            f"{shown} can name the day first (--date-order day_first) or the month (--date-order "
            "month_first); choose one"
        )
    instants = np.array([moment.replace(tzinfo=None) for moment in moments], "datetime64[us]")
    seconds = (instants - instants[0]) / np.timedelta64(1, "s")
    first_s = float(instants[0].astype(float)) / 1e6
    seconds, warnings = unwrapped(seconds, [_HOUR])
    if kind == "clock":
        # After midnight the times continue to rise.
        days = np.concatenate([[0], np.cumsum(np.diff(seconds) < -SECONDS["day"] / 2)])
        seconds, reason, started = seconds + SECONDS["day"] * days, "times of day", channel.started
    else:
        reason, started = "dates", _iso(moments[0])
    return Clock(seconds, kind, reason, first_s, started, order, warnings)


def _moments(texts: Sequence[str], way: re.Pattern[str]) -> list[datetime]:
    """Return dates and times up to the first text that is none, in UTC if they name a zone.

    Without a date, they are on 1 January 1970.
    """
    moments: list[datetime] = []
    for text in texts:
        match = way.fullmatch(text)
        # Some clocks count a leap second as second 60.
        if not match or int(match["s"]) > 60:
            break
        said = {"year": "1970", "month": "1", "day": "1", "days": ""} | match.groupdict("")
        hours, zone = int(said["hour"] or 0), said["zone"].replace("UTC", "Z")
        if half := said["half"].lower():
            hours = hours % 12 + 12 * (half == "p")
        if said["month"] in _MONTHS:
            said["month"] = str(_MONTHS.index(said["month"]) + 1)
        try:
            if hours > 23 and match.re is not _MOMENTS["clock", ""]:
                break
            date = "{year}-{month:0>2}-{day:0>2}".format_map(said)
            moment = datetime.fromisoformat(f"{date}T00:{said['minute']:0>2}{zone}")
            seconds = float(f"{said['s']}.{said['fraction'] or 0}")
            moment += timedelta(days=int(said["days"] or 0), hours=hours, seconds=seconds)
            moments.append(moment.astimezone(UTC) if zone else moment)
        except (ValueError, OverflowError):
            break
    return moments


def _iso(moment: datetime) -> str:
    return moment.isoformat(timespec="seconds").replace("+00:00", "Z")


def later(started: str, seconds: float) -> str:
    """Return a date and time that a file states, moved by seconds, as ISO 8601.

    With a zone, it is in coordinated universal time and ends in ``Z``. It is empty if `started` is
    empty, or is no date with a time that ISO 8601 knows.
    """
    try:
        moment = datetime.fromisoformat(started.strip()) + timedelta(seconds=seconds)
        return _iso(moment.astimezone(UTC) if moment.tzinfo else moment)
    except (ValueError, OverflowError):
        return ""
