"""Our statistics, compared with those of scikit-learn and statsmodels on random data."""

import numpy as np
import pandas as pd
import pytest
from sklearn.calibration import calibration_curve
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.metrics import brier_score_loss, roc_auc_score, roc_curve
from sklearn.model_selection import LeaveOneOut, cross_val_predict
from statsmodels.stats.contingency_tables import mcnemar
from statsmodels.stats.proportion import confint_proportions_2indep, proportion_confint

from capsule.detectors.calibrate import fit_probability, fit_ridge
from capsule.evaluation.intervals import Units, auc, height_at, rate, ratio_interval
from capsule.evaluation.measures import brier_score, calibration, prevalence_weights, sign_test
from capsule.evaluation.rates import of_each

SEEDS = range(5)
PREVALENCE = 0.1


@pytest.fixture(params=SEEDS, ids="seed {}".format)
def scored(request):
    """Return scores, some of them equal, and which belong to a nodule."""
    numbers = np.random.default_rng(request.param)
    nodule = numbers.random(60) < 0.6
    return np.round(numbers.normal(nodule * 1.5, 1.0), 1), nodule


def test_the_area_under_the_curve(scored):
    scores, nodule = scored
    assert auc(scores[~nodule], scores[nodule]) == pytest.approx(roc_auc_score(nodule, scores))


def test_the_curve(scored):
    scores, nodule = scored
    healthy = np.count_nonzero(~nodule)
    allowed = np.arange(healthy + 1) / healthy
    false_positive, true_positive, _ = roc_curve(nodule, scores, drop_intermediate=False)
    expected = [true_positive[false_positive <= each + 1e-9].max() for each in allowed]
    assert height_at(scores[~nodule], scores[nodule], allowed) == pytest.approx(np.array(expected))


def test_the_logistic_curve_with_its_prior_and_prevalence(scored):
    scores, nodule = scored
    fitted = fit_probability(scores, nodule, np.arange(60), PREVALENCE)
    share = nodule.mean()
    weights = np.where(nodule, PREVALENCE / share, (1 - PREVALENCE) / (1 - share))
    scaled = ((scores - fitted.centre) / fitted.scale)[:, np.newaxis]
    # The prior on the slope is that of a ridge of 0.1.
    other = LogisticRegression(C=10.0, tol=1e-10, max_iter=1000)
    other.fit(scaled, nodule, sample_weight=weights)
    assert fitted.of(scores) == pytest.approx(other.predict_proba(scaled)[:, 1], abs=1e-5)


@pytest.mark.parametrize("seed", SEEDS)
def test_ridge_regression_and_its_predictions_of_what_is_left_out(seed):
    numbers = np.random.default_rng(seed)
    features, targets = numbers.normal(size=(25, 7)), numbers.normal(size=25)
    regression, left_out = fit_ridge(features, targets, np.arange(25), 3.0)
    other = Ridge(alpha=3.0).fit(features, targets)
    assert regression.coefficients == pytest.approx(other.coef_)
    assert regression.of(features) == pytest.approx(other.predict(features))
    expected = cross_val_predict(Ridge(alpha=3.0), features, targets, cv=LeaveOneOut())
    assert left_out == pytest.approx(expected)


def test_the_brier_score_at_a_prevalence(scored):
    scores, nodule = scored
    chance = 1 / (1 + np.exp(-scores))
    weights = prevalence_weights(nodule, PREVALENCE, np.ones(nodule.size))
    expected = brier_score_loss(nodule, chance, sample_weight=weights)
    assert brier_score(chance, nodule, weights) == pytest.approx(expected)


def test_the_calibration_where_the_archive_has_the_prevalence(scored):
    scores, nodule = scored
    chance = 1 / (1 + np.exp(-scores))
    verdicts = pd.DataFrame({"size_mm": nodule.astype(float), "probability": chance})
    verdicts = verdicts.assign(detector="one", scheme="leave_one_out", predicted_mm=1.0)
    ((_, judged),) = of_each(verdicts, 1.0)
    rules = {"prevalence": nodule.mean(), "calibration_bins": 5, "confidence": 0.95}
    _, *made = calibration(judged, rules)
    rows = [row for row in made if row["recordings"]]
    observed, stated = calibration_curve(nodule, chance, n_bins=5)
    assert [row["observed"] for row in rows] == pytest.approx(observed)
    assert [row["stated"] for row in rows] == pytest.approx(stated)


@pytest.mark.parametrize(("hits", "count"), [(0, 20), (6, 20), (19, 20), (20, 20), (431, 900)])
def test_the_interval_of_a_rate(hits, count):
    _, low, high = rate(hits, count, 0.95)
    expected = proportion_confint(hits, count, alpha=0.05, method="wilson")
    assert (low, high) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("counts", [(15, 20, 9, 20), (19, 20, 6, 20), (3, 40, 8, 30)])
def test_the_interval_of_a_ratio_of_rates(counts):
    expected = confint_proportions_2indep(
        *counts, compare="ratio", method="score", alpha=0.05, correction=False
    )
    assert ratio_interval(*counts, 0.95) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("seed", SEEDS)
def test_whether_one_detector_is_better_than_another(seed):
    numbers = np.random.default_rng(seed)
    first, second = numbers.random(50) < 0.6, numbers.random(50) < 0.8
    table = [[np.sum(a & b) for b in (second, ~second)] for a in (first, ~first)]
    expected = mcnemar(table, exact=True).pvalue
    assert sign_test(first, second, Units.of_places(np.arange(50))) == pytest.approx(expected)
