"""What describes a recording to the detectors is read as it was written."""

import numpy as np

from capsule.detectors.described import (
    read_best_places,
    read_features,
    read_scorer,
    read_wave_traits,
    write_best_places,
    write_features,
)
from capsule.detectors.network import Features
from capsule.detectors.search import UNKNOWN, Passage
from capsule.detectors.wave_traits import UNKNOWN_TRAITS, WaveTraits
from capsule.project import WEIGHTS


def features_of(number):
    """Return features that differ between recordings."""
    gradient = np.arange(5, dtype=np.float32) - number
    return Features(float(number), np.full(3, number, np.float32), gradient)


def test_features_come_back_as_they_were(tmp_path):
    written = {"3mm/r1": features_of(1), "3mm/r2": features_of(float("nan"))}
    write_features(tmp_path / "batch.npz", written)
    read = read_features(tmp_path / "batch.npz")
    assert list(read) == list(written)
    for name, features in read.items():
        np.testing.assert_equal(vars(features), vars(written[name]))


def test_best_places_and_traits_come_back_as_they_were_in_full_precision(tmp_path):
    place = Passage(0.1 + 0.2, 1, 2, 3, 4.5, 128, 130, 0.1, 1 / 3, 0.1)
    written = {"3mm/r1": place, "3mm/r2": UNKNOWN}
    traits = {"3mm/r1": WaveTraits(3.2, 0.25, 1 / 3, 0.01, 0.9, 0.1), "3mm/r2": UNKNOWN_TRAITS}
    write_best_places(tmp_path / "batch.csv", written, traits)
    for read, kept in (
        (read_best_places(tmp_path / "batch.csv"), written),
        (read_wave_traits(tmp_path / "batch.csv"), traits),
    ):
        assert list(read) == list(kept)
        for name, each in read.items():
            np.testing.assert_equal(vars(each), vars(kept[name]))


def test_a_batch_without_a_usable_recording_has_neither(tmp_path):
    write_features(tmp_path / "batch.npz", {})
    write_best_places(tmp_path / "batch.csv", {}, {})
    assert read_features(tmp_path / "batch.npz") == {}
    assert read_best_places(tmp_path / "batch.csv") == {}


def test_the_weights_that_ship_make_a_scorer():
    assert np.isfinite(read_scorer(WEIGHTS).features(np.zeros((4, 5, 40))).score)
