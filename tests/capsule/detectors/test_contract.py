"""What every detector of the registry keeps to; a new row there is tested without a line here."""

import json
from dataclasses import asdict, replace
from functools import partial

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

from capsule.detectors.base import ScoredDetector, StoredRecording, TrainingArchive
from capsule.detectors.calibrate import fit_probability, fit_sizes, rank_threshold
from capsule.detectors.network import EMBEDDED
from capsule.detectors.registry import DETECTORS, detector_class
from capsule.detectors.search import UNKNOWN, Passage
from capsule.detectors.shipped import Diagonal, NearestTemplate, Taught
from capsule.detectors.verdicts import row_verdict
from capsule.errors import CapsuleError
from capsule.method import templates as method
from capsule.method.particle import Particle, render
from capsule.seeding import generator
from support.training import TAUGHT, features_of

SIZES_MM = {f"{place % 4}mm/r{place}": float(place % 4) for place in range(60)}
# This one has no passage, no features and a matrix of NaN.
SILENT = "1mm/r5"
# Two recordings are passes over a place.
PLACES = {name: f"{name[:3]}/{place // 8}" for place, name in enumerate(SIZES_MM)}
SETTINGS = {"evaluation": {"specificity": 0.9, "prevalence": 0.1, "size_confidence": 0.9}}
# Of a detector without a setting for it, the ridge is 1.
SETTINGS |= {"diagonal": {}, "taught": TAUGHT | {"size_ridge": 2.0}}
SHAPE = {"sensors": 3, "first_peak": 20, "length": 120}
EVERY = {name: detector_class(name) for name in DETECTORS}
SCORED = {name: each for name, each in EVERY.items() if issubclass(each, ScoredDetector)}
every_detector = pytest.mark.parametrize("detector", list(EVERY.values()), ids=list(EVERY))


def recording_of(size_mm, numbers):
    """Return a recording of which all that a detector may see grows with the size."""
    particle = Particle(np.ones(3), np.full(3, 0.3), numbers.uniform(30, 40, 2), np.full(3, 9))
    matrix = np.maximum(numbers.normal(0.0, 0.1, (3, 120)), 0.0)
    matrix += size_mm / 3 * render(particle, 20, 120)
    evidence, *level = size_mm + numbers.normal(size=7) / np.array([1, 3, 3, 3, 3, 3, 3])
    passage = Passage(evidence, *level[:3], 10.0, 200.0, 130.0, *np.exp(level[3:]))
    score, *embedding = [2 * size_mm, size_mm, 0, 0, 0] + numbers.normal(size=5) * [1, 0.2, 1, 1, 1]
    features = features_of(score, embedding, numbers.normal(size=8) + 0.3 * size_mm)
    return StoredRecording(lambda: matrix, passage, features=features), particle


def archive_of(made, places):
    """Return an archive of recordings and their particles."""
    sizes_mm = {name: SIZES_MM[name] for name in made}
    recordings = {name: each for name, (each, _) in made.items()}
    particles = {name: each for name, (_, each) in made.items() if SIZES_MM[name]}
    templates = method.build_templates(method.by_size(particles), **SHAPE)
    return TrainingArchive(sizes_mm, recordings, templates, particles, SETTINGS, places=places)


@pytest.fixture(scope="module")
def made():
    numbers = generator(1, "contract")
    made = {name: recording_of(size, numbers) for name, size in SIZES_MM.items()}
    made[SILENT] = StoredRecording(partial(np.full, (3, 120), np.nan)), made[SILENT][1]
    return made


@pytest.fixture(scope="module", params=[{}, PLACES], ids=["places of one pass", "of two passes"])
def archive(request, made):
    return archive_of(made, request.param)


def values_of(model, recordings):
    """Return the values of the verdicts on recordings, with the distances, as rows."""
    verdicts = [vars(model.verdict(each)) for each in recordings]
    return [[*list(each.values())[:-1], *(each["distances"] or ())] for each in verdicts]


LEFT_OUT = [[], ["0mm/r0"], [SILENT], ["2mm/r2", "0mm/r4", "3mm/r7"]]
LEFT_OUT += [[name for name in SIZES_MM if name < end] for end in ("1mm", "1mm/r4")]


@every_detector
@pytest.mark.parametrize("left_out", LEFT_OUT, ids=lambda names: f"{len(names)} {names[:1]}")
def test_a_fold_teaches_like_an_archive_of_it_and_json_holds_it(detector, archive, made, left_out):
    rest = {name: each for name, each in made.items() if name not in left_out}
    models = [detector.taught(archive, left_out), detector.taught(archive_of(rest, archive.places))]
    # Templates have a file of their own, which holds those of all recordings.
    if not left_out or detector in SCORED.values():
        content = json.loads(json.dumps(models[0].stored(), allow_nan=False))
        models.append(detector.restored(content, archive.templates))
    found, *others = (values_of(each, archive.recordings.values()) for each in models)
    for expected in others:
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


@every_detector
def test_the_fields_of_a_verdict_agree_with_each_other(detector, archive):
    model, found = detector.taught(archive), 0
    for name, recording in archive.recordings.items():
        verdict = model.verdict(recording)
        estimate = [verdict.estimate_mm, verdict.location_samples]
        if name == SILENT:
            assert np.isnan([verdict.predicted_mm, verdict.score, *estimate]).all()
            continue
        assert verdict.predicted_mm in (0.0, 1.0, 2.0, 3.0)
        assert (verdict.predicted_mm > 0) == (verdict.score > verdict.threshold)
        assert np.isnan(estimate).tolist() == [verdict.predicted_mm == 0] * 2
        assert np.isnan(verdict.probability) or 0 < verdict.probability < 1
        if not np.isnan(verdict.estimate_low_mm):
            assert verdict.estimate_low_mm <= verdict.estimate_mm <= verdict.estimate_high_mm
            assert abs(verdict.predicted_mm - verdict.estimate_mm) <= 0.5
        found += verdict.predicted_mm > 0 and SIZES_MM[name] == 3.0
    assert found >= 8
    # Without a labelled recording there is no nodule.
    verdict = detector.taught(archive, list(SIZES_MM)).verdict(archive.recordings["3mm/r7"])
    assert not verdict.predicted_mm > 0


@pytest.mark.parametrize("detector", list(SCORED.values()), ids=list(SCORED))
def test_threshold_probability_and_sizes_are_of_the_scores_without_the_place(detector, archive):
    model = detector.taught(archive)
    seen, sizes_mm, places = archive.teaching(detector.seen, ())
    settings = SETTINGS[detector.name]
    _, scores = detector.learn(seen, sizes_mm, places, settings)
    healthy, nodule = sizes_mm == 0, sizes_mm > 0
    assert model.threshold == rank_threshold(scores[healthy], places[healthy], 0.9)
    assert model.probability == fit_probability(scores, nodule, places, 0.1)
    detected = scores[nodule] > model.threshold
    options = {"ridge": settings.get("size_ridge", 1.0), "confidence": 0.9}
    rows = seen[nodule, detector.sized_by], sizes_mm[nodule], places[nodule], detected
    np.testing.assert_equal(asdict(model.sizes), asdict(fit_sizes(*rows, **options)))
    recording = archive.recordings["3mm/r7"]
    verdict = model.verdict(recording)
    assert verdict.probability == float(model.probability.of(verdict.score))
    assert (verdict.location_samples, verdict.location_mm) == (200.0, 10.0)
    # A score at the threshold is no nodule.
    score = model.score(detector.seen(recording))
    at = replace(model, threshold=score).verdict(recording)
    assert (at.predicted_mm, at.score, at.threshold) == (0.0, score, score)
    assert replace(model, threshold=np.nextafter(score, -9)).verdict(recording).predicted_mm > 0
    unset = replace(model, threshold=float("nan")).verdict(recording)
    assert np.isnan([unset.predicted_mm, unset.probability]).all()


def test_the_registry_refuses_a_name_that_it_has_not():
    with pytest.raises(CapsuleError, match="no detector nearest; allowed are: template, diag"):
        detector_class("nearest")


def test_the_papers_verdict_is_that_of_the_nearest_template(archive):
    whole, found, model = archive.templates, 0, NearestTemplate.taught(archive)
    for recording in archive.recordings.values():
        verdict = model.verdict(recording)
        distances, gains, lags = method.compare_templates(recording.matrix, model.templates)
        np.testing.assert_array_equal(verdict.distances, distances)
        nearest = method.nearest_size(distances, whole.sizes_mm)
        told = verdict.predicted_mm, verdict.score, verdict.threshold
        np.testing.assert_equal(told, (nearest, max(gains[1:]), 0.0))
        if verdict.predicted_mm > 0:
            found += 1
            lag = lags[int(np.argmax(gains[1:])) + 1]
            assert verdict.estimate_mm == verdict.predicted_mm
            assert verdict.location_samples == method.first_peak_sample(lag, 20, 120)
    assert 0 < found < len(archive.sizes_mm)
    # Without a template of a nodule there is no margin.
    none = method.build_templates({}, **SHAPE)
    model = NearestTemplate.taught(replace(archive, templates=none, sizes_mm={"0mm/r0": 0.0}))
    verdict = model.verdict(archive.recordings["0mm/r0"])
    assert np.isnan(verdict.score) and verdict.predicted_mm == 0


# The shipped detectors of scores: what they see, and the ridge that adapts the network's score.


def test_diagonal_sees_the_evidence_the_channels_the_time_and_logarithms():
    known = Passage(0.5, 0.1, 0.2, 0.01, 12.0, 200.0, 130.0, 0.3, 0.4, 0.5)
    # A channel below 0.03 counts as 0.03, so that it has a logarithm.
    logarithms = np.log([0.2, 0.03, 0.3, 0.4, 0.5])
    seen, silent = (Diagonal.seen(StoredRecording(None, each)) for each in (known, UNKNOWN))
    np.testing.assert_allclose(seen, [0.5, 0.1, 0.2, 0.01, 130.0, *logarithms])
    assert np.isnan(silent[0]) and Diagonal.sized_by == slice(1, None)
    # The evidence is the score, which nothing teaches.
    learned, scores = Diagonal.learn(np.tile(seen, (2, 1)), np.zeros(2), np.arange(2), {})
    assert learned is None and scores.tolist() == [0.5, 0.5]


@pytest.mark.parametrize(("evidence", "seen"), [(np.nan, 0), (-3, -1), (-0.5, -0.5), (4.1, 4)])
def test_taught_sees_score_evidence_from_minus_1_to_4_gradient_and_embedding(evidence, seen):
    features = features_of(1.5, [2.0], [3.0])
    passage = replace(UNKNOWN, evidence=evidence)
    row = Taught.seen(StoredRecording(None, passage, features=features))
    np.testing.assert_allclose(row, [1.5, seen, *features.gradient, *features.embedding])
    assert Taught.sized_by == slice(-EMBEDDED, None)


@pytest.mark.parametrize("passes_of", [1, 2])
def test_the_score_is_the_ridge_of_scikit_learn_on_evidence_and_gradient(passes_of):
    numbers = generator(1, "taught ridge")
    seen, sizes_mm = numbers.normal(size=(24, 4)), np.arange(24.0) % 4
    places = np.arange(24) // passes_of
    rows = np.column_stack([seen, numbers.normal(size=(24, EMBEDDED))])
    learned, without_place = Taught.learn(rows, sizes_mm, places, TAUGHT | {"evidence_weight": 3.0})
    # The evidence is penalised by its own weight.
    score, features = seen[:, 0], seen[:, 1:] * [3, 1, 1]
    wanted = TAUGHT["height"] * np.tile([0, 0.6, 0.9, 1.0], 6) - score
    ridge, leave = Ridge(alpha=TAUGHT["penalty"]).fit(features, wanted), LeaveOneGroupOut()
    expected = cross_val_predict(ridge, features, wanted, groups=places, cv=leave)
    np.testing.assert_allclose(without_place, score + expected)
    scores = [*map(Taught(0.0, learned, None, None).score, rows)]
    np.testing.assert_allclose(scores, score + ridge.predict(features))


def test_the_wanted_score_rises_with_the_size_and_not_beyond_3_mm():
    # Features that do not vary teach nothing but the mean of what is wanted.
    seen, places = np.zeros((4, 3 + EMBEDDED)), np.array([0, 0, 0, 1])
    for size_mm, rise in ((0, 0), (0.5, 0.3), (1, 0.6), (1.5, 0.75), (2.5, 0.95), (3, 1), (5, 1)):
        learned, without_place = Taught.learn(seen, np.full(4, float(size_mm)), places, TAUGHT)
        told = [learned.of(np.zeros(3)), *without_place]
        np.testing.assert_allclose(told, TAUGHT["height"] * rise)
    # A single place teaches no score.
    learned, without_place = Taught.learn(seen, np.ones(4), 0 * places, TAUGHT)
    assert learned is None and np.isnan(without_place).all()
    assert np.isnan(Taught(0.0, None, None, None).score(seen[0]))


# The five verdicts.


def test_a_verdict_is_one_of_five():
    for score, threshold, probability, familiar, reason, word in (
        (2.0, 1.0, 0.5, "yes", np.nan, "nodule"),
        (2.0, 1.0, 0.49, "yes", np.nan, "uncertain: pass again"),
        (2.0, 1.0, np.nan, "yes", np.nan, "nodule"),
        (1.0, 1.0, 0.9, "yes", np.nan, "no nodule"),
        (9.0, 1.0, 0.9, "no", np.nan, "unlike the recordings that teach"),
        (0.0, 1.0, 0.1, "no", np.nan, "unlike the recordings that teach"),
        (9.0, 1.0, 0.9, "no", "no wave", "no verdict"),
        (np.nan, 1.0, np.nan, "yes", np.nan, "no verdict"),
        (2.0, None, None, "yes", np.nan, "no verdict"),
    ):
        # An empty cell of a reason is NaN.
        row = {"score": score, "threshold": threshold, "probability": probability}
        assert row_verdict(row | {"familiar": familiar, "no_verdict": reason}) == word
    # A place that was passed several times has no probability.
    assert row_verdict({"score": 2.0, "threshold": 1.0}) == "nodule"
