"""The taught detector: what it sees, and the ridge that adapts the network's score."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

from capsule.detectors.network import EMBEDDED
from capsule.detectors.search import UNKNOWN
from capsule.detectors.shipped import Taught
from capsule.seeding import generator
from support.training import TAUGHT, features_of


@pytest.mark.parametrize(
    ("evidence", "seen"), [(float("nan"), 0), (-3, -1), (-0.5, -0.5), (3.9, 3.9), (4.1, 4)]
)
def test_it_sees_score_evidence_from_minus_1_to_4_gradient_and_embedding(evidence, seen):
    features, passage = features_of(1.5, [2.0], [3.0]), replace(UNKNOWN, evidence=evidence)
    row = Taught.seen(SimpleNamespace(features=features, passage=passage))
    np.testing.assert_allclose(row, [1.5, seen, *features.gradient, *features.embedding])
    assert Taught.sized_by == slice(-EMBEDDED, None)


@pytest.mark.parametrize("passes_of", [1, 2])
def test_the_score_is_the_ridge_of_scikit_learn_on_evidence_and_gradient(passes_of):
    numbers = generator(1, "taught ridge")
    seen, sizes_mm = numbers.normal(size=(24, 4)), np.arange(24.0) % 4
    places = np.arange(24) // passes_of
    settings = TAUGHT | {"evidence_weight": 3.0}
    rows = np.column_stack([seen, numbers.normal(size=(24, EMBEDDED))])
    learned, without_place = Taught.learn(rows, sizes_mm, places, settings)
    # The evidence is penalised by its own weight.
    score, features = seen[:, 0], seen[:, 1:] * [3, 1, 1]
    wanted = TAUGHT["height"] * np.array([0, 0.6, 0.9, 1.0])[sizes_mm.astype(int)] - score
    ridge, leave = Ridge(alpha=TAUGHT["penalty"]), LeaveOneGroupOut()
    expected = cross_val_predict(ridge, features, wanted, groups=places, cv=leave)
    np.testing.assert_allclose(without_place, score + expected)
    model, expected = (
        Taught(0.0, learned, None, None),
        ridge.fit(features, wanted).predict(features),
    )
    np.testing.assert_allclose([model.score(row) for row in rows], score + expected)


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
    assert np.isnan(Taught(0.0, None, None, None).score(seen[0]))
    assert Taught.learn(seen, sizes_mm, np.array([0, 0, 0, 1]), TAUGHT)[0] is not None
