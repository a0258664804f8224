"""Recognise the names of units, and find the unit of a table's readings: counts, volts or ohms."""

import re
from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.table import QuestionError, Table
from capsule.recording import Recording

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
# A full scale up to this is in volts, a larger one in counts.
_HIGHEST_VOLTS = 60.0
_FIT_VOLTS = 5.5
_FIT_MILLIVOLTS = (100.0, 5500.0)
_FIT_OHMS = (100.0, 1e7)
_FIT_KILOOHMS = (0.1, 1e4)
_HIGHEST_COUNT = 65_535.0
# If the largest reading is below this, the readings are probably not counts.
_LEAST_COUNT = 64.0
# The unit's name in a recording, and the factor on the readings.
WRITTEN = {unit: (unit, 1.0) for unit in _READING} | {"mV": ("V", 1e-3)}
_NO_UNIT = (
    "fit no unit; if one of them marks a missing sample, name it with --missing, else give "
    "the unit with --unit"
)


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
    return bare in READING_UNITS or bare in TIME_UNITS or not bare


def plain_unit(text: str) -> str:
    """Return a unit's text in lower case, without brackets."""
    return text.strip().strip("[]()<>").strip().lower().replace("\u2126", "ω")


def reading_unit(
    table: Table, sensors: Sequence[int], keys: SimpleNamespace, full_scale: float
) -> tuple[str, str]:
    """Return the unit of the sensors' readings.

    Parameters
    ----------
    table : Table
        The table.
    sensors : sequence of S int
        Indices of the sensors' columns.
    keys : SimpleNamespace
        The keys of lab.yaml, of which ``unit`` is used.
    full_scale : float
        Reading of the configured converter at the supply voltage.

    Returns
    -------
    unit, reason : str
        The unit as lab.yaml names it, and the reason for it.

    Raises
    ------
    CapsuleError
        If the file names a unit that cannot be used, or names none and several fit.
    """
    if keys.unit:
        return keys.unit, "given"
    texts = {_named(table, index) for index in sensors} - {""}
    units = {READING_UNITS.get(plain_unit(text), "") for text in texts}
    label = table.column_label(sensors[0])
    if "" in units or len(units) > 1:
        raise CapsuleError(
            f"column {label}: the file names the unit {' and '.join(sorted(texts))!r}; allowed "
            "are counts, V, mV, ohm and kohm, the same for all sensors; use --unit if the "
            "readings have one of these units"
        )
    if units:
        return units.pop(), "named in the file"
    noted = READING_UNITS.get(plain_unit(table.notes.get("unit", "")))
    if noted:
        return noted, "named in the file"
    return _by_values(np.array([table.all_numbers(index) for index in sensors]), full_scale, label)


def _named(table: Table, index: int) -> str:
    if unit := table.units[index].strip():
        return unit
    bare, unit = split_unit(table.names[index])
    if plain_unit(unit) in READING_UNITS.keys() | OTHER_UNITS:
        return unit
    return "counts" if bare.lower().startswith("adc") else ""


def _by_values(values: np.ndarray, full_scale: float, label: str) -> tuple[str, str]:
    known = values[~np.isnan(values)]
    if known.size == 0:
        raise CapsuleError(f"column {label}: it has no reading; name other columns with --sensors")
    low, high = float(known.min()), float(known.max())
    whole = bool(np.all(known % 1.0 == 0))
    span = f"readings from {low:.6g} to {high:.6g}"
    if low >= 0 and whole and _LEAST_COUNT <= high < full_scale:
        reason = f"whole numbers up to {high:g}, below diagonal.full_scale {full_scale:g}"
        return "counts", reason
    if low >= 0 and not whole and high <= full_scale <= _HIGHEST_VOLTS:
        return "V", f"{span}, within diagonal.full_scale {full_scale:g}"
    averaged = not whole and _LEAST_COUNT <= high < full_scale
    fits = {
        "counts": low >= 0 and ((whole and high <= _HIGHEST_COUNT) or averaged),
        "V": low >= 0 and high <= _FIT_VOLTS,
        "mV": low >= 0 and _FIT_MILLIVOLTS[0] <= high <= _FIT_MILLIVOLTS[1],
        "ohm": _FIT_OHMS[0] <= low and high <= _FIT_OHMS[1],
        "kohm": (not whole or high < _LEAST_COUNT)
        and _FIT_KILOOHMS[0] <= low
        and high <= _FIT_KILOOHMS[1],
    }
    fitting = [unit for unit, fit in fits.items() if fit]
    if len(fitting) == 1:
        return fitting[0], f"{span} fit no other unit"
    options = " or ".join(f"{unit} (--unit {unit})" for unit in fitting)
    told = f"can be {options}; choose one" if fitting else _NO_UNIT
    raise QuestionError(f"column {label}: {span} {told}")


def advice(recording: Recording, full_scale: float) -> list[str]:
    """Return advice on the electronics' values that judging the readings still needs.

    Parameters
    ----------
    recording : Recording
        The recording as it is archived; its header names the unit.
    full_scale : float
        Reading of the configured converter at the supply voltage.
    """
    header, unit = recording.header, recording.header["unit"]
    highest = float(np.nanmax(recording.values, initial=0.0))
    if unit == "V" and "vref_v" not in header:
        return ["the supply voltage is unknown, so volts are judged as they are; use --vref-v"]
    if unit in ("ohm", "kohm") and "series_ohm" not in header:
        return [
            "the resistor in series is unknown, so the median resistance replaces it; "
            "use --series-ohm"
        ]
    if unit == "counts" and "adc_bits" not in header and highest >= full_scale:
        return [
            f"readings reach {highest:g}, but diagonal.full_scale is {full_scale:g}; use --adc-bits"
        ]
    return []
