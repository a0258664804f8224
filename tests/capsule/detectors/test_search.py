"""The search finds where the beats of all sensors agree."""

from dataclasses import astuple

import numpy as np
import pytest

from capsule.detectors.search import UNKNOWN, Beats, passage_of, search_beats, standardised_beats
from capsule.detectors.wave import wave_of
from capsule.engine.configuration import read_config_file
from capsule.seeding import generator
from support.project import ROOT

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")["diagonal"]
SEARCH = {"level_weight": 0.0, "depth_weight": 1.0, "shape_weight": 0.0, "least_spread": 0.2}
SEARCH |= {"limit": 4.0, "pitch_mm": 6.0, "lag_range": (80.0, 300.0), "lags": 12}
SEARCH |= {"step_mm": 0.5, "width_mm": 1.0, "dwell": 12.0}


def passing(height, place_mm=7.0, speed=0.045, sensors=(0, 1, 2, 3)):
    """Return the beats of a capsule whose sensors, a pitch apart, pass one place."""
    centre = np.arange(16.0, 685.0)
    head_mm = speed * centre
    channels = generator(1, "diagonal").normal(0.0, 0.05, (3, 4, centre.size))
    for sensor in sensors:
        channels[1, sensor] += height * np.exp(
            -0.5 * ((head_mm - 6.0 * sensor - place_mm) / 1.5) ** 2
        )
    return Beats(channels, centre, 0 * centre)


def test_a_nodule_is_found_where_it_lies():
    passage = search_beats(passing(0.5), SEARCH)[0]
    assert passage.location_mm == pytest.approx(7.0, abs=1.0)
    assert passage.location_samples == pytest.approx(7.0 / 0.045, abs=20)
    assert passage.lag_samples == pytest.approx(6.0 / 0.045, rel=0.15)
    assert 0.2 < passage.depth < 0.5


def written_out(beats, weighted, search):
    """Return the averages of the weighted beats and of the channels at every place and speed."""
    behind_mm = search["pitch_mm"] * np.arange(weighted.shape[0])
    dwell = search["dwell"] / (beats.centre[1] - beats.centre[0])
    shortest, longest = search["lag_range"]
    for speed in np.linspace(
        search["pitch_mm"] / longest, search["pitch_mm"] / shortest, search["lags"]
    ):
        head_mm = beats.irregular_mm - beats.irregular_mm[0] + speed * beats.centre
        farthest_mm = max(head_mm.max() - behind_mm[behind_mm.size // 2], 0.0)
        for place_mm in np.arange(0.0, farthest_mm + search["step_mm"] / 2, search["step_mm"]):
            averages = []
            for sensor, behind in enumerate(behind_mm):
                off = (head_mm - behind - place_mm) / search["width_mm"]
                presence = np.exp(-(off**2) / 2)
                values = np.vstack([weighted[sensor], beats.channels[:, sensor]])
                averages.append((values * presence).sum(axis=1) / (presence.sum() + dwell))
            yield search["pitch_mm"] / speed, place_mm, np.mean(averages, axis=0)


@pytest.mark.parametrize("number", range(20))
def test_the_search_finds_what_the_formula_written_out_finds(number):
    numbers = generator(number, "written out")
    sensors, windows = numbers.integers(1, 7), numbers.integers(20, 200)
    # With a long pitch, most sensors reach hardly any place.
    search = SEARCH | {
        "pitch_mm": numbers.uniform(1.0, 15.0),
        "lags": numbers.integers(1, 20),
        "step_mm": numbers.uniform(0.2, 2.0),
        "width_mm": numbers.uniform(0.3, 3.0),
        "dwell": numbers.choice([1.0, 12.0, 100.0]),
        "limit": numbers.uniform(1.0, 5.0),
        "level_weight": numbers.uniform(-1.0, 1.0),
        "shape_weight": numbers.uniform(0.0, 1.0),
    }
    centre = 16.0 + numbers.integers(1, 8) * np.arange(windows)
    channels = numbers.normal(0.0, 0.3, (3, sensors, windows))
    beats = Beats(channels, centre, numbers.normal(0.0, 0.2, windows).cumsum())
    weighted = standardised_beats(beats, search)
    # A restless sensor says less, and a single beat not everything.
    weights = [search[f"{name}_weight"] for name in ("level", "depth", "shape")]
    total = np.tensordot(weights, channels, 1)
    low, middle = np.quantile(total, [0.25, 0.5], axis=1, keepdims=True)
    in_spreads = total / np.hypot(search["least_spread"], (middle - low) / 0.6745)
    np.testing.assert_allclose(weighted, in_spreads.clip(-search["limit"], search["limit"]))
    passage, along, beyond_mm = search_beats(beats, search)
    tried = {(lag, place): found for lag, place, found in written_out(beats, weighted, search)}
    assert passage.evidence == pytest.approx(max(found[0] for found in tried.values()), abs=2e-6)
    places = sorted({place for _, place in tried})
    most = [max(tried[each][0] for each in tried if each[1] == place) for place in places]
    np.testing.assert_allclose(along, most, atol=2e-6)
    head_mm = search["pitch_mm"] / passage.lag_samples * centre - beats.irregular_mm[0]
    np.testing.assert_allclose(beyond_mm, head_mm + beats.irregular_mm - passage.location_mm)
    best = passage.lag_samples, passage.location_mm
    (there,) = (tried[each] for each in tried if each == pytest.approx(best, rel=1e-12))
    np.testing.assert_allclose(astuple(passage)[:4], there, rtol=1e-12, atol=1e-14)
    spreads = [np.mean(np.std(each, axis=1)) for each in channels]
    np.testing.assert_allclose(astuple(passage)[-3:], spreads)


def test_a_place_that_a_sensor_never_meets_and_a_recording_without_a_wave_say_nothing():
    search = SEARCH | {"dwell": 0.0, "pitch_mm": 100.0, "lag_range": (1300.0, 5000.0)}
    passage = search_beats(passing(0.3, sensors=(0,)), search)[0]
    assert 0 < passage.evidence <= search["limit"] / 4
    # Without a wave, no place is the best.
    assert passage_of(wave_of(np.ones((4, 300)), 10, SETTINGS), SETTINGS) is UNKNOWN
