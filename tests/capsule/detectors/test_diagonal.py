"""The diagonal detector: what it sees of a passage, and the interval of its sizes."""

import numpy as np
import pytest

from capsule.detectors.diagonal import Diagonal
from capsule.detectors.search import UNKNOWN, Passage
from support.training import archive_of_passages, recordings_of

LEARNING = {"specificity": 0.9, "prevalence": 0.5, "size_ridge": 1.0}


def passage(score, size=0.0):
    return Passage(score, size, size, size, 10.0, 200.0, 130.0, *[np.exp(size)] * 3)


def test_it_sees_the_evidence_the_channels_the_time_and_logarithms():
    known = Passage(0.5, 0.1, 0.2, 0.01, 12.0, 200.0, 130.0, 0.3, 0.4, 0.5)
    # A channel below 0.03 counts as 0.03, so that it has a logarithm.
    logarithms = np.log([0.2, 0.03, 0.3, 0.4, 0.5])
    recordings = recordings_of({"a": known, "b": UNKNOWN})
    seen = Diagonal.seen(recordings["a"])
    np.testing.assert_allclose(seen, [0.5, 0.1, 0.2, 0.01, 130.0, *logarithms])
    assert np.isnan(Diagonal.seen(recordings["b"])[0])
    assert Diagonal.sized_by == slice(1, None)


def test_a_recording_does_not_teach_its_own_verdict():
    sizes = {f"0mm/r{run}": 0.0 for run in range(10)} | {"1mm/r0": 1.0, "2mm/r0": 2.0}
    passages = {name: passage(0.1 * place, sizes[name]) for place, name in enumerate(sizes)}
    passages["0mm/r9"] = passage(9.0)
    archive = archive_of_passages(passages, sizes, **LEARNING)

    def judge(name, left_out):
        return Diagonal.taught(archive, left_out).verdict(archive.recordings[name])

    alone = judge("0mm/r9", ["0mm/r9"])
    assert alone.threshold == pytest.approx(0.8)
    assert alone.predicted_mm > 0 and judge("0mm/r9", []).predicted_mm == 0
    without_a_size = judge("2mm/r0", ["2mm/r0", "0mm/r9"])
    assert without_a_size.estimate_mm == 1.0
    # No recording is left to predict the one other nodule.
    assert (without_a_size.estimate_low_mm, without_a_size.estimate_high_mm) == (1.0, np.inf)
