"""The detector ``loudest``: how far the envelopes rise above the threshold c."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.base import ScoredDetector, ScoredModel
from capsule.detectors.training import JudgedRecording


class LoudestModel(ScoredModel):
    """Judges by the largest entry of the matrix V."""

    name = "loudest"

    @staticmethod
    def seen(recording: JudgedRecording) -> FloatArray:
        """Return the score of one recording, (1,)."""
        return np.array([recording.matrix.max()])


class Loudest(ScoredDetector):
    """Learns the threshold, the probability and the size."""

    Model = LoudestModel
