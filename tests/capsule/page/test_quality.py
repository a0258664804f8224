"""The faults of an accepted recording in words: gaps, and loose sensors."""

import numpy as np

from capsule.page.quality_map import quality_words
from capsule.recordings.units import shares_at_ends


def readings(samples=200):
    return 400.0 + np.arange(4 * samples).reshape(4, samples) % 37


def quality(values):
    return quality_words(values, shares_at_ends(values, {"adc_bits": "10"}), 10.0)


def test_gaps_are_told_by_their_share_and_the_longest_and_loose_sensors_by_name():
    values = readings()
    assert quality(values) == ""
    values[:, 10:14] = values[:, 50:62] = np.nan
    gaps = "gaps: 8 % of the samples, the longest 1.2 s"
    assert quality(values) == gaps
    values[2, 100:140] = 0.0
    values[3, :3] = values[1, 0] = 1023.0
    # Of the samples that are there: 40 and 3 of 184.
    assert quality(values) == (
        f"{gaps}; sensor 3 loose: at the end of its range in 21.7 % of the samples; "
        "sensor 4 loose: at the end of its range in 1.6 % of the samples"
    )
