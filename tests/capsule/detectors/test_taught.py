"""The taught detector: places that are left out teach nothing, and the fit is the formula."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.detectors.base import TrainingArchive
from capsule.detectors.calibrate import rank_threshold
from capsule.detectors.network import EMBEDDED, UNKNOWN_FEATURES
from capsule.detectors.search import UNKNOWN
from capsule.detectors.taught import Taught
from capsule.seeding import generator
from support.training import NO_TEMPLATES, TAUGHT, features_of, recordings_of, verdict_values

SETTINGS = {
    "evaluation": {"specificity": 0.9, "prevalence": 0.1, "size_confidence": 0.9},
    "taught": TAUGHT,
}


def archive_of(sizes_mm, features):
    return TrainingArchive(sizes_mm, recordings_of(features=features), NO_TEMPLATES, {}, SETTINGS)


def features_in(archive):
    return {name: each.features for name, each in archive.recordings.items()}


@pytest.fixture(scope="module")
def archive():
    """Make an archive with scores and embeddings that grow with the size; one has no score."""
    numbers = generator(1, "taught")
    sizes = {f"{place % 4}mm/r{place}": float(place % 4) for place in range(60)}
    features = {
        name: features_of(
            float(2 * size + numbers.normal()),
            np.append(size + 0.2 * numbers.normal(), numbers.normal(size=3)),
            numbers.normal(size=8) + 0.3 * size,
        )
        for name, size in sizes.items()
    }
    features["1mm/r5"] = UNKNOWN_FEATURES
    return archive_of(sizes, features)


@pytest.mark.parametrize("left_out", [[], ["0mm/r0"], ["3mm/r7"], ["1mm/r5"], ["0mm/r4", "2mm/r2"]])
def test_a_fold_teaches_what_an_archive_of_its_recordings_alone_does(archive, left_out):
    taught = {name: size for name, size in archive.sizes_mm.items() if name not in left_out}
    expected = Taught.taught(archive_of(taught, features_in(archive)))
    model = Taught.taught(archive, left_out)
    for name in archive.sizes_mm:
        recording = archive.recordings[name]
        np.testing.assert_allclose(
            verdict_values(model.verdict(recording)),
            verdict_values(expected.verdict(recording)),
            rtol=1e-6,
            atol=1e-6,
        )


def test_large_nodules_are_found_and_sized_with_an_interval(archive):
    for name, size in archive.sizes_mm.items():
        verdict = Taught.taught(archive, [name]).verdict(archive.recordings[name])
        if size == 3.0:
            assert verdict.predicted_mm >= 2
            assert verdict.estimate_low_mm <= verdict.estimate_mm <= verdict.estimate_high_mm


def test_a_recording_without_a_score_has_no_verdict(archive):
    verdict = Taught.taught(archive).verdict(archive.recordings["1mm/r5"])
    assert np.isnan(verdict.predicted_mm) and np.isnan(verdict.score)


def test_what_is_learned_survives_the_file(archive):
    for left_out in ([], [name for name in archive.sizes_mm if name.startswith("0mm")]):
        model = Taught.taught(archive, left_out)
        content = json.loads(json.dumps(model.stored(), allow_nan=False))
        restored = Taught.restored(content, NO_TEMPLATES)
        for name in ("3mm/r7", "0mm/r0"):
            recording = archive.recordings[name]
            np.testing.assert_allclose(
                verdict_values(restored.verdict(recording)),
                verdict_values(model.verdict(recording)),
            )


def test_a_new_recording_needs_only_its_features(archive):
    model = Taught.taught(archive)
    alone = SimpleNamespace(features=archive.recordings["3mm/r7"].features, passage=UNKNOWN)
    expected = model.verdict(archive.recordings["3mm/r7"])
    np.testing.assert_equal(verdict_values(model.verdict(alone)), verdict_values(expected))


def test_the_score_is_a_ridge_on_gradient_and_evidence_written_out(archive):
    names = [name for name in archive.sizes_mm if name != "1mm/r5"]
    seen = np.array([[0.0, *archive.recordings[name].features.gradient] for name in names])
    score = np.array([archive.recordings[name].features.score for name in names])
    sizes_mm = np.array([archive.sizes_mm[name] for name in names])
    wanted = TAUGHT["height"] * np.array([0.0, 0.6, 0.9, 1.0])[sizes_mm.astype(int)] - score

    def score_of(row, teaching):
        mean, intercept = seen[teaching].mean(axis=0), wanted[teaching].mean()
        centred = seen[teaching] - mean
        normal = centred.T @ centred + TAUGHT["penalty"] * np.eye(seen.shape[1])
        coefficients = np.linalg.solve(normal, centred.T @ (wanted[teaching] - intercept))
        return score[row] + intercept + (seen[row] - mean) @ coefficients

    everybody = np.arange(len(names))
    model = Taught.taught(archive)
    alone = [score_of(row, everybody != row) for row in everybody]
    healthy = np.array(alone)[sizes_mm == 0]
    assert model.threshold == pytest.approx(rank_threshold(healthy, np.arange(healthy.size), 0.9))
    for row, name in enumerate(names):
        found = model.score(Taught.seen(archive.recordings[name]))
        assert found == pytest.approx(score_of(row, everybody), rel=1e-5)


def test_no_verdict_moves_when_another_pass_of_its_place_is_replaced(archive):
    """Pairs of recordings are passes over one place; one of a pair gets features of another."""
    numbers = generator(2, "taught")
    places = {name: f"{name[:3]}/{place // 8}" for place, name in enumerate(archive.sizes_mm)}
    judged = {"0mm/r0": "0mm/r4", "2mm/r2": "2mm/r6", "3mm/r7": "3mm/r3"}
    for name, sibling in judged.items():
        assert places[name] == places[sibling]
        left_out = [other for other, place in places.items() if place == places[name]]
        features = features_in(archive)
        features[sibling] = features_of(9.0, numbers.normal(size=4), numbers.normal(size=8))
        verdicts = [
            Taught.taught(replace(archive, recordings=each, places=places), left_out).verdict(
                archive.recordings[name]
            )
            for each in (archive.recordings, recordings_of(features=features))
        ]
        np.testing.assert_equal(*map(verdict_values, verdicts))


def test_the_threshold_is_learned_from_scores_that_the_place_did_not_teach(archive):
    """A second pass over each healthy place must not lower the threshold."""
    doubled, places = dict(archive.sizes_mm), {}
    features = features_in(archive)
    for name, size in archive.sizes_mm.items():
        doubled[f"{name}b"], features[f"{name}b"] = size, archive.recordings[name].features
        places[name] = places[f"{name}b"] = name
    once = Taught.taught(archive).threshold
    settings = {**SETTINGS, "taught": {**TAUGHT, "penalty": 2 * TAUGHT["penalty"]}}
    twice = archive_of(doubled, features)
    twice = replace(twice, settings=settings, places=places)
    # Each recording twice with twice the penalty is the same regression.
    assert Taught.taught(twice).threshold == pytest.approx(once)


@pytest.mark.parametrize(
    ("size_mm", "rise"),
    [(0, 0), (0.5, 0.3), (1, 0.6), (1.5, 0.75), (2, 0.9), (2.5, 0.95), (3, 1), (5, 1)],
)
def test_the_wanted_score_rises_with_the_size_and_not_beyond_3_mm(size_mm, rise):
    # Features that do not vary teach nothing but the mean of what is wanted.
    seen, sizes_mm = np.zeros((4, 3 + EMBEDDED)), np.full(4, float(size_mm))
    learned, without_place = Taught.learn(seen, sizes_mm, np.arange(4), TAUGHT)
    assert learned.of(np.zeros(3)) == pytest.approx(TAUGHT["height"] * rise)
    np.testing.assert_allclose(without_place, TAUGHT["height"] * rise)


def test_recordings_of_a_single_place_teach_no_score():
    seen, sizes_mm = np.zeros((4, 3 + EMBEDDED)), np.arange(4.0)
    learned, without_place = Taught.learn(seen, sizes_mm, np.zeros(4, dtype=int), TAUGHT)
    assert learned is None and np.isnan(without_place).all()
    assert Taught.learn(seen, sizes_mm, np.array([0, 0, 0, 1]), TAUGHT)[0] is not None


@pytest.mark.parametrize(
    ("evidence", "seen"), [(float("nan"), 0), (-3, -1), (-0.5, -0.5), (3.9, 3.9), (4.1, 4)]
)
def test_evidence_counts_from_minus_1_to_4(archive, evidence, seen):
    passage = replace(UNKNOWN, evidence=evidence)
    features = archive.recordings["3mm/r7"].features
    row = Taught.seen(SimpleNamespace(features=features, passage=passage))
    np.testing.assert_allclose(row, [features.score, seen, *features.gradient, *features.embedding])


def test_evidence_is_penalised_by_its_own_weight():
    numbers = generator(1, "evidence")
    seen, sizes_mm = numbers.normal(size=(12, 3)), np.arange(12.0) % 4
    settings = TAUGHT | {"evidence_weight": 3.0}
    rows = np.column_stack([seen, numbers.normal(size=(12, EMBEDDED))])
    learned, _ = Taught.learn(rows, sizes_mm, np.arange(12), settings)
    wanted = TAUGHT["height"] * np.array([0, 0.6, 0.9, 1.0])[sizes_mm.astype(int)] - seen[:, 0]
    centred = seen[:, 1:] - seen[:, 1:].mean(axis=0)
    penalties = TAUGHT["penalty"] * np.diag([1 / 9, 1.0])
    expected = np.linalg.solve(centred.T @ centred + penalties, centred.T @ wanted)
    np.testing.assert_allclose(learned.coefficients, [0, *expected], atol=1e-9)
    # What is added is the mean of what is wanted where evidence and gradient have their means.
    told = wanted.mean() + (seen[:, 1:] - seen[:, 1:].mean(axis=0)) @ expected
    np.testing.assert_allclose(learned.of(seen), told, atol=1e-9)


def test_a_score_at_the_threshold_is_no_nodule(archive):
    model = Taught.taught(archive)
    recording = archive.recordings["3mm/r7"]
    score = model.score(Taught.seen(recording))
    at = replace(model, threshold=score).verdict(recording)
    assert (at.predicted_mm, at.score, at.threshold) == (0.0, score, score)
    assert np.isnan([at.estimate_mm, at.location_mm]).all()
    assert replace(model, threshold=np.nextafter(score, -9)).verdict(recording).predicted_mm > 0
    assert replace(model, threshold=float("nan")).verdict(recording).probability != 0
    assert np.isnan(replace(model, threshold=float("nan")).verdict(recording).predicted_mm)
