"""The size of a nodule by ridge regression."""

import numpy as np
import pytest

from capsule.detectors.sizing import fit_sizes, left_out_errors, nearest_known
from capsule.seeding import generator


def test_sizes_between_those_taught_are_estimated():
    features = generator(1, "sizes").normal(size=(40, 3))
    features[:, 0] = np.repeat([1.0, 2.0, 3.0, 5.0], 10)
    model = fit_sizes(features, features[:, 0], ridge=0.1)
    assert model.estimate(np.array([[2.5, 0.0, 0.0]]))[0] == pytest.approx(2.5, abs=0.05)
    assert model.estimate(np.array([[99.0, 0.0, 0.0]]))[0] == 5.0
    assert fit_sizes(features[:0], features[:0, 0], 1.0) is None


def predicted_by_the_others(features, sizes_mm, place, ridge, scale):
    """Return the size that the others predict, by a fit written out, with scaled features."""
    others = np.delete(np.arange(sizes_mm.size), place)
    scaled = features / scale
    mean, mean_mm = scaled[others].mean(axis=0), sizes_mm[others].mean()
    centred = scaled[others] - mean
    normal = centred.T @ centred + ridge * np.eye(features.shape[1])
    coefficients = np.linalg.solve(normal, centred.T @ (sizes_mm[others] - mean_mm))
    return mean_mm + (scaled[place] - mean) @ coefficients


@pytest.mark.parametrize(("count", "ridge"), [(3, 0.3), (12, 5.0), (80, 0.0), (80, 0.3)])
def test_errors_without_leaving_out_are_those_of_leaving_out(count, ridge):
    numbers = generator(1, "left out", str(count))
    sizes_mm = 1.0 + np.arange(count) % 5
    features = sizes_mm[:, np.newaxis] + numbers.normal(size=(count, 4)) * np.logspace(-1, 2, 4)
    errors = left_out_errors(fit_sizes(features, sizes_mm, ridge), features, sizes_mm, ridge)
    for place in range(count):
        alone = predicted_by_the_others(features, sizes_mm, place, ridge, features.std(axis=0))
        assert errors[place] == pytest.approx(alone - sizes_mm[place], abs=1e-9)
    if count == 80:
        # The features are also scaled without the one recording.
        for place in range(count):
            others = np.delete(np.arange(count), place)
            model = fit_sizes(features[others], sizes_mm[others], ridge)
            anew = model.estimate(features[[place]])[0]
            within = np.clip(errors[place] + sizes_mm[place], model.smallest_mm, model.largest_mm)
            assert within == pytest.approx(anew, abs=1e-3)


def test_of_what_nothing_else_tells_the_error_is_infinite():
    alone = fit_sizes(np.ones((1, 2)), np.array([3.0]), 1.0)
    assert left_out_errors(alone, np.ones((1, 2)), np.array([3.0]), 1.0).tolist() == [np.inf]
    # Only one recording varies in a feature, and the feature has no penalty.
    features = np.array([[0.0], [0.0], [0.0], [7.0]])
    sizes_mm = np.array([1.0, 2.0, 3.0, 5.0])
    errors = left_out_errors(fit_sizes(features, sizes_mm, 0.0), features, sizes_mm, 0.0)
    np.testing.assert_allclose(errors, [1.5, 0.0, -1.5, np.inf], atol=1e-9)


def test_an_estimate_is_rounded_to_a_size_that_exists():
    assert nearest_known(2.4, [0.0, 1.0, 2.5, 5.0]) == 2.5
    assert nearest_known(0.2, [0.0, 1.0]) == 1.0
    assert nearest_known(1.5, [1.0, 2.0]) == 1.0
    assert np.isnan(nearest_known(1.0, [0.0]))
