"""The threshold from the scores of healthy recordings."""

import numpy as np
import pytest

from capsule.detectors.operating_point import threshold_at
from capsule.seeding import generator


def test_a_new_healthy_recording_is_called_a_nodule_as_rarely_as_promised():
    scores = generator(1, "threshold").standard_cauchy((4000, 20))
    alarms = [drawn[-1] > threshold_at(drawn[:-1], 0.9) for drawn in scores]
    # 2 of 20 ranks; the standard error of 4000 draws is 0.005.
    assert np.mean(alarms) == pytest.approx(0.1, abs=0.015)


def test_the_threshold_has_the_promised_rank():
    scores = np.arange(1.0, 20.0)  # 19 recordings are just enough for 95 %
    assert threshold_at(scores, 0.95) == 19
    assert threshold_at(scores, 0.90) == 18
    assert threshold_at(scores[:5], 0.95) == 5
    assert np.isnan(threshold_at(np.array([]), 0.95))
