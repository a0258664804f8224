"""The detector ``loudest``: how far the envelopes rise above the threshold c."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.base import JudgedRecording, ScoredDetector


class Loudest(ScoredDetector):
    """Judges by the largest entry of the matrix V; threshold, probability and size are learned."""

    name = "loudest"

    @staticmethod
    def seen(recording: JudgedRecording) -> FloatArray:
        """Return the score of one recording, (1,)."""
        return np.array([recording.matrix.max()])
