"""The logistic curve from a score to the probability of a nodule."""

import numpy as np
import pytest

from capsule.detectors.probability import fit_probabilities, fit_probability
from capsule.seeding import generator


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
