"""From the readings of a voltage divider to the resistance of the sensor in it."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.kinds import Settings

# Nearer to the ends of the converter a reading says no more than "very small" or "very large".
_ENDS = 0.02


def relative_resistance(
    readings: FloatArray, full_scale: float, pressing_lowers: bool
) -> FloatArray:
    """Give each sensor's resistance in units of the resistor in series with it.

    The reading is a curved function of the resistance: a sensor whose rest value has drifted
    answers the same press with a smaller or larger change of the voltage. Its resistance does not.

    Parameters
    ----------
    readings : (S, K) array
        Readings in any unit; NaN where a sample is missing.
    full_scale : float
        What the supply voltage itself would read, such as 1024 for a 10 bit converter that refers
        to it.
    pressing_lowers : bool
        Whether a pressed sensor, whose resistance falls, reads less: the voltage is taken across
        the sensor, ``R / (R + R_series)``; otherwise across the other resistor.

    Returns
    -------
    (S, K) array
        ``R / R_series``. Readings of which some lie outside 0 to `full_scale`, or all near 0 (volts
        or kilo-ohms where counts are configured), are of no such divider; they are given back as
        they are, turned so that pressing lowers them.
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
        Section ``diagonal`` of the configuration, which tells of wave and sensors.

    Returns
    -------
    pressed : (S, K) array
        Larger for a sensor that is pressed harder, from any rest.
    period : float
        In samples.
    """
    resistance = relative_resistance(
        values, settings["full_scale"], settings["pressing_lowers_reading"]
    )
    return -resistance, rate_hz * settings["wavelength_mm"] / settings["wave_speed_mm_s"]
