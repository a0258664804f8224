"""Ridge regression without some recordings equals ridge regression on the others."""

import numpy as np
import pytest

from capsule.detectors.ridge import RidgeWithout
from capsule.seeding import generator


def ridge_of(features, *targets, penalty=2.0):
    return RidgeWithout(features, np.column_stack(targets), [penalty])


def fitted(features, targets, penalty):
    """Solve the normal equations without a penalty on the mean, written out."""
    mean, mean_target = features.mean(axis=0), targets.mean()
    centred = features - mean
    normal = centred.T @ centred + penalty * np.eye(features.shape[1])
    coefficients = np.linalg.solve(normal, centred.T @ (targets - mean_target))
    return coefficients, mean_target - mean @ coefficients


@pytest.mark.parametrize(("count", "dimensions"), [(12, 40), (40, 12)])
@pytest.mark.parametrize("left_out", [[], [3], [0, 5, 7]])
def test_leaving_out_is_learning_from_the_others(count, dimensions, left_out):
    numbers = generator(1, "ridge", str(count))
    features, targets = numbers.normal(size=(count, dimensions)), numbers.normal(size=count)
    (fold,) = ridge_of(features, targets).without(np.array(left_out, int))
    (regression,), predictions = fold
    others = np.delete(np.arange(count), left_out)
    coefficients, intercept = fitted(features[others], targets[others], 2.0)
    np.testing.assert_allclose(regression.coefficients, coefficients, atol=1e-10)
    assert regression.intercept == pytest.approx(intercept, abs=1e-10)
    for place, other in enumerate(others):
        rest = others[others != other]
        alone, constant = fitted(features[rest], targets[rest], 2.0)
        assert predictions[place, 0] == pytest.approx(features[other] @ alone + constant, abs=1e-9)


def test_many_are_left_out_by_a_new_fit_that_predicts_the_same(monkeypatch):
    numbers = generator(1, "ridge", "many")
    features, targets = numbers.normal(size=(40, 6)), numbers.normal(size=40)
    left_out = np.arange(3, 30)
    ((updated, predictions),) = ridge_of(features, targets).without(left_out)
    monkeypatch.setattr("capsule.detectors.ridge._FEW", 0)
    ((fitted_anew, predicted_anew),) = ridge_of(features, targets).without(left_out)
    np.testing.assert_allclose(fitted_anew[0].coefficients, updated[0].coefficients, atol=1e-12)
    assert fitted_anew[0].intercept == pytest.approx(updated[0].intercept, abs=1e-12)
    np.testing.assert_allclose(predicted_anew, predictions, atol=1e-12)


def test_a_new_fit_in_parts_shares_its_axes_among_small_penalties(monkeypatch):
    numbers = generator(1, "ridge", "axes")
    features, targets = numbers.normal(size=(60, 6)), numbers.normal(size=(60, 2))
    # One feature that does not vary, so that an axis has no length.
    features[:, 4] = 3.0
    left_out, penalties = np.arange(3, 43), [2.0, 0.1, 0.001]
    monkeypatch.setattr("capsule.detectors.ridge._PART", 7)
    anew = RidgeWithout(features, targets, penalties).without(left_out)
    monkeypatch.setattr("capsule.detectors.ridge._FEW", 60)
    updated = RidgeWithout(features, targets, penalties).without(left_out)
    for one, other in zip(anew, updated, strict=True):
        for fitted_anew, expected in zip(one.regressions, other.regressions, strict=True):
            np.testing.assert_allclose(fitted_anew.coefficients, expected.coefficients, atol=1e-11)
            assert fitted_anew.intercept == pytest.approx(expected.intercept, abs=1e-11)
        np.testing.assert_allclose(one.predictions, other.predictions, atol=1e-11)


def test_each_penalty_is_learned_as_alone():
    numbers = generator(1, "ridge", "penalties")
    features, targets = numbers.normal(size=(80, 6)), numbers.normal(size=80)
    for left_out in (np.array([2, 11]), np.arange(40)):
        together = RidgeWithout(features, targets[:, np.newaxis], [5.0, 0.1]).without(left_out)
        for penalty, fold in zip([5.0, 0.1], together, strict=True):
            (alone,) = ridge_of(features, targets, penalty=penalty).without(left_out)
            np.testing.assert_allclose(fold.predictions, alone.predictions, atol=1e-12)
            coefficients, _ = fitted(
                np.delete(features, left_out, axis=0), np.delete(targets, left_out), penalty
            )
            np.testing.assert_allclose(fold.regressions[0].coefficients, coefficients, atol=1e-12)


def test_fewer_than_two_teach_nothing():
    ridge = ridge_of(np.ones((2, 3)), np.array([1.0, 2.0]))
    assert ridge.without(np.array([0])) is None
    assert ridge_of(np.ones((0, 3)), np.ones(0)).without(np.array([], int)) is None


def test_features_that_do_not_vary_teach_the_mean():
    (((regression,), _),) = ridge_of(np.ones((4, 3)), np.arange(4.0)).without(np.array([], int))
    assert regression.of(np.ones(3)) == pytest.approx(1.5)


def test_one_after_the_other_is_left_out_of_a_large_archive_in_any_order():
    numbers = generator(1, "ridge", "large")
    features, targets = numbers.normal(size=(300, 7)), numbers.normal(size=300)
    ridge = ridge_of(features, targets)
    for left_out in (299, 0, 128, 127, 1, 256, 0):
        others = np.delete(np.arange(300), left_out)
        coefficients, intercept = fitted(features[others], targets[others], 2.0)
        (((regression,), predictions),) = ridge.without(np.array([left_out]))
        np.testing.assert_allclose(regression.coefficients, coefficients, atol=1e-12)
        assert regression.intercept == pytest.approx(intercept, abs=1e-12)
        assert predictions.shape == (299, 1)


def test_several_targets_are_learned_as_each_alone():
    numbers = generator(1, "ridge", "several")
    features, targets = numbers.normal(size=(20, 6)), numbers.normal(size=(20, 3))
    left_out = np.array([2, 11])
    (together,) = ridge_of(features, targets).without(left_out)
    for place, target in enumerate(targets.T):
        (((alone,), predictions),) = ridge_of(features, target).without(left_out)
        one = together.regressions[place]
        np.testing.assert_allclose(one.coefficients, alone.coefficients, atol=1e-12)
        assert one.intercept == pytest.approx(alone.intercept, abs=1e-12)
        np.testing.assert_allclose(together.predictions[:, [place]], predictions, atol=1e-12)
