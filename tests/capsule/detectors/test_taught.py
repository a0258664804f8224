"""The taught detector: recordings left out teach nothing, and the bound of scores holds."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.detectors.passage import UNKNOWN
from capsule.detectors.scorer import Features
from capsule.detectors.taught import TaughtDetector, TaughtModel, upper_bound
from capsule.detectors.training import TrainingArchive
from capsule.seeding import generator
from support.training import NO_TEMPLATES, TAUGHT, verdict_values

SETTINGS = {
    "evaluation": {"specificity": 0.9, "prevalence": 0.1, "size_confidence": 0.9},
    "taught": TAUGHT,
}


def archive_of(sizes_mm, features):
    passages = dict.fromkeys(features, UNKNOWN)
    return TrainingArchive(sizes_mm, NO_TEMPLATES, {}, passages, {}.__getitem__, SETTINGS, features)


@pytest.fixture(scope="module")
def archive():
    """Make an archive with scores and embeddings that grow with the size; one has no score."""
    numbers = generator(1, "taught")
    sizes = {f"{place % 4}mm/r{place}": float(place % 4) for place in range(60)}
    features = {
        name: Features(
            float(2 * size + numbers.normal()),
            np.append(size + 0.2 * numbers.normal(), numbers.normal(size=3)).astype(np.float32),
            (numbers.normal(size=8) + 0.3 * size).astype(np.float32),
        )
        for name, size in sizes.items()
    }
    unknown = np.full(4, np.nan, np.float32), np.full(8, np.nan, np.float32)
    features["1mm/r5"] = Features(float("nan"), *unknown)
    return archive_of(sizes, features)


@pytest.mark.parametrize("left_out", [[], ["0mm/r0"], ["3mm/r7"], ["1mm/r5"], ["0mm/r4", "2mm/r2"]])
def test_a_fold_teaches_what_an_archive_of_its_recordings_alone_does(archive, left_out):
    taught = {name: size for name, size in archive.sizes_mm.items() if name not in left_out}
    expected = TaughtDetector(archive_of(taught, archive.features)).without([])
    model = TaughtDetector(archive).without(left_out)
    for name in archive.sizes_mm:
        recording = archive.recording(name)
        np.testing.assert_allclose(
            verdict_values(model.verdict(recording)),
            verdict_values(expected.verdict(recording)),
            rtol=1e-6,
            atol=1e-6,
        )


def test_large_nodules_are_found_and_sized_with_an_interval(archive):
    detector = TaughtDetector(archive)
    for name, size in archive.sizes_mm.items():
        verdict = detector.without([name]).verdict(archive.recording(name))
        if size == 3.0:
            assert verdict.predicted_mm >= 2
            assert verdict.estimate_low_mm <= verdict.estimate_mm <= verdict.estimate_high_mm


def test_a_recording_without_a_score_has_no_verdict(archive):
    verdict = TaughtDetector(archive).without([]).verdict(archive.recording("1mm/r5"))
    assert np.isnan(verdict.predicted_mm) and np.isnan(verdict.score)


def test_what_is_learned_survives_the_file(archive):
    for left_out in ([], [name for name in archive.sizes_mm if name.startswith("0mm")]):
        model = TaughtDetector(archive).without(left_out)
        content = json.loads(json.dumps(model.stored(), allow_nan=False))
        restored = TaughtModel.restored(content, NO_TEMPLATES)
        for name in ("3mm/r7", "0mm/r0"):
            recording = archive.recording(name)
            np.testing.assert_allclose(
                verdict_values(restored.verdict(recording)),
                verdict_values(model.verdict(recording)),
            )


def test_a_new_recording_needs_only_its_features(archive):
    model = TaughtDetector(archive).without([])
    alone = SimpleNamespace(features=archive.features["3mm/r7"], passage=UNKNOWN)
    expected = model.verdict(archive.recording("3mm/r7"))
    np.testing.assert_equal(verdict_values(model.verdict(alone)), verdict_values(expected))


@pytest.mark.parametrize(("count", "least"), [(5, 0.035), (19, 0.04), (20, 0.04), (200, 0.045)])
def test_a_further_normal_score_exceeds_the_bound_as_rarely_as_promised(count, least):
    scores = generator(1, "bound").normal(size=(20_000, count + 1))
    above = np.mean([row[-1] > upper_bound(row[:-1], 0.95) for row in scores])
    # The standard error is 0.0015. With few scores, the bound promises a little too much.
    assert least <= above <= 0.0525


def test_low_scores_do_not_raise_the_bound_but_high_ones_do():
    scores = generator(2, "bound").normal(size=20)
    lowest, highest = scores.copy(), scores.copy()
    lowest[scores.argmin()] -= 10
    highest[scores.argmax()] += 10
    assert upper_bound(lowest, 0.95) == upper_bound(scores, 0.95)
    assert upper_bound(highest, 0.95) > upper_bound(scores, 0.95) + 2


def test_the_bound_of_scores_is_the_formula_written_out():
    scores = [3.0, -1.0, 0.5, 2.0, 1.0, 0.0, -4.0, 0.2, 1.5]
    # The median of the nine is 0.5, and Student's quantile of four degrees of freedom 2.132.
    spread = ((0.5**2 + 1.0**2 + 1.5**2 + 2.5**2) / 4) ** 0.5
    expected = 0.5 + 2.132 * (1 + 3.14159 / 18) ** 0.5 * spread
    assert upper_bound(np.array(scores), 0.95) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("count", [0, 2])
def test_fewer_than_three_scores_have_no_bound(count):
    assert np.isnan(upper_bound(np.zeros(count), 0.95))
