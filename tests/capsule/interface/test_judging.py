"""Any estimator of scikit-learn, judged on the workflow's folds."""

import numpy as np
import pytest
from sklearn.base import BaseEstimator
from sklearn.linear_model import LogisticRegression, Ridge, RidgeClassifier
from sklearn.pipeline import make_pipeline

import capsule
from capsule.evaluation.rates import of_any
from capsule.recordings.names import size_mm

SIZES_MM = (0.0, 0.5, 3.0)


def judged_on_matrices(archive, estimator):
    """Return the judgement of an estimator behind the matrices, of which it tells the name."""
    estimator = make_pipeline(capsule.MatrixTransformer(archive.settings), estimator)
    return capsule.judge(archive, estimator, name="mine")


def others_of(archive):
    """Yield the number of each labelled recording, and which are of other places."""
    site = np.array([archive.headers[name]["site"] for name in archive.labelled])
    return ((place, site != site[place]) for place in range(len(site)))


class OfLong(BaseEstimator):
    """Says 3 mm of long recordings, and nothing of short ones."""

    def fit(self, X, y):  # noqa: N803
        """Learn nothing."""
        return self

    def predict(self, X):  # noqa: N803
        """Return sizes in mm."""
        return np.where(np.isnan(X).mean(axis=1) > 0.5, np.nan, 3.0)


def test_a_regressor_that_never_saw_a_recording_judges_it_by_the_nearest_size(archive):
    judged = judged_on_matrices(archive, Ridge(10.0))
    rows, unlabelled = judged.predictions, judged.detections
    assert list(rows["recording"]) == archive.labelled
    assert set(rows["detector"]) == {"mine"}
    nearest = np.abs(np.subtract.outer(rows["score"].array, SIZES_MM)).argmin(axis=1)
    np.testing.assert_array_equal(rows["predicted_mm"], np.take(SIZES_MM, nearest))
    assert set(rows["threshold"]) == {0.25}
    estimates = rows["score"].where(rows["predicted_mm"] > 0)
    np.testing.assert_array_equal(rows["estimate_mm"], estimates)
    known, patient = (
        np.array([archive.matrices[name].ravel() for name in names])
        for names in (archive.labelled, archive.unlabelled)
    )
    for place, others in others_of(archive):
        own = Ridge(10.0).fit(known[others], archive.y[others])
        np.testing.assert_allclose(own.predict(known[[place]]), rows["score"][place])
    # All labelled recordings teach what is said of the others.
    assert unlabelled["recording"].tolist() == ["unlabelled/patient"]
    said = Ridge(10.0).fit(known, archive.y).predict(patient)
    np.testing.assert_allclose(unlabelled["score"], said)
    assert len(of_any(judged.tables["summary"])) == 2
    assert repr(judged).startswith("<Judgement of mine: 12 predictions, 1 detections; tables: ")


def test_a_classifier_learns_the_sizes_as_classes_and_states_a_probability(archive):
    rows = judged_on_matrices(archive, LogisticRegression(max_iter=200)).predictions
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
        (LogisticRegression(max_iter=200), {0, 3}, 0.5),
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


def test_a_detector_as_an_estimator_learns_from_places_as_the_workflow_does(archive):
    of_all = capsule.judge(archive).predictions
    for detector in archive.settings["detectors"]:
        own = of_all[(of_all["detector"] == detector) & (of_all["scheme"] == "leave_one_out")]
        judged = capsule.judge(archive, capsule.DetectorEstimator(detector, archive.settings))
        for column in ("predicted_mm", "score", "threshold", "probability", "estimate_high_mm"):
            # The workflow leaves recordings out of sums; an estimator adds the others up anew.
            np.testing.assert_allclose(judged.predictions[column], own[column], rtol=1e-9)


def test_leave_one_out_judges_each_place_once_by_all_others(archive):
    sites = np.array([archive.headers[name]["site"] for name in archive.labelled])
    folds = capsule.folds(archive)
    assert folds.get_n_splits() == len(list(folds.split())) == 10
    for taught, judged in folds:
        assert sorted([*taught, *judged]) == list(range(12))
        assert not set(sites[taught]) & set(sites[judged])
    ((taught, all_of_them),) = capsule.folds(archive, "resubstitution")
    np.testing.assert_array_equal(taught, all_of_them)
    # A recording that no detector can judge teaches nothing; several places may leave together.
    other = archive.select(archive.labelled)
    other._rows["0mm/r02"]["no_verdict"] = "no wave on sensor_1"
    assert all(1 not in taught for taught, _ in capsule.folds(other))
    other.settings["evaluation"] = other.settings["evaluation"] | {"most_folds": 6}
    assert len(capsule.folds(other)) == 6


def test_without_both_kinds_there_is_no_threshold_and_what_cannot_be_judged_is_refused(archive):
    healthy = archive.select([name for name in archive.labelled if name.startswith("0mm")])
    sick = archive.select([name for name in archive.labelled if not name.startswith("0mm")])
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


def test_a_judgement_counts_by_source_the_recordings_whose_nodule_follows_from_it(archive):
    other = archive.select(archive.labelled)
    assert capsule.judge(other, OfLong()).confounded.empty
    for name in archive.labelled[:4]:
        other._rows[name]["source"] = "finger on fabric"
    found = capsule.judge(other, OfLong()).confounded.iloc[-1]
    assert found.tolist() == ["source", "finger on fabric", 0.0, 4]
