"""The diagonal detector: what it sees of a passage."""

import numpy as np

from capsule.detectors.search import UNKNOWN, Passage
from capsule.detectors.shipped import Diagonal
from support.training import recordings_of


def test_it_sees_the_evidence_the_channels_the_time_and_logarithms():
    known = Passage(0.5, 0.1, 0.2, 0.01, 12.0, 200.0, 130.0, 0.3, 0.4, 0.5)
    # A channel below 0.03 counts as 0.03, so that it has a logarithm.
    logarithms = np.log([0.2, 0.03, 0.3, 0.4, 0.5])
    recordings = recordings_of({"a": known, "b": UNKNOWN})
    seen = Diagonal.seen(recordings["a"])
    np.testing.assert_allclose(seen, [0.5, 0.1, 0.2, 0.01, 130.0, *logarithms])
    assert np.isnan(Diagonal.seen(recordings["b"])[0])
    assert Diagonal.sized_by == slice(1, None)
    # The evidence is the score, which nothing teaches.
    learned, scores = Diagonal.learn(np.tile(seen, (2, 1)), np.zeros(2), np.arange(2), {})
    assert learned is None and scores.tolist() == [0.5, 0.5]
