"""The stretches that raise the taught score are those in which a sensor passes the nodule."""

import numpy as np
import pytest

from capsule.configuration import read_config_file
from capsule.detectors.beats import series_of
from capsule.detectors.described import read_scorer
from capsule.detectors.network import SERIES_ROWS, standardised
from capsule.page.along_gut import along_gut
from capsule.page.stretches import FIRST, STEP, WIDTH, score_stretches
from capsule.project import WEIGHTS
from capsule.recording import read_recording
from support.project import ROOT

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")["diagonal"]


@pytest.fixture(scope="module")
def scorer():
    return read_scorer(WEIGHTS)


def test_usual_beats_are_zero_in_what_is_taken_out_and_nothing_is_lost_by_them(scorer):
    series = np.zeros((4, 5, 40))
    assert not standardised(series)[:, :SERIES_ROWS].any()
    assert standardised(series)[:, SERIES_ROWS:].all()
    scored = score_stretches(scorer, series)
    assert scored.score == scorer.features(series).score
    assert not scored.loss.any()


def test_the_stretches_in_which_a_sensor_passes_the_nodule_raise_the_score(scorer):
    near_it, elsewhere = [], []
    for path in sorted((ROOT / "raw" / "3mm").glob("r0*.csv")):
        with path.open("rb") as stream:
            values = read_recording(stream, 4).values
        along = along_gut(values, 10, SETTINGS)
        scored = score_stretches(scorer, series_of(values, 10, SETTINGS))
        # A beat is 8 samples, a quarter of a wave.
        at = along.first + 8 * (FIRST + STEP * np.arange(scored.loss.size))
        near = np.nanmin(np.abs(at - along.passed[:, np.newaxis]), axis=0) < 40
        near_it.append(scored.loss[near].mean())
        elsewhere.append(scored.loss[~near].mean())
    assert len(near_it) >= 5
    assert np.mean(near_it) > 1.5 * np.mean(elsewhere) > 0


@pytest.mark.parametrize("beats", [1, 7, 8, 9, 10])
def test_the_stretches_of_a_short_recording_stay_within_it(scorer, beats):
    scored = score_stretches(scorer, np.ones((4, 5, beats)))
    assert scored.loss.size == max(beats - WIDTH, 0) // STEP + 1


def test_what_cannot_be_scored_has_no_stretches(scorer):
    assert score_stretches(scorer, None) is None
    assert score_stretches(scorer, np.ones((3, 5, 40))) is None
