"""Recognise the names of units, also within a column's name."""

import re

_READING = {
    "counts": "counts count adc raw lsb digits digit a.u. au adu",
    "V": "v volt volts",
    "mV": "mv millivolt millivolts",
    "ohm": "ohm ohms ω r",
    "kohm": "kohm kohms kω k kiloohm kiloohms kilo-ohm kilo-ohms",
}
_TIME = {
    "s": "s sec secs second seconds sekunden sek",
    "ms": "ms msec msecs millis millisecond milliseconds",
    "us": "us µs μs usec micros microsecond microseconds",
    "ns": "ns nsec nanos nanosecond nanoseconds",
    "min": "min mins minute minutes",
    "h": "h hour hours",
    "day": "d day days",
    "sample": "sample samples index frame frames",
}
READING_UNITS = {word: unit for unit, words in _READING.items() for word in words.split()}
TIME_UNITS = {word: unit for unit, words in _TIME.items() for word in words.split()}
# Units of other sensors.
_OTHER = "pa hpa kpa mpa bar mbar psi n mn kn g kg mm a ma c °c % pf nf ff hz khz db"
OTHER_UNITS = frozenset(_OTHER.split())
_BRACKETS = re.compile(r"(.*?)[\s_]*[\[(<]\s*([^\])>]*?)\s*[\])>]\s*")
_BEHIND = re.compile(r"(.*?)[\s_./]+([^\s_./]+)")


def split_unit(name: str) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit.

    Parameters
    ----------
    name : str
        For example ``time (ms)``, ``S1 [kOhm]`` or ``left_V``.

    Returns
    -------
    name, unit : str
        The name, and the unit as written; the unit is empty if there is none.
    """
    match = _BRACKETS.fullmatch(name)
    # data[0] and V(1) are numbered columns.
    if match and not match[2].isdecimal():
        return match[1], match[2]
    match = _BEHIND.fullmatch(name)
    # Most single letters after a blank are names, not units: sensor A, sensor R.
    if match and match[2].lower() in READING_UNITS | TIME_UNITS:
        letter = len(match[2]) == 1 and match[2].lower() not in ("v", "s")
        if not letter:
            return match[1], match[2]
    return name, ""


def is_unit(text: str) -> bool:
    """Return whether a cell is empty or a unit, with or without brackets."""
    bare = text.strip().strip("[]()<>").strip().lower()
    return bare in READING_UNITS or bare in TIME_UNITS or bare == ""


def plain_unit(text: str) -> str:
    """Return a unit's text in lower case, without brackets."""
    return text.strip().strip("[]()<>").strip().lower().replace("\u2126", "ω")
