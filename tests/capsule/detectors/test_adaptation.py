"""The adaptation of the taught scorer: each fold weighs how far it goes."""

import numpy as np
import pytest

from capsule.detectors import adaptation
from capsule.detectors.adaptation import ABOVE, LEAST_SPREAD, STEEPNESS, Adaptation, missed
from capsule.seeding import generator

PENALTIES = (1e3, 1.0, 1e-3)
NOBODY = np.array([], dtype=int)


def archive_of(count, *, told_by_scores, seed="adaptation"):
    """Return features, scores and sizes of an archive whose scores or features tell nodules."""
    numbers = generator(1, seed)
    sizes_mm = np.arange(count) % 4.0
    scores = numbers.normal(size=count) + (6 * sizes_mm if told_by_scores else 0)
    features = numbers.normal(size=(count, 12)).astype(np.float32)
    if not told_by_scores:
        features[:, 0] += 4 * sizes_mm
    return features, scores, sizes_mm


def adaptation_of(archive, penalties=PENALTIES):
    return Adaptation(*archive, 10.0, penalties)


def test_nodules_near_the_healthy_scores_count_as_missed():
    scores = np.array([[0.0, 0.0], [2.0, 4.0], [1.0, 2.0], [9.0, 2.0]])
    sizes_mm = np.array([0.0, 0.0, 1.0, 3.0])
    expected = []
    for column in scores.T:
        mean, spread = column[:2].mean(), column[:2].std(ddof=1) + LEAST_SPREAD
        each = [np.log(1 + np.exp(STEEPNESS * (ABOVE - (s - mean) / spread))) for s in column[2:]]
        expected.append(np.mean(each))
    assert missed(scores, sizes_mm) == pytest.approx(expected)
    assert expected[0] < expected[1]


def test_a_bench_that_the_scorer_knows_is_left_to_the_scorer():
    # So few recordings would teach chance.
    weights = adaptation_of(archive_of(20, told_by_scores=True)).weights(NOBODY)
    assert weights.sum() == pytest.approx(1.0)
    strongest, _, weakest = weights.sum(axis=1)
    assert strongest > 0.8 > weakest


def test_a_bench_that_the_scorer_does_not_know_is_learned_from_the_features():
    archive = archive_of(80, told_by_scores=False)
    strongest, weakest = (adaptation_of(archive, [penalty]) for penalty in PENALTIES[::2])
    weighed = adaptation_of(archive)
    assert weighed.weights(NOBODY)[0].sum() < 0.1
    losses = [
        missed(each.without(NOBODY).scores[:, np.newaxis], archive[2])[0]
        for each in (strongest, weakest, weighed)
    ]
    assert losses[2] < losses[0] and losses[2] < losses[1] + 0.01


@pytest.mark.parametrize("left_out", [[5], [0, 3, 17]])
def test_a_fold_weighs_and_learns_as_an_archive_of_its_recordings_alone(left_out):
    archive = archive_of(40, told_by_scores=False)
    others = tuple(np.delete(part, left_out, axis=0) for part in archive)
    adapted = adaptation_of(archive).without(np.array(left_out))
    alone = adaptation_of(others).without(NOBODY)
    np.testing.assert_allclose(adapted.scores, alone.scores, atol=1e-8)
    np.testing.assert_allclose(
        adapted.correction.coefficients, alone.correction.coefficients, atol=1e-8
    )


def test_each_score_is_the_weighed_prediction_without_its_recording():
    features, scores, sizes_mm = archive_of(40, told_by_scores=False)
    adaptation = adaptation_of((features, scores, sizes_mm))
    everybody, weights = adaptation.without(NOBODY), adaptation.weights(NOBODY)
    place, rises = 13, ((0, 0.3, 0.7, 1), (0, 0.6, 0.9, 1), (0, 1, 1, 1))
    others = np.delete(np.arange(40), place)
    expected = scores[place]
    for penalty, row in zip(PENALTIES, weights, strict=True):
        for rise, weight in zip(rises, row, strict=True):
            lacking = 10 * np.interp(sizes_mm, (0, 1, 2, 3), rise) - scores
            centre, mean = features[others].mean(axis=0), lacking[others].mean()
            centred = features[others] - centre
            normal = centred.T @ centred + penalty * np.eye(12)
            slope = np.linalg.solve(normal, centred.T @ (lacking[others] - mean))
            expected += weight * (mean + (features[place] - centre) @ slope)
    assert everybody.scores[place] == pytest.approx(expected, abs=1e-4)


def test_few_recordings_of_a_large_archive_weigh_and_all_teach(monkeypatch):
    monkeypatch.setattr(adaptation, "_WEIGHING", 20)
    archive = archive_of(90, told_by_scores=False)
    large, weighing = adaptation_of(archive), np.linspace(0, 89, 20).astype(int)
    few = adaptation_of(tuple(part[weighing] for part in archive))
    monkeypatch.setattr(adaptation, "_WEIGHING", 100)
    whole = adaptation_of(archive)
    for left_out in ([], [1], [0], [0, 1, 2, 89]):
        gone = np.array(left_out, dtype=int)
        weights = few.weights(np.flatnonzero(np.isin(weighing, gone)))
        whole.weights = lambda _, weights=weights: weights
        adapted, expected = large.without(gone), whole.without(gone)
        np.testing.assert_allclose(adapted.scores, expected.scores)
        np.testing.assert_allclose(
            adapted.correction.coefficients, expected.correction.coefficients
        )


def test_where_nothing_can_be_weighed_the_largest_penalty_holds():
    features, scores, sizes_mm = archive_of(12, told_by_scores=False)
    for of_one_kind in (sizes_mm > 0, sizes_mm == 0):
        part = (features[of_one_kind], scores[of_one_kind], sizes_mm[of_one_kind])
        weights = adaptation_of(part).weights(NOBODY)
        assert weights[0, 0] == weights.sum() == 1.0
    assert adaptation_of((features[:1], scores[:1], sizes_mm[:1])).without(NOBODY) is None
