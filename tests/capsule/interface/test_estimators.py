"""The detectors as estimators: what scikit-learn asks of one, and what they say of recordings."""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.dummy import DummyRegressor
from sklearn.linear_model import LogisticRegression, Ridge, RidgeClassifier
from sklearn.model_selection import cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.utils.estimator_checks import check_estimator

import capsule
from capsule.detectors.familiar import LEAST_PLACES, TOO_FEW
from capsule.evaluation import learning
from capsule.recordings.names import size_mm
from capsule.seeding import generator


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
@pytest.mark.parametrize(
    "made", [capsule.DetectorEstimator(), capsule.MatrixTransformer()], ids=["taught", "matrices"]
)
def test_scikit_learn_takes_it_for_an_estimator(made):
    # Its checks for classifiers and regressors do not apply: classes cannot be 2.5 or NaN, and
    # regressors have no probabilities.
    checks = check_estimator(made, on_fail="raise")
    assert len(checks) > 40
    # What scikit-learn itself leaves out here: it takes SCIPY_ARRAY_API=1 before Python starts.
    left_out = {each["check_name"] for each in checks if each["status"] != "passed"}
    assert left_out <= {"check_array_api_input"}


@pytest.fixture(scope="module", params=["template", "diagonal", "taught"])
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
    alone = [fitted.verdicts(row[np.newaxis])[0].score for row in archive.X[::5]]
    assert alone == [each.score for each in verdicts[::5]]
    assert fitted.predict(archive.rows(archive.unlabelled)).shape == (1,)
    assert hasattr(fitted, "predict_proba") == (fitted.detector != "template")
    if fitted.detector != "template":
        stated = np.array([each.probability for each in verdicts])
        np.testing.assert_array_equal(fitted.predict_proba(archive.X).T, [1 - stated, stated])


def test_order_and_a_recording_that_no_detector_can_judge_change_nothing(archive, fitted):
    silent = np.full((1, archive.X.shape[1]), 512.0)
    assert np.isnan([fitted.predict(silent), fitted.decision_function(silent)]).all()
    # The same readings come twice, once as healthy and once as of 3 mm.
    rows, sizes_mm = np.vstack([archive.X, archive.X[0], silent]), np.array([*archive.y, 3.0, 0.0])
    orders = slice(-1), slice(None, None, -1)
    taught, turned = (clone(fitted).fit(rows[order], sizes_mm[order]) for order in orders)
    said = (each.decision_function(archive.X) for each in (turned, taught))
    np.testing.assert_array_equal(*said)


def test_what_is_no_row_of_readings_or_no_size_is_refused(archive):
    X, y = archive.X, archive.y  # noqa: N806
    made, matrices = capsule.DetectorEstimator, capsule.MatrixTransformer
    short = {"preprocessing": {"length": 450}, "fit": {"peak_spacing_range": [90, 100]}}
    one = archive.readings["3mm/r01"].T
    # As few as two windows have may be recordings of one sample each.
    matrices().fit(one[:168])
    for refused, told in (
        (lambda: made("diagonal").fit(X, y - 1.0), "y holds -1; sizes are 0"),
        (lambda: made(settings=capsule.read_settings(**short)).fit(X, y), r"row 0 .*at most 450"),
        (lambda: made("best").fit(X, y), "best"),
        (lambda: made(settings={"fit": {}}).fit(X, y), "settings: "),
        (lambda: matrices().fit(X).transform(one), r"520 rows of 4 readings are the samples"),
    ):
        with pytest.raises(capsule.CapsuleError, match=told):
            refused()


def test_it_tells_whether_a_recording_is_like_those_that_taught_it(archive):
    fitted = capsule.DetectorEstimator("diagonal", archive.settings).fit(archive.X, archive.y)
    (few,) = fitted.familiar(archive.X[:1])
    assert (few.familiar, few.traits, few.least) == (None, (TOO_FEW,), LEAST_PLACES)
    # All sensors of the last recording lie elsewhere.
    own, other = archive.X[:2], archive.X[:1].reshape(-1, 4)[:, [2, 0, 3, 1]].reshape(1, -1)
    rows = np.concatenate([archive.X] * 5)
    changed = (rows + generator(1, "familiar").normal(0, 0.3, rows.shape)).round(6)
    many = clone(fitted).fit(changed, np.concatenate([archive.y] * 5))
    judged = many.familiar(np.vstack([own, other]))
    assert [each.familiar for each in judged] == [True, True, False]


# Any estimator of scikit-learn, judged on the workflow's folds.

SIZES_MM = (0.0, 0.5, 3.0)


def judged_on_matrices(archive, estimator):
    """Return the judgement of an estimator behind the matrices, of which it tells the name."""
    estimator = make_pipeline(capsule.MatrixTransformer(archive.settings), estimator)
    return capsule.judge(archive, estimator, name="mine")


def others_of(archive):
    """Yield the number of each labelled recording, and which are of other places."""
    site = np.array([archive.headers[name]["site"] for name in archive.labelled])
    return ((place, site != site[place]) for place in range(len(site)))


class OfLong(DummyRegressor):
    """Says 3 mm of long recordings, and nothing of short ones."""

    def predict(self, X):  # noqa: N803
        """Return sizes in mm."""
        return np.where(np.isnan(X).mean(axis=1) > 0.5, np.nan, 3.0)


def test_a_regressor_that_never_saw_a_recording_judges_it_by_the_nearest_size(archive):
    judged = judged_on_matrices(archive, Ridge(10.0))
    rows, unlabelled = judged.predictions, judged.detections
    assert list(rows["recording"]) == archive.labelled
    assert (set(rows["detector"]), set(rows["threshold"])) == ({"mine"}, {0.25})
    nearest = np.abs(np.subtract.outer(rows["score"].array, SIZES_MM)).argmin(axis=1)
    np.testing.assert_array_equal(rows["predicted_mm"], np.take(SIZES_MM, nearest))
    estimates = rows["score"].where(rows["predicted_mm"] > 0)
    np.testing.assert_array_equal(rows["estimate_mm"], estimates)
    known = np.array([archive.matrices[name].ravel() for name in archive.labelled])
    for place, others in others_of(archive):
        own = Ridge(10.0).fit(known[others], archive.y[others])
        np.testing.assert_allclose(own.predict(known[[place]]), rows["score"][place])
    # All labelled recordings teach what is said of the others.
    assert unlabelled["recording"].tolist() == ["unlabelled/patient"]
    patient = archive.matrices["unlabelled/patient"].reshape(1, -1)
    said = Ridge(10.0).fit(known, archive.y).predict(patient)
    np.testing.assert_allclose(unlabelled["score"], said)
    assert repr(judged).startswith("<Judgement of mine: 12 predictions, 1 detections; tables: ")


def test_a_classifier_learns_the_sizes_as_classes_and_states_a_probability(archive):
    rows = judged_on_matrices(archive, LogisticRegression(max_iter=50, tol=0.1)).predictions
    assert set(rows["predicted_mm"]) <= set(SIZES_MM)
    # The likeliest of three classes may be none though a nodule is likelier.
    assert rows["threshold"].isna().all()
    # Odds at the share of nodules that taught it, and at the prevalence of the configuration.
    for place, others in others_of(archive):
        row, share = rows.iloc[place], np.mean(archive.y[others] > 0)
        moved = np.log(row.probability / (1 - row.probability)) - np.log(0.1 / 0.9)
        taught = np.log(row.score / (1 - row.score)) - np.log(share / (1 - share))
        assert moved == pytest.approx(taught)


# Two classes are told apart by their probability, three by a decision above that for none.
@pytest.mark.parametrize(
    ("estimator", "sizes", "threshold"),
    [
        (LogisticRegression(max_iter=50, tol=0.1), {0, 3}, 0.5),
        (RidgeClassifier(10.0), {0, 3}, 0.0),
        (RidgeClassifier(10.0), {0, 0.5, 3}, 0.0),
    ],
)
def test_a_classifiers_score_above_its_threshold_is_a_nodule(archive, estimator, sizes, threshold):
    some = archive.select([name for name in archive.labelled if size_mm(name) in sizes])
    rows = judged_on_matrices(some, estimator).predictions
    assert set(rows["threshold"]) == {threshold}
    assert ((rows["score"] > threshold) == (rows["predicted_mm"] > 0)).all()
    assert rows["probability"].isna().all() == (threshold == 0)


def test_no_verdict_is_a_wrong_verdict(archive):
    judged = capsule.judge(archive, OfLong())
    rows, by_size = judged.predictions, judged.tables["detection"].set_index("size_mm")
    assert rows["predicted_mm"].isna().sum() == rows["no_verdict"].notna().sum() == 7
    assert by_size.loc[3.0, ["tp", "fn"]].tolist() == [1, 3]
    assert by_size.loc[0.0, "recall"] == 0
    # One of two passes over a place of 3 mm was found, and one place of six others.
    assert judged.tables["summary"]["sensitivity"][0] == pytest.approx(1.5 / 7)
    assert judged.confounded.empty


def test_a_detector_as_an_estimator_learns_from_places_as_the_workflow_does(archive, monkeypatch):
    # How rates grow with what teaches would take most of the time.
    monkeypatch.setattr(learning, "draw_splits", lambda *_: {})
    of_all = capsule.judge(archive).predictions
    for detector in archive.settings["detectors"]:
        own = of_all[(of_all["detector"] == detector) & (of_all["scheme"] == "leave_one_out")]
        made = capsule.DetectorEstimator(detector, archive.settings)
        judged = capsule.judge(archive, made).predictions
        for column in ("predicted_mm", "score", "threshold", "probability", "estimate_high_mm"):
            # The workflow leaves recordings out of sums; an estimator adds the others up anew.
            np.testing.assert_allclose(judged[column], own[column], rtol=1e-9)
    # So do scikit-learn's own functions on the workflow's folds. Without arguments it is the
    # taught detector, with the settings that ship.
    made, folds = make_pipeline(capsule.DetectorEstimator()), capsule.folds(archive)
    assert detector == "taught"
    predicted = cross_val_predict(made, archive.X, archive.y, cv=folds)
    np.testing.assert_array_equal(predicted, judged["predicted_mm"])
    # Of one recording no mean of sensitivity and specificity can be told.
    assert np.isnan(made.fit(archive.X, archive.y).score(archive.X[:1], archive.y[:1]))


def test_leave_one_out_judges_each_place_once_by_all_others(archive):
    other_places, folds = dict(others_of(archive)), capsule.folds(archive)
    assert folds.get_n_splits() == len(list(folds.split())) == 10
    for taught, judged in folds:
        assert sorted([*taught, *judged]) == list(range(12))
        assert taught.tolist() == np.flatnonzero(other_places[judged[0]]).tolist()
    ((taught, all_of_them),) = capsule.folds(archive, "resubstitution")
    np.testing.assert_array_equal(taught, all_of_them)
    # A recording that no detector can judge teaches nothing.
    other = archive.select(archive.labelled)
    other._rows["0mm/r02"]["no_verdict"] = "no wave on sensor_1"
    assert all(1 not in taught for taught, _ in capsule.folds(other))


def test_without_both_kinds_there_is_no_threshold_and_what_cannot_be_judged_is_refused(archive):
    healthy, sick = archive.select(archive.labelled[:4]), archive.select(archive.labelled[4:])
    for one_sided, estimator in ((healthy, Ridge(10.0)), (sick, RidgeClassifier(10.0))):
        predictions = judged_on_matrices(one_sided, estimator).predictions
        assert predictions["threshold"].isna().all()
    for refused, told in (
        (lambda: capsule.folds(archive, "k_fold"), "no scheme 'k_fold'; it has: leave_one_out"),
        (lambda: capsule.folds(archive, "leave_one_session_out"), "fewer than 3 of a kind"),
        (lambda: capsule.judge(archive, Ridge(), name="template"), "is a configured detector"),
        (lambda: capsule.judge(healthy), "no recording of a nodule can be used"),
    ):
        with pytest.raises(capsule.CapsuleError, match=told):
            refused()
