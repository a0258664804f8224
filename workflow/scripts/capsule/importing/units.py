"""Recognise the names of units, alone and behind the names of columns."""

import re

# The words for each unit of readings, and of the time.
_WORDS = {
    "counts": "counts count adc raw lsb digits digit adu codes",
    "V": "v volt volts vdc",
    "mV": "mv mvdc mvolt mvolts millivolt millivolts milli-volt milli-volts",
    "ohm": "ohm ohms ω r",
    "kohm": "kohm kohms kω k kiloohm kiloohms kilo-ohm kilo-ohms",
    "s": "s sec secs second seconds sekunden sek",
    "ms": "ms msec msecs millis millisecond milliseconds",
    "us": "us µs μs usec micros microsecond microseconds",
    "ns": "ns nsec nanos nanosecond nanoseconds",
    "min": "min mins minute minutes",
    "h": "h hour hours",
    "day": "d day days",
    "sample": "sample samples index frame frames",
}
_UNITS = {"": ""} | {word: unit for unit, words in _WORDS.items() for word in words.split()}
_UNITS |= dict.fromkeys(["adc counts", "raw counts", "adc codes"], "counts")
# Seconds of each unit of time.
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "day": 86_400.0}
# Units of other sensors, and of other clocks, that may stand behind a name; also as a quotient.
_ONE = (
    r"(da|[fpnuµμmcdhkgt])?(pa|bar|n|g|gf|m|m[23]|a|w|j|l|t|c|f|hz|nm|rad|strain|ε|e|oe|v|s|ω|ohms?)|"
    r"psi|mmhg|inhg|torr|atm|[cm]mh2o|inh2o|lbf?|ozf?|kp|dyne?|gauss|ft|in|deg[cf]?|°c?|%(fs)?|min|h|"
    r"db[mv]?|ppm|[mu]?v(pp|rms)|s\^?2|kcounts?|(milli|micro)?siemens|(hecto|kilo|mega)?pascals?|"
    r"newtons?|(kilo|milli)?grams?([ -]force)?|(micro|milli)?[ -]?teslas?|micro-?strain|"
    r"(micro|nano|kilo|centi|deci)[ -]?volts?|(mega|milli)ohms?|pct|per ?cent"
)
_OTHER = re.compile(
    rf"({_ONE})([/·*]({_ONE}))?|cs|ds|ps|(centi|deci)-?seconds?|((clock|sys)[ _]?)?ti(ck|c)s?|"
    r"filetime|pts|rtc|(clock[ _]?)?cycles|"
    rf"jiffies|tenths?|hundredths?|thousandths?|[0-9./]+ ?({_ONE}|sec)"
)
_NAMES_TIME = re.compile(
    r"(time|t|timestamps?|time[ _]?stamps?|stamp|elapsed.*|zeit(stempel)?|temps|tiempo|tempo|"
    r"uhrzeit|millis.*|micros.*|date.?time|datum.*|date|clock|seconds|secs?|ms|us|x_value):?",
    re.IGNORECASE,
)
_BRACKETS = re.compile(r"(.*?)[\s_]*[\[(<{]\s*([^\])>}]*?)\s*[\])>}]\s*")
# As in "pressure kPa 1".
NUMBER = re.compile(r"[\s_.#-]+[0-9]+$")
_BEHIND = re.compile(r"(.*?)[\s_.,/]+((?:[^\s_./]+/)?[^\s_./]+)")
# A unit of time with a factor: time_10 us, time_us_x10, time (us) / 10.
_WITH_FACTOR = re.compile(
    r"(.*?)(?:[\s_]+in)?[\s_.,/(\[]*("
    r"[x*]? ?(?:[0-9]{2,}|[0-9]*[./][0-9]+)[\s_]*[mnuµμ]?s(?:ec)?|"
    r"[mnuµμ]?s(?:ec)?[)\]]?[\s_(\[]*(?:[x*/\u00d7]|div) ?[0-9.]+)[)\]]?"
)
_IN = re.compile(r"(.+?)[\s_]+in[\s_]+(\S+)")
# If the largest reading is below this, the readings are probably not counts; nor are decimals with
# a largest reading so many times the smallest: there a point separates thousands.
LEAST_COUNT, THOUSANDFOLD = 64.0, 30.0
# The unit's name in a recording, and the factor on the readings.
WRITTEN = {unit: (unit, 1.0) for unit in ("counts", "V", "ohm", "kohm")} | {"mV": ("V", 1e-3)}


def split_unit(name: str) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit as written; empty if there is none.

    Names are, for example, ``time (ms)``, ``S1 [kOhm]`` and ``left_V``.
    """
    match = _WITH_FACTOR.fullmatch(name)
    if match and (not match[1] or _NAMES_TIME.fullmatch(match[1])):
        return match[1], match[2]
    match = _BRACKETS.fullmatch(name)
    # data[0] and V(1) are numbered columns.
    if match and not match[2].isdecimal():
        return match[1], match[2]
    bare = NUMBER.sub("", name)
    if (match := _IN.fullmatch(bare)) and is_unit(match[2]):
        return match[1], match[2]
    match = _BEHIND.fullmatch(bare)
    # Most single letters after a blank are names, not units: sensor A, sensor R.
    if match and (len(match[2]) > 1 or match[2] in "vVsSΩΩ%") and is_unit(match[2]):
        return match[1], match[2]
    return name, ""


def is_time_name(name: str) -> bool:
    """Return whether a column's name, with or without a unit, is that of a time."""
    return bool(_NAMES_TIME.fullmatch(split_unit(name)[0].strip()))


def is_unit(text: str) -> bool:
    """Return whether a text names a unit, of whatever quantity."""
    word = text.strip().strip("[]()<>{}").strip().lower()
    return bool(word) and (word in _UNITS or bool(_OTHER.fullmatch(word)))


def unit_of(text: str) -> str | None:
    """Return the unit that a text with or without brackets names; None if it is not known.

    It is empty for an empty text.
    """
    return _UNITS.get(text.strip().strip("[]()<>{}").strip().lower())


def is_time_unit(text: str) -> bool:
    """Return whether a text names a unit of time that is known."""
    return unit_of(text) in (*SECONDS, "sample")
