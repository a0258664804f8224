"""What every detector of the registry keeps to; a new row there is tested without a line here."""

import json
from dataclasses import asdict, replace
from functools import partial

import numpy as np
import pytest

from capsule.detectors.base import ScoredDetector, StoredRecording, TrainingArchive
from capsule.detectors.calibrate import fit_probability, fit_sizes, rank_threshold
from capsule.detectors.registry import DETECTORS, PAPER, detector_class, detector_row
from capsule.detectors.search import Passage
from capsule.detectors.shipped import NearestTemplate
from capsule.errors import CapsuleError
from capsule.method import templates as method
from capsule.method.particle import Particle, render
from capsule.method.templates import template_distances
from capsule.seeding import generator
from support.training import TAUGHT, features_of

SIZES_MM = {f"{place % 4}mm/r{place}": float(place % 4) for place in range(60)}
# This one has no passage, no features and a matrix of NaN.
SILENT = "1mm/r5"
# Two recordings are passes over a place.
PLACES = {name: f"{name[:3]}/{place // 8}" for place, name in enumerate(SIZES_MM)}
SETTINGS = {
    "evaluation": {"specificity": 0.9, "prevalence": 0.1, "size_confidence": 0.9},
    # Of a detector without a setting for it, the ridge is 1.
    "diagonal": {},
    "taught": TAUGHT | {"size_ridge": 2.0},
}
SHAPE = {"sensors": 3, "first_peak": 20, "length": 120}
EVERY = {name: detector_class(name) for name in DETECTORS}
SCORED = {name: each for name, each in EVERY.items() if issubclass(each, ScoredDetector)}
every_detector = pytest.mark.parametrize("detector", list(EVERY.values()), ids=list(EVERY))
every_scored_one = pytest.mark.parametrize("detector", list(SCORED.values()), ids=list(SCORED))


def recording_of(size_mm, numbers):
    """Return a recording of which all that a detector may see grows with the size."""
    particle = Particle(np.ones(3), np.full(3, 0.3), numbers.uniform(30, 40, 2), np.full(3, 9))
    matrix = np.maximum(numbers.normal(0.0, 0.1, (3, 120)), 0.0)
    if size_mm:
        matrix += size_mm / 3 * render(particle, 20, 120)
    level = size_mm + numbers.normal(size=6) / 3
    evidence = level[0] + numbers.normal()
    passage = Passage(evidence, *level[1:4], 10.0, 200.0, 130.0, *np.exp(level[3:]))
    features = features_of(
        2 * size_mm + numbers.normal(),
        [size_mm + 0.2 * numbers.normal(), *numbers.normal(size=3)],
        numbers.normal(size=8) + 0.3 * size_mm,
    )
    return StoredRecording(lambda: matrix, passage, features=features), particle


def archive_of(made, places):
    """Return an archive of recordings and their particles."""
    sizes_mm = {name: SIZES_MM[name] for name in made}
    particles = {name: each for name, (_, each) in made.items() if SIZES_MM[name]}
    templates = method.build_templates(method.by_size(particles), **SHAPE)
    recordings = {name: each for name, (each, _) in made.items()}
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


LEFT_OUT = [[], ["0mm/r0"], ["3mm/r7"], [SILENT], ["2mm/r2", "0mm/r4", "3mm/r7"]]
LEFT_OUT.append([name for name in SIZES_MM if name < "1mm/r4"])


@every_detector
@pytest.mark.parametrize("left_out", LEFT_OUT, ids=lambda names: f"{len(names)} {names[:1]}")
def test_a_fold_teaches_what_an_archive_of_it_alone_does(detector, archive, made, left_out):
    rest = {name: each for name, each in made.items() if name not in left_out}
    models = detector.taught(archive, left_out), detector.taught(archive_of(rest, archive.places))
    found, expected = (values_of(each, archive.recordings.values()) for each in models)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


@every_detector
@pytest.mark.parametrize("left_out", [[], [name for name in SIZES_MM if name.startswith("0mm")]])
def test_what_is_stored_as_json_judges_as_what_was_learned(detector, archive, left_out):
    if left_out and detector not in SCORED.values():
        left_out = []  # Templates have a file of their own, which holds those of all recordings.
    model = detector.taught(archive, left_out)
    content = json.loads(json.dumps(model.stored(), allow_nan=False))
    models = detector.restored(content, archive.templates), model
    found, expected = (values_of(each, archive.recordings.values()) for each in models)
    np.testing.assert_allclose(found, expected)


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


@every_scored_one
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
    verdict = model.verdict(archive.recordings["3mm/r7"])
    assert verdict.probability == float(model.probability.of(verdict.score))
    assert (verdict.location_samples, verdict.location_mm) == (200.0, 10.0)


@every_scored_one
def test_a_score_at_the_threshold_is_no_nodule(detector, archive):
    model, recording = detector.taught(archive), archive.recordings["3mm/r7"]
    score = model.score(detector.seen(recording))
    at = replace(model, threshold=score).verdict(recording)
    assert (at.predicted_mm, at.score, at.threshold) == (0.0, score, score)
    assert replace(model, threshold=np.nextafter(score, -9)).verdict(recording).predicted_mm > 0
    unset = replace(model, threshold=float("nan")).verdict(recording)
    assert np.isnan([unset.predicted_mm, unset.probability]).all()


def test_the_registry_begins_with_the_papers_detector_and_refuses_a_name_that_it_has_not():
    assert next(iter(DETECTORS)) == PAPER
    for look_up in (detector_row, detector_class):
        with pytest.raises(CapsuleError, match="no detector nearest; allowed are: template, diag"):
            look_up("nearest")


def test_the_papers_verdict_is_that_of_the_nearest_template_of_the_fold(archive):
    whole, found, left_out = archive.templates, 0, ["2mm/r2", "0mm/r4", "3mm/r7"]
    fold = whole.without((SIZES_MM[name], archive.particles.get(name)) for name in left_out)
    model = NearestTemplate.taught(archive, left_out)
    for recording in archive.recordings.values():
        verdict, expected = model.verdict(recording), template_distances(recording.matrix, fold)
        np.testing.assert_array_equal(verdict.distances, expected)
        np.testing.assert_equal(verdict.predicted_mm, method.nearest_size(expected, whole.sizes_mm))
        _, gains, lags = method.compare_templates(recording.matrix, model.templates)
        np.testing.assert_equal((verdict.score, verdict.threshold), (max(gains[1:]), 0.0))
        if verdict.predicted_mm > 0:
            found += 1
            best = int(np.argmax(gains[1:])) + 1
            assert verdict.estimate_mm == verdict.predicted_mm
            assert verdict.location_samples == method.first_peak_sample(lags[best], 20, 120)
    assert 0 < found < len(archive.sizes_mm)
    # Without a template of a nodule there is no margin.
    none = method.build_templates({}, **SHAPE)
    model = NearestTemplate.taught(replace(archive, templates=none, sizes_mm={"0mm/r0": 0.0}))
    verdict = model.verdict(archive.recordings["0mm/r0"])
    assert np.isnan(verdict.score) and verdict.predicted_mm == 0
