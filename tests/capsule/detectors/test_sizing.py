"""The size of a nodule by ridge regression."""

import numpy as np
import pytest

from capsule.detectors.sizing import fit_sizes, nearest_known
from capsule.seeding import generator


def test_sizes_between_those_taught_are_estimated():
    features = generator(1, "sizes").normal(size=(40, 3))
    features[:, 0] = np.repeat([1.0, 2.0, 3.0, 5.0], 10)
    model = fit_sizes(features, features[:, 0], ridge=0.1)
    assert model.estimate(np.array([[2.5, 0.0, 0.0]]))[0] == pytest.approx(2.5, abs=0.05)
    assert model.estimate(np.array([[99.0, 0.0, 0.0]]))[0] == 5.0
    assert fit_sizes(features[:0], features[:0, 0], 1.0) is None


def test_an_estimate_is_rounded_to_a_size_that_exists():
    assert nearest_known(2.4, [0.0, 1.0, 2.5, 5.0]) == 2.5
    assert nearest_known(0.2, [0.0, 1.0]) == 1.0
    assert nearest_known(1.5, [1.0, 2.0]) == 1.0
    assert np.isnan(nearest_known(1.0, [0.0]))
