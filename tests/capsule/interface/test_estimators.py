"""The detectors as estimators: what scikit-learn asks of one, and what they say of recordings."""

import pickle

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import cross_val_predict, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.utils.estimator_checks import check_estimator

import capsule
from capsule.detectors.familiar import LEAST_PLACES, TOO_FEW
from capsule.seeding import generator

NAMES = ["template", "diagonal", "taught"]
STATING_PROBABILITY = NAMES[1:]
# What scikit-learn itself leaves out here: it takes SCIPY_ARRAY_API=1 before Python starts.
LEFT_OUT = {"check_array_api_input"}


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
@pytest.mark.parametrize("detector", [*NAMES, None])
def test_scikit_learn_takes_it_for_an_estimator(archive, detector):
    # Its checks for classifiers and regressors do not apply: classes cannot be 2.5 or NaN, and
    # regressors have no probabilities.
    made = capsule.MatrixTransformer(archive.settings)
    if detector:
        made = capsule.DetectorEstimator(detector, archive.settings)
    checks = check_estimator(made, on_fail="raise")
    assert len(checks) > 40
    assert {each["check_name"] for each in checks if each["status"] != "passed"} <= LEFT_OUT


@pytest.fixture(scope="module", params=NAMES)
def fitted(request, archive):
    return capsule.DetectorEstimator(request.param, archive.settings).fit(archive.X, archive.y)


def test_all_that_it_says_of_recordings_agrees(archive, fitted):
    predicted, verdicts = fitted.predict(archive.X), fitted.verdicts(archive.X)
    assert set(predicted) <= {0.0, 0.5, 3.0}
    np.testing.assert_array_equal(predicted > 0, fitted.decision_function(archive.X) > 0)
    sensitivity = (predicted[archive.y > 0] > 0).mean()
    specificity = (predicted[archive.y == 0] == 0).mean()
    assert fitted.score(archive.X, archive.y) == (sensitivity + specificity) / 2 > 0.4
    # Of one recording it says the same as of all.
    alone = [fitted.verdicts(row[np.newaxis])[0].score for row in archive.X]
    assert alone == [each.score for each in verdicts]
    assert fitted.predict(archive.rows(archive.unlabelled)).shape == (1,)
    assert hasattr(fitted, "predict_proba") == (fitted.detector in STATING_PROBABILITY)
    if fitted.detector in STATING_PROBABILITY:
        stated = np.array([each.probability for each in verdicts])
        np.testing.assert_array_equal(fitted.predict_proba(archive.X).T, [1 - stated, stated])


def test_order_pickle_and_a_recording_that_no_detector_can_judge_change_nothing(archive, fitted):
    silent = np.full((1, archive.X.shape[1]), 512.0)
    assert np.isnan([fitted.predict(silent), fitted.decision_function(silent)]).all()
    # The same readings come twice, once as healthy and once as of 3 mm.
    rows, sizes_mm = np.vstack([archive.X, archive.X[0], silent]), [*archive.y, 3.0, 0.0]
    taught = clone(fitted).fit(rows[:-1], sizes_mm[:-1])
    for same in (clone(fitted).fit(rows[::-1], sizes_mm[::-1]), pickle.loads(pickle.dumps(taught))):
        pair = (each.decision_function(archive.X) for each in (same, taught))
        np.testing.assert_array_equal(*pair)


def test_without_arguments_it_is_the_taught_detector_with_the_settings_that_ship(archive):
    assert capsule.DetectorEstimator().get_params() == {"detector": "taught", "settings": None}
    usual = capsule.DetectorEstimator().fit(archive.X, archive.y)
    named = capsule.DetectorEstimator("taught", capsule.read_settings()).fit(archive.X, archive.y)
    np.testing.assert_array_equal(usual.predict_proba(archive.X), named.predict_proba(archive.X))


def test_it_is_judged_by_scikit_learns_own_functions_on_the_workflows_folds(archive):
    detector = make_pipeline(capsule.DetectorEstimator("diagonal", archive.settings))
    folds = capsule.folds(archive)
    predicted = cross_val_predict(detector, archive.X, archive.y, cv=folds)
    judged = capsule.judge(archive, capsule.DetectorEstimator("diagonal", archive.settings))
    np.testing.assert_array_equal(predicted, judged.predictions["predicted_mm"])
    # Of one recording no mean of sensitivity and specificity can be told.
    assert np.isnan(cross_val_score(detector, archive.X, archive.y, cv=folds)).all()


def test_what_is_no_row_of_readings_or_no_size_is_refused(archive):
    X, y = archive.X, archive.y  # noqa: N806
    made, matrices = capsule.DetectorEstimator, capsule.MatrixTransformer
    short = {"preprocessing": {"length": 450}, "fit": {"peak_spacing_range": [90, 100]}}
    long = r"row 0 of X holds \d+ samples of 4 sensors; at most 450"
    one = archive.readings["3mm/r01"].T
    whole = f"X: {len(one)} rows of 4 readings are the samples of one recording; a row of X"
    # As few as two windows have may be recordings of one sample each.
    matrices().fit(one[:168])
    for refused, told in (
        (lambda: made("diagonal").fit(X, y - 1.0), "y holds -1; sizes are 0"),
        (lambda: made(settings=capsule.read_settings(**short)).fit(X, y), long),
        (lambda: made("best").fit(X, y), "best"),
        (lambda: made(settings={"fit": {}}).fit(X, y), "settings: "),
        (lambda: made().fit(one, np.full(len(one), 3.0)), whole),
        (lambda: matrices().fit(X).transform(one), whole),
    ):
        with pytest.raises(capsule.CapsuleError, match=told):
            refused()


def test_it_tells_whether_a_recording_is_like_those_that_taught_it(archive, fitted):
    few = fitted.familiar(archive.X[:2])
    assert [each.familiar for each in few] == [None, None]
    assert (few[0].traits, few[0].least) == ((TOO_FEW,), LEAST_PLACES)
    rows = np.concatenate([archive.X] * 5)
    changed = (rows + generator(1, "familiar").normal(0, 0.3, rows.shape)).round(6)
    many = clone(fitted).fit(changed, np.concatenate([archive.y] * 5))
    assert [each.familiar for each in many.familiar(archive.X[:3])] == [True] * 3
    # Half as fast, and the sensors in another order.
    values = archive.X[0].reshape(-1, 4)
    slow = np.full_like(values, np.nan)
    slow[:800] = np.repeat(values[:400, [2, 0, 3, 1]], 2, axis=0)
    assert many.familiar(slow.reshape(1, -1))[0].familiar is False
