"""Say what is wrong with an accepted recording, if anything: gaps, and loose sensors."""

from collections.abc import Sequence

import numpy as np

from capsule import words
from capsule.arrays import FloatArray
from capsule.recordings.time_base import longest_gap

# The quality of a recording without a fault.
NO_FAULT = "no gap, no loose sensor"
# Below this share at an end of the range, a sensor is more likely pressed hard than loose.
_LOOSE_FROM = 0.01


def quality_words(values: FloatArray, at_ends: Sequence[float], rate_hz: float) -> str:
    """Return the faults of an accepted recording in words, or that it has none.

    Parameters
    ----------
    values : (S, K) array
        The readings on an even grid in time; NaN where a sample is missing.
    at_ends : sequence of S floats
        For each sensor, the largest share of its samples at one end of the ADC's range, from
        `capsule.recordings.units.shares_at_ends`.
    rate_hz : float
        Sampling rate.
    """
    faults = []
    _, longest = longest_gap(values)
    if longest:
        missing = float(np.isnan(values).all(axis=0).mean())
        faults.append(
            f"gaps: {words.percent(missing)} of the samples, the longest "
            f"{words.number(longest / rate_hz, 1)} s"
        )
    for sensor, share in enumerate(at_ends, start=1):
        if share >= _LOOSE_FROM:
            faults.append(
                f"sensor {sensor} loose: at the end of its range in {words.percent(share)} of the "
                "samples"
            )
    return "; ".join(faults) or NO_FAULT
