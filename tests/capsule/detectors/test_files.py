"""What the detectors learn from is read as it was written."""

import numpy as np
import pytest

from capsule.detectors.described import (
    read_best_places,
    read_features,
    read_scorer,
    write_best_places,
    write_features,
)
from capsule.detectors.files import read_template_set, read_templates
from capsule.detectors.network import Features
from capsule.detectors.search import UNKNOWN, Passage
from capsule.detectors.wave_traits import UNKNOWN_TRAITS, WaveTraits
from capsule.engine.project import WEIGHTS

SHAPES = {"0mm": np.zeros((4, 9)), "2.5mm": np.ones((4, 9)), "10mm": np.eye(4, 9)}


@pytest.fixture
def path(tmp_path):
    np.savez(tmp_path / "templates.npz", **SHAPES)
    return tmp_path / "templates.npz"


def test_templates_are_read_by_size_in_their_order(path):
    read = read_templates(path)
    assert list(read) == [0.0, 2.5, 10.0]
    np.testing.assert_equal(list(read.values()), list(SHAPES.values()))
    whole = read_template_set(path, 3)
    assert (whole.sizes_mm, whole.first_peak) == ((0.0, 2.5, 10.0), 3)
    np.testing.assert_equal(list(whole.matrices), list(SHAPES.values()))


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
    traits = WaveTraits(3.2, 0.25, 1 / 3, 0.01, 0.9, 0.1)
    written = {"3mm/r1": (place, traits), "3mm/r2": (UNKNOWN, UNKNOWN_TRAITS)}
    write_best_places(tmp_path / "batch.csv", written)
    read = read_best_places(tmp_path / "batch.csv")
    assert list(read) == list(written)
    for name, kinds in read.items():
        np.testing.assert_equal([*map(vars, kinds)], [*map(vars, written[name])])


def test_a_batch_without_a_usable_recording_has_neither(tmp_path):
    write_features(tmp_path / "batch.npz", {})
    write_best_places(tmp_path / "batch.csv", {})
    assert read_features(tmp_path / "batch.npz") == {}
    assert read_best_places(tmp_path / "batch.csv") == {}


def test_the_weights_that_ship_make_a_scorer():
    assert np.isfinite(read_scorer(WEIGHTS).features(np.zeros((4, 5, 40))).score)
