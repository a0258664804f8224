"""Units of readings: counts of an ADC, volts, resistances; and the divider that links them."""

from collections.abc import Mapping

import numpy as np

from capsule.arrays import FloatArray, NumberArray
from capsule.errors import RecordingError
from capsule.kinds import Settings
from capsule.recordings.recording import header_number

# Bits of usual ADCs, tried if no header line states them.
_USUAL_BITS = (8, 10, 12, 14, 16)
# Units of resistance that the header line ``unit`` may name, in ohms.
_OHMS = {"ohm": 1.0, "kohm": 1000.0}
# A converter and its supply differ a little: readings may lie above the reference by this factor.
_MOST_ABOVE = 1.1
# Share of the full scale. Nearer to its ends, a reading only means "very small" or "very large".
_ENDS = 0.02


def on_full_scale(
    values: FloatArray, header: Mapping[str, str], full_scale: float, pressing_lowers: bool
) -> FloatArray:
    """Return readings on the configured full scale, converted from the unit of the recording.

    Parameters
    ----------
    values : (S, K) array
        Readings; NaN where a sample is missing.
    header : mapping of str to str
        The recording's header. ``adc_bits`` describes counts, ``vref_v`` volts. Resistances have
        ``unit: ohm`` or ``unit: kohm``, and ``series_ohm``.
    full_scale, pressing_lowers
        As `capsule.recordings.units.relative_resistance` takes them.

    Returns
    -------
    (S, K) array
        The readings that the configured ADC would give; unchanged if the header states no scale.

    Raises
    ------
    RecordingError
        The header names an unknown unit, or one in which the readings cannot be.
    """
    unit = _stated_unit(header)
    if unit in _OHMS:
        ohms = values * _OHMS[unit]
        if np.nanmin(ohms) <= 0:
            raise RecordingError(
                f"the header says unit: {unit}, but a reading is {np.nanmin(values):g}; "
                "every resistance must be above 0"
            )
        # If the resistor in series is unknown, the median resistance stands in for it.
        series = header_number(header, "series_ohm") or float(np.nanmedian(ohms))
        across = ohms if pressing_lowers else series
        return full_scale * across / (ohms + series)
    bits, vref_v = header_number(header, "adc_bits"), header_number(header, "vref_v")
    if unit == "v":
        _check_volts(values, vref_v)
    top = vref_v if not adc_ends(header, values)[0] else 2.0**bits if bits else None
    return values * (full_scale / top) if top and top != full_scale else values


def _stated_unit(header: Mapping[str, str]) -> str:
    """Return the unit that the header names, in small letters; empty if it names none."""
    unit = header.get("unit", "").lower()
    if unit not in ("", "counts", "v", *_OHMS):
        raise RecordingError(
            f"the header says unit: {unit[:60]!r}; allowed are counts, V, ohm and kohm"
        )
    return unit


def _check_volts(values: FloatArray, vref_v: float | None) -> None:
    """Raise an error if readings cannot be volts."""
    highest = float(np.nanmax(values))
    if _are_whole(values) or (vref_v and highest > _MOST_ABOVE * vref_v):
        above = f"above vref_v: {vref_v:g}" if vref_v and highest > vref_v else "all whole numbers"
        raise RecordingError(
            f"the header says unit: V, but the readings go up to {highest:g}, {above}; write the "
            "unit in which they are: counts, V, ohm or kohm"
        )


def _are_whole(values: NumberArray) -> bool:
    """Return whether all readings are whole numbers; a missing one is NaN."""
    return bool(np.all((values % 1.0 == 0) | np.isnan(values)))


def reading_unit(header: Mapping[str, str], values: FloatArray) -> str:
    """Return the unit of readings (S, K) from `on_full_scale`: ``counts`` or ``V``."""
    brought = header.get("vref_v") or _stated_unit(header) in _OHMS
    return "counts" if brought or adc_ends(header, values)[0] else "V"


def adc_ends(
    header: Mapping[str, str], values: NumberArray
) -> tuple[bool, list[tuple[float, float]]]:
    """Return whether readings are counts, and the bands of values at the ends of the ADC's range.

    The last band is the highest; resistances have none. A unit that the header names decides.
    """
    unit = _stated_unit(header)
    bits, vref_v = header_number(header, "adc_bits"), header_number(header, "vref_v")
    if bits is not None and not (bits.is_integer() and 1 <= bits <= 32):
        raise RecordingError(
            f"the header says adc_bits: {header['adc_bits']!r}; allowed is a whole number, 1 to 32"
        )
    if unit in _OHMS:
        return False, []
    # Averaged counts need not be whole numbers. Volts never exceed the reference.
    above = bool(np.nanmax(values) > 2 * vref_v) if vref_v else bits is not None
    if unit == "counts" or (not unit and (_are_whole(values) or above)):
        # If most readings are 2^n - 1, that is the end of the range, even if no header states n.
        tops = [float(2 ** int(n) - 1) for n in ([bits] if bits else _USUAL_BITS)]
        return True, [(0.0, 0.0), *((top, top) for top in tops)]
    step = (vref_v or 0.0) / 2 ** (bits or 10)
    # A program may divide by 2^n or by 2^n - 1: the highest value is within one step of vref_v.
    top = [(vref_v - 1.5 * step, vref_v + step)] if vref_v else []
    return False, [(0.0, step / 2), *top]


def shares_at_ends(values: NumberArray, header: Mapping[str, str]) -> list[float]:
    """Return for each sensor the largest share of its samples at one end of the ADC's range.

    Parameters
    ----------
    values : (S, K) array
        The readings of an accepted recording, in their recorded unit; NaN where a sample is
        missing.
    header : mapping of str to str
        The recording's header.
    """
    _, ends = adc_ends(header, values)
    known = [readings[~np.isnan(readings)] for readings in values]
    return [max((share_between(each, *band) for band in ends), default=0.0) for each in known]


def share_between(known: NumberArray, below: float, above: float) -> float:
    """Return the share of readings (n,) between two values, both included."""
    return float(np.mean((known >= below) & (known <= above)))


def relative_resistance(
    readings: FloatArray, full_scale: float, pressing_lowers: bool
) -> FloatArray:
    """Return each sensor's resistance in units of the resistor in series with it.

    The reading is not proportional to the resistance. If the rest value of a sensor drifts, the
    same press changes the voltage by more or by less. The change of the resistance stays the same.

    Parameters
    ----------
    readings : (S, K) array
        Readings in any unit; NaN where a sample is missing.
    full_scale : float
        Reading of the supply voltage itself, such as 1024 for a 10 bit ADC that refers to it.
    pressing_lowers : bool
        True if pressing lowers the reading: the voltage is taken across the sensor,
        ``R / (R + R_series)``. False if it is taken across the other resistor.

    Returns
    -------
    (S, K) array
        ``R / R_series``. Some readings cannot come from such a divider: they lie outside 0 to
        `full_scale`, or all lie near 0 (volts or kilo-ohms where counts are configured). Such
        readings are returned unconverted, with the sign that makes pressing lower them.
    """
    lowest, highest = np.fmin.reduce(readings, axis=None), np.fmax.reduce(readings, axis=None)
    if lowest < 0 or not _ENDS * full_scale < highest <= full_scale:
        return readings if pressing_lowers else -readings
    share = np.clip(readings / full_scale, _ENDS, 1 - _ENDS)
    return share / (1 - share) if pressing_lowers else (1 - share) / share


def pressed_and_period(
    values: FloatArray, rate_hz: float, settings: Settings
) -> tuple[FloatArray, float]:
    """Return how hard each sensor is pressed, and the configured time from wave to wave.

    Parameters
    ----------
    values : (S, K) array
        Readings on an even grid in time; NaN where a sample is missing.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Section ``diagonal`` of the configuration, which describes wave and sensors.

    Returns
    -------
    pressed : (S, K) array
        Larger if a sensor is pressed harder; the value at rest is arbitrary.
    period : float
        Configured time from wave to wave, in samples.
    """
    resistance = relative_resistance(
        values, settings["full_scale"], settings["pressing_lowers_reading"]
    )
    return -resistance, rate_hz * settings["wavelength_mm"] / settings["wave_speed_mm_s"]
