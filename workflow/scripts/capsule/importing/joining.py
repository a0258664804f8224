"""Bring sensors with times of their own to the same instants: channels of a file, or files."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.resampling import resample, usual_rate
from capsule.importing.table import Channel, with_stamps
from capsule.importing.times import Clock
from capsule.importing.units import is_time_name

_DIGITS = re.compile("[0-9]+")
# What tells the sensor of a time: t1, t(1), S1_time.
_OF_SENSOR = re.compile(r".*[0-9][\s._-]+(?=[A-Za-z])|[\s._(-]*[0-9]*\)?$")
# Time stamps that differ by less than this many intervals are the same time.
_SAME_INSTANT = 0.1
# Dates are often written in whole seconds.
_SAME_DATE_S = 1.0


def with_own_times(channels: list[Channel], keys: Keys) -> list[Channel]:
    """Return channels with their time stamps if each of them has a time of its own.

    Such channels are named, for example, ``time, S1, time.1, S2``, or in any order with numbers
    that tell the pairs: ``t1, t2, S1, S2``. If columns are chosen by their numbers, all count.
    """
    named = channels
    numbers = [match[0] if (match := _DIGITS.search(each.name)) else "" for each in channels]
    if "" not in numbers and set(Counter(numbers).values()) == {2}:
        order = zip(map(int, numbers), channels, strict=True)
        named = [each for _, each in sorted(order, key=lambda at: (at[0], not _times(at[1].name)))]
    pairs = list(zip(named[::2], named[1::2], strict=False))
    are_paired = len(pairs) > 1 and 2 * len(pairs) == len(channels)
    are_numbered = any(str(wanted).isdecimal() for wanted in keys.sensors or ())
    # A name that several columns have chooses none of them.
    alike = sum(each.name == keys.time for each in channels)
    is_chosen = keys.time not in (None, "none") and alike < 2
    if not are_paired or are_numbered or is_chosen:
        return channels
    for stamps, channel in pairs:
        bare = stamps.name.replace(channel.name, "") if channel.name else stamps.name
        if not _times(bare) or _times(channel.name):
            return channels
    return with_stamps([replace(channel, stamps=stamps) for stamps, channel in pairs])


def _times(name: str) -> bool:
    """Return whether a name, without the sensor that it numbers, is that of a time."""
    return is_time_name(_OF_SENSOR.sub("", name).strip(" ._-"))


def at_same_instants(
    clocks: Sequence[Clock], rows: Sequence[np.ndarray], keys: Keys
) -> tuple[Clock, np.ndarray, str]:
    """Return the readings of sensors over the time that all have.

    Parameters
    ----------
    clocks : sequence of S Clock
        The time of each sensor's samples.
    rows : sequence of S arrays
        The samples of each sensor; NaN where one is missing.
    keys : Keys
        Of the keys, ``rate_hz`` is used.

    Returns
    -------
    clock : Clock
        That of the first sensor, with the common times (K,).
    values : (S, K) array
        The readings; those of sensors with the same times are not changed.
    resampled : str
        How they were brought to the same instants; empty if they were not.

    Raises
    ------
    CapsuleError
        If the sensors have no time in common, or it is not known how they lie in time.
    """
    ends = [clock.time_s[: row.size] for clock, row in zip(clocks, rows, strict=True)]
    times = [begin + time_s for begin, time_s in zip(_begins(clocks), ends, strict=True)]
    sizes = [each.size for each in times]
    fewest = min(sizes)
    # One sensor may end a sample earlier than the others.
    apart = max(np.abs(each[:fewest] - times[0][:fewest]).max() for each in times)
    if max(sizes) - fewest <= 1 and (
        apart == 0 or apart <= _SAME_INSTANT / max(map(usual_rate, times))
    ):
        clock = replace(clocks[0], time_s=clocks[0].time_s[:fewest])
        return clock, np.array([row[:fewest] for row in rows]), ""
    rates = [usual_rate(time_s) for time_s in times]
    start, end = max(time_s[0] for time_s in times), min(time_s[-1] for time_s in times)
    if end <= start:
        raise CapsuleError(
            f"the sensors have no time in common: the last one begins at {start:g} s, the first "
            f"one ends at {end:g} s of their clocks; give files of one run"
        )
    end += 0.5 / keys.rate_hz
    parts = [
        resample(each[each <= end], row[None, each <= end], keys.rate_hz, float(start))
        for each, row in zip(times, rows, strict=True)
    ]
    time_s = min((time_s for time_s, _ in parts), key=len)
    old_hz = ", ".join(f"{rate:.4g}" for rate in rates)
    return (
        replace(clocks[0], time_s=start - times[0][0] + time_s),
        np.array([new[0, : time_s.size] for _, new in parts]),
        f"from {old_hz} Hz to {keys.rate_hz:g} Hz and to the same instants",
    )


def _begins(clocks: Sequence[Clock]) -> np.ndarray:
    """Return the times of the sensors' first samples by a clock that all share, in s, (S,).

    They follow from the dates at which the sensors started, or else from their clocks.
    """
    first_s = np.array([clock.first_s for clock in clocks])
    for at in np.flatnonzero(~np.isfinite(first_s))[:1]:
        raise CapsuleError(f"sensor {at + 1} starts at {first_s[at]:g} s; export it with a start")
    dates = np.array([_date_s(clock.started) for clock in clocks])
    unknown = np.isnan(dates)
    undated = [at for at, clock in enumerate(clocks) if clock.started and unknown[at]]
    if undated and len({clock.started for clock in clocks}) > 1:
        raise CapsuleError(
            f"sensor {undated[0] + 1} names its start, {clocks[undated[0]].started[:60]!r}, which "
            "is no date such as 2026-03-04T12:00:02.5Z; write the start of each sensor so, as "
            "# started: DATE, and give one file a sensor with --per-sensor"
        )
    if unknown.any() and not unknown.all():
        at, other = int(np.argmin(unknown)), int(np.argmax(unknown))
        raise CapsuleError(
            f"sensor {at + 1} names its start, {clocks[at].started!r}, but sensor {other + 1} "
            f"names {repr(clocks[other].started) if clocks[other].started else 'none'}; name the "
            "start of each sensor, or of none"
        )
    apart, by_clock = dates - dates[0], first_s - first_s[0]
    if not apart.any() or unknown.all():
        return first_s
    if by_clock.any():
        for at in np.flatnonzero(np.abs(apart - by_clock) > _SAME_DATE_S)[:1]:
            raise CapsuleError(
                f"sensor {at + 1} starts {apart[at]:g} s after sensor 1 by its date, "
                f"{clocks[at].started!r}, and {by_clock[at]:g} s by its clock; delete the dates or "
                "correct the times"
            )
        return first_s
    return np.asarray(apart)


def _date_s(started: str) -> float:
    """Return a date and time in s since 1970, without a zone that of UTC; NaN if it is none."""
    try:
        moment = datetime.fromisoformat(started.strip())
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return float("nan")
