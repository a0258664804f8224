"""From the readings of a recording to its best candidate for a nodule, by the configuration."""

from collections.abc import Mapping

import numpy as np

from capsule.detectors.beats import find_beats
from capsule.detectors.divider import relative_resistance
from capsule.detectors.passage import UNKNOWN, Passage, find_passage

_OF_LEARNING = ("size_ridge",)


def search(values: np.ndarray, rate_hz: float, settings: Mapping) -> Passage:
    """Search one recording.

    Parameters
    ----------
    values : (S, K) array
        Readings on an even grid in time; NaN where a sample is missing.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Section ``diagonal`` of the configuration.

    Returns
    -------
    Passage
        `UNKNOWN` without a peristaltic wave on every sensor.
    """
    options = {key: value for key, value in settings.items() if key not in _OF_LEARNING}
    wavelength_mm, speed_mm_s = options.pop("wavelength_mm"), options.pop("wave_speed_mm_s")
    resistance = relative_resistance(
        values, options.pop("full_scale"), options.pop("pressing_lowers_reading")
    )
    period = rate_hz * wavelength_mm / speed_mm_s
    beats = find_beats(-resistance, period=period, wavelength_mm=wavelength_mm)
    return UNKNOWN if beats is None else find_passage(beats, **options)
