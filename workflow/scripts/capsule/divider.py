"""Conversion from the readings of a voltage divider to the resistance of its sensor."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.kinds import Settings

# Share of the full scale. Nearer to its ends, a reading only means "very small" or "very large".
_ENDS = 0.02


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
