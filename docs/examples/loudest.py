"""The detector ``loudest``: how far the envelopes rise above the threshold c."""

from capsule.detectors.scored import ScoredDetector, ScoredModel
from capsule.detectors.training import JudgedRecording


class LoudestModel(ScoredModel):
    """Judges by the largest entry of the matrix V."""

    name = "loudest"

    @staticmethod
    def score(recording: JudgedRecording) -> float:
        """Score one recording."""
        return float(recording.matrix.max())


class Loudest(ScoredDetector):
    """Learns the threshold."""

    Model = LoudestModel
