"""The faults of an accepted recording in words: gaps, and loose sensors."""

import numpy as np

from capsule.recordings.quality import quality_words
from capsule.recordings.units import shares_at_ends


def readings(samples=200):
    return 400.0 + np.arange(4 * samples).reshape(4, samples) % 37


def quality(values):
    return quality_words(values, shares_at_ends(values, {"adc_bits": "10"}), 10.0)


def test_of_a_good_recording_nothing_is_said_but_that():
    assert quality(readings()) == "no gap, no loose sensor"


def test_gaps_are_told_by_their_share_and_the_longest_one():
    values = readings()
    values[:, 10:14] = np.nan
    values[:, 50:62] = np.nan
    text = quality(values)
    assert text == "gaps: 8 % of the samples, the longest 1.2 s"


def test_a_loose_sensor_is_named():
    values = readings()
    values[2, :40] = 0.0
    values[3, :3] = 1023.0
    values[1, 0] = 1023.0
    assert quality(values) == (
        "sensor 3 loose: at the end of its range in 20 % of the samples; "
        "sensor 4 loose: at the end of its range in 1.5 % of the samples"
    )


def test_missing_samples_are_no_loose_sensor():
    values = readings()
    values[2, :40] = 0.0
    values[:, 100:120] = np.nan
    text = quality(values)
    assert text.startswith("gaps: 10 % of the samples, the longest 2.0 s; sensor 3 loose")
    assert "in 22.2 % of" in text
