"""What detectors of scores see of a recording, and the ridge that adapts the network's score."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

from capsule.detectors.base import StoredRecording
from capsule.detectors.network import EMBEDDED
from capsule.detectors.search import UNKNOWN, Passage
from capsule.detectors.shipped import Diagonal, Taught
from capsule.seeding import generator
from support.training import TAUGHT, features_of


def test_diagonal_sees_the_evidence_the_channels_the_time_and_logarithms():
    known = Passage(0.5, 0.1, 0.2, 0.01, 12.0, 200.0, 130.0, 0.3, 0.4, 0.5)
    # A channel below 0.03 counts as 0.03, so that it has a logarithm.
    logarithms = np.log([0.2, 0.03, 0.3, 0.4, 0.5])
    seen, silent = (Diagonal.seen(StoredRecording(None, each)) for each in (known, UNKNOWN))
    np.testing.assert_allclose(seen, [0.5, 0.1, 0.2, 0.01, 130.0, *logarithms])
    assert np.isnan(silent[0])
    assert Diagonal.sized_by == slice(1, None)
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
    wanted = TAUGHT["height"] * np.array([0, 0.6, 0.9, 1.0])[sizes_mm.astype(int)] - score
    ridge, leave = Ridge(alpha=TAUGHT["penalty"]), LeaveOneGroupOut()
    expected = cross_val_predict(ridge, features, wanted, groups=places, cv=leave)
    np.testing.assert_allclose(without_place, score + expected)
    model, ridge = Taught(0.0, learned, None, None), ridge.fit(features, wanted)
    scores = [model.score(row) for row in rows]
    np.testing.assert_allclose(scores, score + ridge.predict(features))


@pytest.mark.parametrize(
    ("size_mm", "rise"),
    [(0, 0), (0.5, 0.3), (1, 0.6), (1.5, 0.75), (2, 0.9), (2.5, 0.95), (3, 1), (5, 1)],
)
def test_the_wanted_score_rises_with_the_size_and_not_beyond_3_mm(size_mm, rise):
    # Features that do not vary teach nothing but the mean of what is wanted.
    seen, sizes_mm = np.zeros((4, 3 + EMBEDDED)), np.full(4, float(size_mm))
    for places in (np.arange(4), np.array([0, 0, 0, 1])):
        learned, without_place = Taught.learn(seen, sizes_mm, places, TAUGHT)
        told = [learned.of(np.zeros(3)), *without_place]
        np.testing.assert_allclose(told, TAUGHT["height"] * rise)
    # A single place teaches no score.
    learned, without_place = Taught.learn(seen, sizes_mm, np.zeros(4, dtype=int), TAUGHT)
    assert learned is None and np.isnan(without_place).all()
    assert np.isnan(Taught(0.0, None, None, None).score(seen[0]))
