"""Find the unit of a table's readings: counts, volts or ohms."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.question import QuestionError
from capsule.importing.source_table import SourceTable
from capsule.importing.unit_names import OTHER_UNITS, READING_UNITS, plain_unit, split_unit
from capsule.recording import Recording

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
WRITTEN = {
    "counts": ("counts", 1.0),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    "ohm": ("ohm", 1.0),
    "kohm": ("kohm", 1.0),
}
_NO_UNIT = (
    "fit no unit; if one of them marks a missing sample, name it with --missing, else give "
    "the unit with --unit"
)


@dataclass(frozen=True)
class ReadingUnit:
    """The unit of the readings, as lab.yaml names it, and the reason for it."""

    unit: str
    reason: str


def reading_unit(
    table: SourceTable, sensors: Sequence[int], keys: SimpleNamespace, full_scale: float
) -> ReadingUnit:
    """Return the unit of the sensors' readings.

    Parameters
    ----------
    table : SourceTable
        The table.
    sensors : sequence of S int
        Indices of the sensors' columns.
    keys : SimpleNamespace
        The keys of lab.yaml, of which ``unit`` is used.
    full_scale : float
        Reading of the configured converter at the supply voltage.

    Raises
    ------
    CapsuleError
        If the file names a unit that cannot be used, or names none and several fit.
    """
    if keys.unit:
        return ReadingUnit(keys.unit, "given")
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
        return ReadingUnit(units.pop(), "named in the file")
    noted = READING_UNITS.get(plain_unit(table.notes.get("unit", "")))
    if noted:
        return ReadingUnit(noted, "named in the file")
    return _by_values(np.array([table.numbers(index) for index in sensors]), full_scale, label)


def _named(table: SourceTable, index: int) -> str:
    column = table.columns[index]
    if column.unit.strip():
        return column.unit.strip()
    bare, unit = split_unit(column.name)
    if unit and (plain_unit(unit) in READING_UNITS or plain_unit(unit) in OTHER_UNITS):
        return unit
    return "counts" if bare.lower().startswith("adc") else ""


def _by_values(values: np.ndarray, full_scale: float, label: str) -> ReadingUnit:
    known = values[~np.isnan(values)]
    if known.size == 0:
        raise CapsuleError(f"column {label}: it has no reading; name other columns with --sensors")
    low, high = float(known.min()), float(known.max())
    whole = bool(np.all(known % 1.0 == 0))
    span = f"readings from {low:.6g} to {high:.6g}"
    if low >= 0 and whole and _LEAST_COUNT <= high < full_scale:
        reason = f"whole numbers up to {high:g}, below diagonal.full_scale {full_scale:g}"
        return ReadingUnit("counts", reason)
    if low >= 0 and not whole and high <= full_scale <= _HIGHEST_VOLTS:
        return ReadingUnit("V", f"{span}, within diagonal.full_scale {full_scale:g}")
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
        return ReadingUnit(fitting[0], f"{span} fit no other unit")
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
