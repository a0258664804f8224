import numpy as np
import pytest

from capsule.detectors.beats import Beats
from capsule.detectors.diagonal import find_passage, standardised_beats
from capsule.seeding import generator

SEARCH = {
    "level_weight": 0.0,
    "depth_weight": 1.0,
    "shape_weight": 0.0,
    "least_spread": 0.2,
    "limit": 4.0,
    "pitch_mm": 6.0,
    "lag_range": (80.0, 300.0),
    "lags": 12,
    "step_mm": 0.5,
    "width_mm": 1.0,
    "dwell": 12.0,
}


def passing(height, place_mm=7.0, speed=0.045, sensors=(0, 1, 2, 3), irregular=0.0):
    """Beats of a capsule whose sensors, a pitch apart, pass one place."""
    centre = np.arange(16.0, 685.0)
    irregular_mm = irregular * np.sin(centre / 60.0)
    head_mm = speed * centre + irregular_mm - irregular_mm[0]
    channels = generator(1, "diagonal").normal(0.0, 0.05, (3, 4, centre.size))
    for sensor in sensors:
        channels[1, sensor] += height * np.exp(
            -0.5 * ((head_mm - 6.0 * sensor - place_mm) / 1.5) ** 2
        )
    return Beats(channels, centre, irregular_mm)


def test_a_nodule_is_found_where_it_lies():
    passage = find_passage(passing(0.5), **SEARCH)
    assert passage.location_mm == pytest.approx(7.0, abs=1.0)
    assert passage.location_samples == pytest.approx(7.0 / 0.045, abs=20)
    assert passage.lag_samples == pytest.approx(6.0 / 0.045, rel=0.15)
    assert 0.2 < passage.depth < 0.5


def test_one_event_past_all_sensors_counts_more_than_one_under_a_single_sensor():
    everywhere = find_passage(passing(0.3), **SEARCH).evidence
    single = find_passage(passing(0.3, sensors=(1,)), **SEARCH).evidence
    nothing = find_passage(passing(0.0), **SEARCH).evidence
    assert everywhere > 2 * single > 2 * nothing > 0


def test_irregular_motion_is_undone():
    steady = find_passage(passing(0.3), **SEARCH).evidence
    irregular = find_passage(passing(0.3, irregular=3.0), **SEARCH).evidence
    assert irregular == pytest.approx(steady, rel=0.15)


def test_a_restless_sensor_says_less_and_a_single_beat_not_everything():
    beats = passing(0.0)
    beats.channels[1, 2] *= 40
    beats.channels[1, 0, 300] = 1e6
    weighed = standardised_beats(beats, {"level": 0.0, "depth": 1.0, "shape": 0.0}, 0.2, 4.0)
    assert weighed[2].std() == pytest.approx(1.0, rel=0.3)
    assert weighed[1].std() == pytest.approx(0.05 / np.hypot(0.2, 0.05), rel=0.2)
    assert weighed.max() == 4.0


def test_the_search_is_repeatable():
    assert find_passage(passing(0.3), **SEARCH) == find_passage(passing(0.3), **SEARCH)
