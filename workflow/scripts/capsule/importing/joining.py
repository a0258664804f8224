"""Bring sensors with times of their own to the same instants: channels of a file, or files."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.resampling import resample, usual_rate
from capsule.importing.times import Clock

# Time stamps that differ by less than this many intervals are the same time.
_SAME_INSTANT = 0.1
# Dates are often written in whole seconds.
_SAME_DATE_S = 1.0


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
    begins = _begins(clocks)
    times = [begin + clock.time_s for begin, clock in zip(begins, clocks, strict=True)]
    rates = [usual_rate(time_s) for time_s in times]
    start, end = max(time_s[0] for time_s in times), min(time_s[-1] for time_s in times)
    if end <= start:
        raise CapsuleError(
            f"the sensors have no time in common: the last one begins at {start:g} s, the first "
            f"one ends at {end:g} s of their clocks; give files of one run"
        )
    sizes = [each.size for each in times]
    fewest = min(sizes)
    # One sensor may end a sample earlier than the others.
    if max(sizes) - fewest <= 1 and all(
        np.abs(each[:fewest] - times[0][:fewest]).max() <= _SAME_INSTANT / rates[0]
        for each in times
    ):
        clock = replace(clocks[0], time_s=clocks[0].time_s[:fewest])
        return clock, np.array([row[:fewest] for row in rows]), ""
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


def _begins(clocks: Sequence[Clock]) -> list[float]:
    """Return the times of the sensors' first samples by a clock that all share, in s.

    They follow from the dates at which the sensors started, or else from their clocks.
    """
    first_s = [clock.first_s for clock in clocks]
    dates = [_date_s(clock.started) for clock in clocks]
    if None not in dates:
        apart = [float(date - dates[0]) for date in dates]
        for number, (by_date, own_s) in enumerate(zip(apart, first_s, strict=True), start=1):
            by_clock = own_s - first_s[0]
            if any(apart) and any(np.diff(first_s)) and abs(by_date - by_clock) > _SAME_DATE_S:
                raise CapsuleError(
                    f"sensor {number} starts {by_date:g} s after sensor 1 by its date, "
                    f"{clocks[number - 1].started!r}, and {by_clock:g} s by its clock; delete the "
                    "dates or correct the times"
                )
        return apart if any(apart) and not any(np.diff(first_s)) else first_s
    for number, (date, clock) in enumerate(zip(dates, clocks, strict=True), start=1):
        if date is None and any(each is not None for each in dates):
            at = next(at for at, each in enumerate(dates) if each is not None)
            raise CapsuleError(
                f"sensor {at + 1} names its start, {clocks[at].started!r}, but sensor {number} "
                f"names {repr(clock.started) if clock.started else 'none'}; name the start of "
                "each sensor, or of none"
            )
    return first_s


def _date_s(started: str) -> float | None:
    """Return a date and time in s since 1970, without a zone that of UTC; None if it is none."""
    try:
        moment = datetime.fromisoformat(started.strip())
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return None
