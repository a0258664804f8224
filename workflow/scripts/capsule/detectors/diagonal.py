"""The diagonal detector: beats that agree on one place, against a threshold."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.base import ScoredDetector, ScoredModel
from capsule.detectors.search import Passage
from capsule.detectors.training import JudgedRecording

# In usual depths. A lower limit, so that a place without raised beats has a logarithm, too.
_LEAST_CHANNEL = 0.03
_SIZE_FEATURES = (
    "level",
    "depth",
    "shape",
    "lag_samples",
    "level_spread",
    "depth_spread",
    "shape_spread",
)


class DiagonalModel(ScoredModel):
    """The diagonal detector's model: its score is the evidence of the best place."""

    name = "diagonal"

    @staticmethod
    def seen(recording: JudgedRecording) -> FloatArray:
        """Return the evidence of the best place, (1,)."""
        return np.array([recording.passage.evidence])

    @classmethod
    def size_features(cls, recording: JudgedRecording) -> FloatArray:
        """Return the `size_features` of the best place, (9,)."""
        return size_features(recording.passage)


class DiagonalDetector(ScoredDetector):
    """The detector ``diagonal``, taught by an archive; it learns nothing for its score."""

    Model = DiagonalModel


def size_features(passage: Passage) -> FloatArray:
    """Return the features from which a size is estimated, (9,).

    The features are the channels at the place, the time from sensor to sensor, the logarithms of
    depth and shape, and the logarithms of the channels' spreads over the run. Logarithms fit,
    because the size multiplies depth and shape. The time fits, because a large nodule slows the
    capsule down.
    """
    values = np.array([getattr(passage, name) for name in _SIZE_FEATURES])
    risen = np.maximum(values[1:3], _LEAST_CHANNEL)
    return np.concatenate([values[:4], np.log(risen), np.log(values[4:])])
