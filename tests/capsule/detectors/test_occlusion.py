"""What each stretch adds to the taught score: nothing where beats are usual."""

import numpy as np
import pytest

from capsule.detectors.described import read_scorer
from capsule.detectors.network import SERIES_ROWS, standardised
from capsule.detectors.occlusion import FIRST, STEP, WIDTH, score_stretches
from capsule.engine.project import WEIGHTS


@pytest.fixture(scope="module")
def scorer():
    return read_scorer(WEIGHTS)


def test_usual_beats_are_zero_in_what_is_taken_out_and_nothing_is_lost_by_them(scorer):
    series = np.zeros((4, 5, 40))
    assert not standardised(series)[:, :SERIES_ROWS].any()
    assert standardised(series)[:, SERIES_ROWS:].all()
    score, loss = score_stretches(scorer, series)
    assert score == scorer.features(series).score
    assert not loss.any()


def test_a_stretch_that_raises_the_score_is_lost_by_it(scorer):
    series = 0.1 * np.sin(np.arange(800.0)).reshape(4, 5, 40)
    series[:, 1, 20:24] = 3.0
    whole, loss = score_stretches(scorer, series)
    x = standardised(series)
    x[:, :SERIES_ROWS, 18 : 18 + WIDTH] = 0.0
    assert loss[18 // STEP] == pytest.approx(whole - scorer.forward(x)[0])
    assert loss[18 // STEP] > 0


@pytest.mark.parametrize("beats", [1, 7, 8, 9, 10])
def test_the_stretches_of_a_short_recording_stay_within_it(scorer, beats):
    _, loss = score_stretches(scorer, np.ones((4, 5, beats)))
    assert loss.size == max(beats - WIDTH, 0) // STEP + 1
    assert np.arange(WIDTH).mean() == FIRST


def test_what_cannot_be_scored_has_no_stretches(scorer):
    assert score_stretches(scorer, None) is None
    assert score_stretches(scorer, np.ones((3, 5, 40))) is None
