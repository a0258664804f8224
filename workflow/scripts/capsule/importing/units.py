"""Recognise the names of units, and find the unit of a table's readings: counts, volts or ohms."""

import re
from collections.abc import Sequence

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.table import SCALE, QuestionError, Table, naming, scales
from capsule.recordings.names import displayed

# The words for each unit of readings, and of the time.
_WORDS = {
    "counts": "counts count adc raw lsb digits digit a.u. au adu",
    "V": "v volt volts",
    "mV": "mv mvolt mvolts millivolt millivolts milli-volt milli-volts",
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
# Units of other sensors, and of other clocks, that may stand behind a name; also as a quotient.
_ONE = (
    r"(da|[pnuµμmcdhkgt])?(pa|bar|n|g|gf|m|m[23]|a|w|j|l|t|c|f|hz|nm|rad|strain|ε|e|oe|v|s|ω|ohms?)|"
    r"psi|mmhg|inhg|torr|atm|[cm]mh2o|inh2o|lbf?|ozf?|kp|dyne?|gauss|ft|in|deg|°c?|%(fs)?|db|min|h|"
    r"(hecto|kilo|mega)?pascals?|newtons?|(kilo|milli)?grams?([ -]force)?|(micro|milli)?teslas?|"
    r"micro-?strain|(micro|nano|kilo)-?volts?|megaohms?|pct|per ?cent"
)
_OTHER = re.compile(
    rf"({_ONE})([/·*]({_ONE}))?|cs|ds|ps|(clock[ _]?)?ti(ck|c)s?|jiffies|tenths?|hundredths?|"
    r"thousandths?|[0-9./]+ ?([mnuµμ]?s|sec)"
)
_NAMES_TIME = re.compile(
    r"(time|t|timestamps?|time[ _]?stamps?|stamp|elapsed.*|zeit(stempel)?|temps|tiempo|tempo|"
    r"uhrzeit|millis.*|micros.*|date.?time|datum.*|date|clock|seconds|secs?|ms|us|x_value):?",
    re.IGNORECASE,
)
_BRACKETS = re.compile(r"(.*?)[\s_]*[\[(<{]\s*([^\])>}]*?)\s*[\])>}]\s*")
# As in "pressure kPa 1".
_NUMBER = re.compile(r"[\s_.#-]+[0-9]+$")
# What follows the number of a sensor and is short, or a share, or a multiple: no name, but a unit.
_BEHIND_NUMBER = re.compile(
    r"\D*[0-9]+[\s_/,:;-]*"
    r"(%.*|[Pp]ercent|[cdnµμu]?N|oz|g|[mµμun]?S|[*x\u00d7] ?[0-9.]+|.+[\s_*][x\u00d7] ?[0-9.]+)"
)
_BEHIND = re.compile(r"(.*?)[\s_.,/]+((?:[^\s_./]+/)?[^\s_./]+)")
_IN = re.compile(r"(.+?)[\s_]+in[\s_]+(\S+)")
# A full scale up to this is in volts, a larger one in counts.
_HIGHEST_VOLTS = 60.0
# Least reading, and range of the largest one, that fit a unit.
_FITS = {
    "counts": (0, 0, np.inf),
    "V": (0, 0, 5.5),
    "mV": (0, 100, 5500),
    "ohm": (100, 100, 1e7),
    "kohm": (0.1, 0.1, 1e4),
}
_HIGHEST_COUNT = 65_535.0
# If the largest reading is below this, the readings are probably not counts; nor are decimals with
# a largest reading so many times the smallest: there a point separates thousands.
LEAST_COUNT, THOUSANDFOLD = 64.0, 30.0
# The unit's name in a recording, and the factor on the readings.
WRITTEN = {unit: (unit, 1.0) for unit in ("counts", "V", "ohm", "kohm")} | {"mV": ("V", 1e-3)}


def split_unit(name: str) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit as written; empty if there is none.

    Names are, for example, ``time (ms)``, ``S1 [kOhm]`` and ``left_V``.
    """
    match = _BRACKETS.fullmatch(name)
    # data[0] and V(1) are numbered columns.
    if match and not match[2].isdecimal():
        return match[1], match[2]
    bare = _NUMBER.sub("", name)
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


def reading_unit(table: Table, sensors: Sequence[int], keys: Keys) -> tuple[str, str]:
    """Return the unit of the sensors' readings, as lab.yaml names it, and the reason for it.

    `sensors` holds the indices of the columns. Of the keys, ``unit`` and ``full_scale`` are used.

    Raises
    ------
    CapsuleError
        If the file names a unit that cannot be used, or names none and several fit.
    """
    if keys.unit:
        return keys.unit, "given"
    for key, value in table.notes.items():
        if SCALE.fullmatch(key) and scales(key, value):
            raise QuestionError(
                f"the file states {displayed(key)} = {displayed(value)[:60]}, and not whether it "
                "is applied already; if it is, or is not needed, give the unit of the readings "
                "with --unit, or else convert them first"
            )
    texts = [_named(table, index) for index in sensors]
    # Different texts that are no units, such as (left) and (right), are names.
    if len({*texts}) == len(texts) > 1 and not any(map(is_unit, texts)):
        texts = [""] * len(texts)
    noted = table.notes.get("unit", "")
    for at, index in enumerate(sensors):
        is_adc = split_unit(table.names[index])[0].lower().startswith("adc")
        texts[at] = texts[at] or ("counts" if is_adc else noted)
    units = [unit_of(text) or "" for text in texts]
    if not any(texts):
        values = np.concatenate([table.checked_numbers(table.channels[index]) for index in sensors])
        with naming(f"column {table.column_label(table.channels[sensors[0]])}"):
            return _by_values(values[~np.isnan(values)], keys.full_scale)
    if units[0] not in WRITTEN or len({*units}) > 1:
        alike = len({*texts}) == 1
        named = ", ".join(
            f"{displayed(text)[:60] or 'no unit'} of {table.column_label(table.channels[index])}"
            for index, text in zip(sensors[: 1 if alike else None], texts, strict=False)
        )
        raise QuestionError(
            f"the file names {named}{' and all others' if alike and len(texts) > 1 else ''}; "
            "allowed are counts, V, mV, ohm and kohm, the same for all sensors; use --unit if the "
            "readings have one of these units, or else convert them first"
        )
    return units[0], "named in the file"


def _named(table: Table, index: int) -> str:
    """Return the unit that the file names for a column, known or not; empty if it names none."""
    _, unit = split_unit(table.names[index])
    # Behind a name, as in S1_min, a unit of time is a word.
    bare = _NUMBER.sub("", table.names[index])
    is_word = unit_of(unit) not in (None, *WRITTEN) and bare.endswith(unit)
    if is_unit(name := table.names[index]) and table.names.count(name) > 1:
        unit, is_word = name, False
    if match := _BEHIND_NUMBER.fullmatch(name):
        unit, is_word = match[1], False
    return table.channels[index].unit.strip() or ("" if is_word else unit)


def _by_values(known: np.ndarray, full_scale: float) -> tuple[str, str]:
    """Return the unit that fits all readings, of which none is missing, and the reason."""
    if known.size == 0:
        raise CapsuleError("it has no reading; name other columns with --sensors")
    low, high = float(known.min()), float(known.max())
    whole, below_scale = bool(np.all(known % 1.0 == 0)), LEAST_COUNT <= high < full_scale
    jumps = below_scale and not whole and high > THOUSANDFOLD * low
    span = f"readings from {low:.6g} to {high:.6g}"
    if low >= 0 and whole and below_scale:
        reason = f"whole numbers up to {high:g}, below diagonal.full_scale {full_scale:g}"
        return "counts", reason
    if low >= 0 and not whole and high <= full_scale <= _HIGHEST_VOLTS:
        return "V", f"{span}, within diagonal.full_scale {full_scale:g}"
    likely = {
        # Averaged counts are not whole, and kilo-ohms hardly ever are.
        "counts": high <= _HIGHEST_COUNT if whole else below_scale and not jumps,
        "kohm": not whole or high < LEAST_COUNT,
    }
    fitting = [
        unit
        for unit, (least, lowest, highest) in _FITS.items()
        if least <= low and lowest <= high <= highest and likely.get(unit, True)
    ]
    if len(fitting) == 1 and not jumps:
        return fitting[0], f"{span} fit no other unit"
    if not fitting:
        raise QuestionError(
            f"{span} fit no unit; if one of them marks a missing sample, name it with --missing, "
            "else give the unit with --unit"
        )
    options = " or ".join(f"{unit} (--unit {unit})" for unit in fitting)
    other = ", or --thousands point if points separate thousands" if jumps else ""
    raise QuestionError(f"{span} can be {options}; choose one{other}")
