import numpy as np
import pytest

from capsule.detectors.operating_point import fit_probabilities, fit_probability, threshold_at
from capsule.detectors.sizing import fit_sizes, nearest_known
from capsule.seeding import generator


def test_a_new_healthy_recording_is_called_a_nodule_as_rarely_as_promised():
    scores = generator(1, "threshold").standard_cauchy((4000, 20))
    alarms = [drawn[-1] > threshold_at(drawn[:-1], 0.9) for drawn in scores]
    # 2 of 20 ranks; the standard error of 4000 draws is 0.005.
    assert np.mean(alarms) == pytest.approx(0.1, abs=0.015)


def test_the_threshold_has_the_promised_rank():
    scores = np.arange(1.0, 20.0)  # 19 recordings are just enough for 95 %
    assert threshold_at(scores, 0.95) == 19
    assert threshold_at(scores, 0.90) == 18
    assert threshold_at(scores[:5], 0.95) == 5
    assert np.isnan(threshold_at(np.array([]), 0.95))


def test_a_probability_is_stated_for_the_prevalence():
    numbers = generator(1, "probability")
    scores = np.concatenate([numbers.normal(0, 1, 4000), numbers.normal(2, 1, 1000)])
    nodule = np.arange(5000) >= 4000
    for prevalence in (0.1, 0.5):
        fitted = fit_probability(scores, nodule, prevalence)
        # Bayes' rule for two normal distributions: the odds at score 1 are those of the prevalence.
        assert fitted.of(1.0) == pytest.approx(prevalence, abs=0.02)
        odds = prevalence / (1 - prevalence) * np.exp(2 * 2.0 - 2)
        assert fitted.of(2.0) == pytest.approx(odds / (1 + odds), abs=0.03)
    assert np.isnan(fitted.of(np.nan))


def test_perfectly_parted_scores_give_a_finite_curve():
    fitted = fit_probability(np.array([0.0, 0.1, 5.0, 6.0]), np.array([0, 0, 1, 1]) > 0, 0.5)
    assert np.isfinite([fitted.slope, fitted.intercept]).all()
    assert fitted.of(0.0) < 0.1 < 0.9 < fitted.of(6.0)
    assert fit_probability(np.array([1.0, 2.0]), np.array([False, False]), 0.5) is None


def test_folds_fitted_at_once_are_those_fitted_alone_wherever_they_start():
    numbers = generator(1, "folds")
    scores, nodule = numbers.normal(size=40), np.arange(40) >= 15
    scores += 2.0 * nodule
    taught = numbers.random((6, 40)) < 0.7
    taught[2, 1:15] = taught[3, 15:] = False  # hardly any healthy one, no nodule
    alone = [fit_probability(scores[fold], nodule[fold], 0.1) for fold in taught]
    assert [curve is None for curve in alone] == [False, False, True, True, False, False]
    whole = fit_probability(scores, nodule, 0.1)
    for start in (None, whole):
        at_once = fit_probabilities(scores, nodule, 0.1, taught, start)
        for found, expected in zip(at_once, alone, strict=True):
            assert (found is None) == (expected is None)
            if expected is not None:
                said, wanted = (list(vars(curve).values()) for curve in (found, expected))
                assert said == pytest.approx(wanted, rel=1e-10)


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
