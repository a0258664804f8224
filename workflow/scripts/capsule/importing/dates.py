"""Read dates and times of day from text."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.question import QuestionError

_CLOCK = re.compile(r"([0-9]{1,2}):([0-9]{2}):([0-9]{2})(?:[.,:]([0-9]{1,9}))?")
_DAY_AND_MONTH = re.compile(r"([0-9]{1,2})([./-])([0-9]{1,2})\2([0-9]{4})[ T,]+(.*)")
_YEAR_FIRST = re.compile(r"([0-9]{4})[-/.]([0-9]{1,2})[-/.]([0-9]{1,2})[ T,]+(.*)")
_ZONE = re.compile(r"(.*?)\s*(Z|UTC|[+-][0-9]{2}:?[0-9]{2})?")
# A time with AM or PM; 12:00:00 PM is noon.
_NOON = re.compile(r"(.*?)\s*([AaPp])\.?[Mm]\.?")
_DAY_S = 86_400.0


def text_kind(texts: Sequence[str]) -> str:
    """Return whether a column of text holds a ``date``, a ``clock`` or neither (empty)."""
    some = [str(text).strip() for text in texts[:50] if str(text).strip()]
    if some and all(_CLOCK.fullmatch(_NOON.sub(r"\1", text)) for text in some):
        return "clock"
    if some and all(_YEAR_FIRST.fullmatch(text) or _DAY_AND_MONTH.fullmatch(text) for text in some):
        return "date"
    return ""


def read_clock(texts: Sequence[str], places: Sequence[str]) -> np.ndarray:
    """Return times of day, such as 12:34:56.789, in s (K,); after midnight they continue to rise.

    Raises
    ------
    CapsuleError
        If a cell is not a time of day; the message names its place.
    """
    seconds = np.array(
        [_clock(str(text), place) for text, place in zip(texts, places, strict=True)]
    )
    days = np.concatenate([[0], np.cumsum(np.diff(seconds) < -_DAY_S / 2)])
    return seconds + _DAY_S * days


def _clock(text: str, place: str) -> float:
    noon = _NOON.fullmatch(text.strip())
    match = _CLOCK.fullmatch(noon[1] if noon else text.strip())
    if not match or int(match[1]) > 23 or int(match[2]) > 59 or int(match[3]) > 60:
        raise CapsuleError(
            f"{place}: {text[:60]!r} is not a time of day such as 12:34:56.789; "
            "correct the line, or name another column with --time"
        )
    hour = int(match[1]) % 12 + 12 * (noon[2].lower() == "p") if noon else int(match[1])
    fraction = float(f"0.{match[4]}") if match[4] else 0.0
    return 3600.0 * hour + 60.0 * int(match[2]) + int(match[3]) + fraction


def read_dates(
    texts: Sequence[str], order: str, places: Sequence[str]
) -> tuple[np.ndarray, float, str]:
    """Return dates with times of day as seconds.

    Parameters
    ----------
    texts : sequence of K str
        The cells.
    order : str
        Order of day and month if the year is last, from `date_order`.
    places : sequence of K str
        The place of each cell, for messages.

    Returns
    -------
    (K,) array
        Seconds since the first date.
    float
        The first date, in seconds since 1970.
    str
        The first date, as ISO 8601, with ``Z`` if the cells name a time zone.

    Raises
    ------
    CapsuleError
        If a cell is not a date.
    """
    dates = [_date(str(text), order, place) for text, place in zip(texts, places, strict=True)]
    first = dates[0][0]
    seconds = np.array([(date - first).total_seconds() for date, _ in dates])
    zone = "Z" if dates[0][1] else ""
    since = (first - datetime(1970, 1, 1)).total_seconds()
    return seconds, since, first.isoformat(timespec="seconds") + zone


def date_order(texts: Sequence[str], places: Sequence[str]) -> str:
    """Return the order of day and month in dates.

    Parameters
    ----------
    texts : sequence of K str
        The cells.
    places : sequence of K str
        The place of each cell, for messages.

    Returns
    -------
    str
        ``day_first`` or ``month_first``; empty if it makes no difference.

    Raises
    ------
    CapsuleError
        If both orders are possible.
    """
    matches = [_DAY_AND_MONTH.fullmatch(str(text).strip()) for text in texts]
    pairs = {(int(match[1]), int(match[3])) for match in matches if match}
    first, second = any(a > 12 for a, _ in pairs), any(b > 12 for _, b in pairs)
    if not pairs:
        return ""
    if first:
        return "day_first"
    if second:
        return "month_first"
    # Countries that write points between day and month write the day first.
    if all(match[2] == "." for match in matches if match):
        return "day_first"
    day, month = next(iter(pairs))
    if pairs == {(day, day)}:
        return ""
    raise QuestionError(
        f"{places[0]}: {str(texts[0])[:60]!r} can be day {day} of month {month} (--date-order "
        f"day_first) or day {month} of month {day} (--date-order month_first); choose one"
    )


def _date(text: str, order: str, place: str) -> tuple[datetime, bool]:
    """Return a date, and whether the text names a time zone."""
    stripped = text.strip()
    if match := _YEAR_FIRST.fullmatch(stripped):
        year, month, day, rest = int(match[1]), int(match[2]), int(match[3]), match[4]
    elif match := _DAY_AND_MONTH.fullmatch(stripped):
        year, rest = int(match[4]), match[5]
        first, second = int(match[1]), int(match[3])
        day, month = (second, first) if order == "month_first" else (first, second)
    else:
        raise CapsuleError(
            f"{place}: {text[:60]!r} is not a date with a time, such as 2026-03-04 12:34:56.789; "
            "correct the line, or name another column with --time"
        )
    zone = _ZONE.fullmatch(rest)
    seconds = _clock(zone[1] if zone else rest, place)
    try:
        date = datetime(year, month, day) + timedelta(seconds=seconds)
    except ValueError:
        raise CapsuleError(
            f"{place}: there is no day {day} of month {month} in {year}; "
            "correct the line, or use the other --date-order"
        ) from None
    named = zone[2] if zone else None
    if named and named not in ("Z", "UTC"):
        sign = -1 if named[0] == "-" else 1
        digits = named[1:].replace(":", "")
        date -= sign * timedelta(hours=int(digits[:2]), minutes=int(digits[2:]))
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


def since_1970(seconds: float) -> str:
    """Return seconds since 1970 as ISO 8601."""
    date = datetime.fromtimestamp(seconds, UTC)
    return date.isoformat(timespec="seconds").replace("+00:00", "Z")
