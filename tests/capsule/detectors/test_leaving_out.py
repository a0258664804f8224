"""Leaving recordings out of a model gives the same model as a new fit without them."""

import numpy as np
import pytest

from capsule.detectors.leaving_out import ProbabilityWithout, SizesWithout
from capsule.detectors.probability import fit_probability
from capsule.detectors.sizing import fit_sizes, left_out_errors
from capsule.seeding import generator

PREVALENCE, RIDGE = 0.1, 2.0


def draw_scores(count, apart, name="scores"):
    """Draw scores of equally many healthy recordings and nodules, some spreads apart."""
    nodule = np.arange(2 * count) % 2 == 1
    return generator(1, name).normal(size=2 * count) + apart * nodule, nodule


def draw_features(count):
    numbers = generator(1, "features")
    sizes_mm = 1.0 + np.arange(count) % 5
    weights = numbers.normal(size=(7, 1)) / 10
    features = (weights * sizes_mm).T + numbers.normal(size=(count, 7)) * np.logspace(-3, 3, 7)
    return features, sizes_mm


def assert_same_curve(found, expected):
    assert (found is None) == (expected is None)
    if expected is not None:
        np.testing.assert_allclose(
            list(vars(found).values()), list(vars(expected).values()), rtol=1e-10, atol=1e-12
        )


@pytest.mark.parametrize("apart", [0.5, 2, 10])
@pytest.mark.parametrize("count", [3, 20, 200])
def test_the_curve_without_some_is_that_of_the_others(count, apart):
    scores, nodule = draw_scores(count, apart)
    probability = ProbabilityWithout(scores, nodule, PREVALENCE)
    extremes = [int(scores.argmin()), int(scores.argmax()), int(scores[~nodule].argmax()) * 2]
    for left_out in ([0], [1], [2, 3, 5], extremes, *([place] for place in extremes)):
        others = np.delete(np.arange(scores.size), left_out)
        expected = fit_probability(scores[others], nodule[others], PREVALENCE)
        assert_same_curve(probability.without(np.unique(left_out)), expected)


def test_without_any_left_out_it_is_the_curve_of_all():
    scores, nodule = draw_scores(20, 2.0)
    nobody = np.array([], dtype=int)
    expected = fit_probability(scores, nodule, PREVALENCE)
    assert ProbabilityWithout(scores, nodule, PREVALENCE).without(nobody) == expected


def test_of_one_kind_alone_there_is_no_curve():
    scores, nodule = draw_scores(2, 2.0)
    probability = ProbabilityWithout(scores, nodule, PREVALENCE)
    assert probability.without(np.flatnonzero(nodule)) is None
    assert probability.without(np.flatnonzero(~nodule)[:1]) is None
    healthy = ProbabilityWithout(scores[~nodule], nodule[~nodule], PREVALENCE)
    assert healthy.without(np.array([0])) is None


def test_each_of_many_curves_is_that_of_the_others():
    scores, nodule = draw_scores(150, 2.0)
    probability = ProbabilityWithout(scores, nodule, PREVALENCE)
    for place in range(scores.size):
        others = np.delete(np.arange(scores.size), place)
        expected = fit_probability(scores[others], nodule[others], PREVALENCE)
        assert_same_curve(probability.without(np.array([place])), expected)


def assert_same_model(found, expected, features):
    assert (found is None) == (expected is None)
    if expected is not None:
        np.testing.assert_allclose(found.estimate(features), expected.estimate(features), rtol=1e-9)
        assert (found.smallest_mm, found.largest_mm) == (expected.smallest_mm, expected.largest_mm)


@pytest.mark.parametrize("count", [2, 9, 300])
def test_sizes_without_some_are_those_of_the_others(count):
    features, sizes_mm = draw_features(count)
    sizes = SizesWithout(features, sizes_mm, RIDGE)
    for left_out in ([], [0], [count - 1], range(0, count, 5), range(count - 1), range(count)):
        others = np.delete(np.arange(count), list(left_out))
        expected = fit_sizes(features[others], sizes_mm[others], RIDGE)
        gone = np.array(left_out, dtype=int)
        assert_same_model(sizes.without(gone), expected, features)
        errors = sizes.errors_without(gone)
        assert errors.shape == others.shape
        if expected is not None:
            alone = left_out_errors(expected, features[others], sizes_mm[others], RIDGE)
            np.testing.assert_allclose(errors, alone, rtol=1e-7, atol=1e-9)


def test_a_feature_that_one_recording_alone_varies_is_learned_anew():
    features, sizes_mm = draw_features(40)
    features[:, 2] = 7.0
    features[3, 2] = 1e6
    sizes = SizesWithout(features, sizes_mm, RIDGE)
    others = np.delete(np.arange(40), 3)
    expected = fit_sizes(features[others], sizes_mm[others], RIDGE)
    assert sizes.without(np.array([3])).scale[2] == 1.0
    assert_same_model(sizes.without(np.array([3])), expected, features[others])
