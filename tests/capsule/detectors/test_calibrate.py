"""Thresholds, probabilities and sizes, calibrated over places."""

import json
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

from capsule.arrays import plain
from capsule.detectors import calibrate
from capsule.detectors.calibrate import Regression, SizeModel, fit_probability, fit_ridge, fit_sizes
from capsule.seeding import generator

passes = st.lists(st.tuples(st.integers(0, 5), st.integers(-5, 5)), min_size=1, max_size=25)


def apart(count):
    """Return a place of its own for each recording."""
    return np.arange(count)


@given(passes, st.floats(0.05, 0.95))
def test_the_quantile_is_the_definition_written_out(drawn, share):
    places, values = np.array(drawn).T
    every = set(places.tolist())

    def below(value):
        """Return the weight of what is not above the value, of one more place than there are."""
        return sum(np.mean(values[places == each] <= value) for each in every) / (len(every) + 1)

    expected = min((value for value in values if below(value) >= share - 1e-9), default=np.inf)
    scores = values.astype(float)
    assert calibrate.upper_quantile(scores, places, share) == expected
    # A threshold is the highest score at most.
    assert calibrate.rank_threshold(scores, places, share) == min(expected, scores.max())
    assert np.isnan(calibrate.rank_threshold(np.array([]), apart(0), share))


@pytest.mark.parametrize("prevalence", [0.1, 0.6])
# Of several passes, the last place has more than the others.
@pytest.mark.parametrize("places", [apart(60), np.minimum(apart(60) // 3, 9)], ids=["one", "three"])
def test_the_probability_is_the_logistic_regression_of_scikit_learn(prevalence, places):
    nodule = apart(60) % 3 == 0
    scores = np.round(2.0 + 3.0 * generator(1, "logistic").normal(size=60) + 4.0 * nodule, 1)
    fitted = fit_probability(scores, nodule, places, prevalence)
    weights = np.array([1 / np.sum(places == place) for place in places])
    healthy = np.average(scores[~nodule], weights=weights[~nodule])
    square = np.average((scores[~nodule] - healthy) ** 2, weights=weights[~nodule])
    assert (fitted.centre, fitted.scale**2) == pytest.approx((healthy, square))
    share = weights[nodule].sum() / weights.sum()
    weights *= np.where(nodule, prevalence / share, (1 - prevalence) / (1 - share))
    scaled = ((scores - fitted.centre) / fitted.scale)[:, np.newaxis]
    # The prior on the slope is that of a ridge of 0.1.
    other = LogisticRegression(C=10.0, tol=1e-10, max_iter=1000)
    other.fit(scaled, nodule, sample_weight=weights)
    assert fitted.of(scores) == pytest.approx(other.predict_proba(scaled)[:, 1], abs=1e-5)
    assert np.isnan(fitted.of(np.nan))


def test_a_curve_takes_two_healthy_recordings_that_differ_and_a_nodule():
    for scores, healthy, places in (
        ([1.0, 3.0], 1, apart(2)),
        ([1.0, 1.0, 2.0], 2, apart(3)),
        # Kills: a spread that is rounding alone. The mean of three times 0.1 is another number, and
        # so is a third of a score and back.
        ([0.1, 0.1, 0.1, 2.0], 3, apart(4)),
        ([0.8216181435011584, 2.0, 3.0], 1, 0 * apart(3)),
        ([0.0, 0.1, 5.0, 6.0], 4, apart(4)),
    ):
        nodule = apart(len(scores)) >= healthy
        assert fit_probability(np.array(scores), nodule, places, 0.5) is None
    for scores in ([0.0, 0.1, 5.0, 6.0], [0.0, 1.0, 3.0]):
        fitted = fit_probability(np.array(scores), np.array(scores) > 1, apart(len(scores)), 0.5)
        assert fitted.of(scores[0]) < 0.3 < 0.6 < fitted.of(scores[-1]) < 1
    # No score makes a nodule impossible, or less likely than e to the minus 50.
    curve = calibrate.Probability(centre=1.0, scale=2.0, intercept=0.5, slope=3.0)
    np.testing.assert_allclose(curve.of(np.array([-1e9, 1e9])), [np.exp(-50.0), 1.0], rtol=1e-9)


@pytest.mark.parametrize(("count", "penalty"), [(12, 5.0), (30, 0.0), (30, 0.3)])
@pytest.mark.parametrize("passes_of", [1, 2])
def test_the_ridge_with_and_without_a_place_is_that_of_scikit_learn(count, penalty, passes_of):
    numbers = generator(1, "left out", str(count), str(passes_of))
    values, places = 1.0 + np.arange(count) % 5, np.arange(count) // passes_of
    features = values[:, np.newaxis] + numbers.normal(size=(count, 4)) * np.logspace(-1, 2, 4)
    regression, found = fit_ridge(features, values, places, penalty)
    other = Ridge(alpha=penalty).fit(features, values)
    np.testing.assert_allclose(regression.of(features), other.predict(features))
    expected = cross_val_predict(other, features, values, groups=places, cv=LeaveOneGroupOut())
    np.testing.assert_allclose(found, expected, atol=1e-7)


def test_of_what_nothing_else_tells_the_prediction_is_unknown_and_the_half_width_has_no_end():
    _, alone = fit_ridge(np.ones((2, 2)), np.array([3.0, 3.0]), 0 * apart(2), 1.0)
    assert np.isnan(alone).all()
    # Only one recording varies in a feature, and the feature has no penalty.
    features, values = np.array([[0.0], [0.0], [0.0], [7.0]]), np.array([1.0, 2.0, 3.0, 5.0])
    _, found = fit_ridge(features, values, apart(4), 0.0)
    np.testing.assert_allclose(found, [2.5, 2.0, 1.5, np.nan], atol=1e-9)
    # The rank of three quarters is the fourth, of which the others tell nothing.
    model = fit_sizes(features, values, apart(4), apart(4) >= 0, ridge=0.0, confidence=0.75)
    assert model.half_width_mm == np.inf


def test_sizes_between_those_taught_are_estimated():
    features = generator(1, "sizes").normal(size=(40, 3))
    features[:, 0] = np.repeat([1.0, 2.0, 3.0, 5.0], 10)

    rules, every = {"ridge": 0.1, "confidence": 0.9}, apart(40)
    model = fit_sizes(features, features[:, 0], every, every >= 0, **rules)
    assert model.estimate(np.array([2.5, 0.0, 0.0])) == pytest.approx(2.5, abs=0.05)
    assert model.estimate(np.array([[99.0, 0.0, 0.0]]))[0] == 5.0
    assert model.nearest(2.5) == 2.0 and model.nearest(2.6) == 3.0
    assert fit_sizes(features[:0], *[every[:0]] * 3, **rules) is None


@given(st.floats(1, 5), st.one_of(st.floats(0, 10), st.just(float("inf"))))
def test_an_interval_that_reaches_the_largest_size_has_no_upper_end(estimate, half_width):
    model = SizeModel(Regression(np.zeros(1), np.ones(1), 1.5), half_width, (1.0, 2.0, 5.0))
    low, high = model.interval(estimate)
    assert low == max(estimate - half_width, 1.0)
    assert high == (estimate + half_width if estimate + half_width < 5 else float("inf"))
    # The model survives the file with its width.
    restored = SizeModel.restored(json.loads(json.dumps(plain(asdict(model)), allow_nan=False)))
    assert asdict(restored) == asdict(model)
    assert restored.estimate(np.array([0.25])) == 1.75


@pytest.mark.parametrize("passes_of", [1, 3])
def test_the_half_width_is_the_quantile_of_the_errors_of_what_is_detected(passes_of):
    """On other benches, tests/benchmarks/judge_unseen.py counts how often it holds the size."""
    places = apart(30) // passes_of
    sizes_mm, detected = 1.0 + places % 3, apart(30) % 4 > 0
    features = sizes_mm[:, np.newaxis] + generator(1, "half width").normal(size=(30, 2))
    features *= [1.0, 0.1]
    model = fit_sizes(features, sizes_mm, places, detected, ridge=0.5, confidence=0.8)
    # The penalties are those of features that are scaled by their deviations over all recordings.
    scaled, leave = features / features.std(axis=0), LeaveOneGroupOut()
    told = cross_val_predict(Ridge(alpha=0.5), scaled, sizes_mm, groups=places, cv=leave)
    errors = np.abs(told - sizes_mm)[detected]
    expected = calibrate.upper_quantile(errors, places[detected], 0.8)
    assert model.half_width_mm == pytest.approx(expected)
    assert model.known_mm == (1.0, 2.0, 3.0)
