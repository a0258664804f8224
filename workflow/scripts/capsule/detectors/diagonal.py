"""The detector ``diagonal``: beats that agree on one place, against a threshold."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.base import JudgedRecording, ScoredDetector
from capsule.detectors.search import Passage

# In usual depths. A lower limit, so that a place without raised beats has a logarithm, too.
_LEAST_CHANNEL = 0.03


class Diagonal(ScoredDetector):
    """The diagonal detector: its score is the evidence of the best place."""

    name = "diagonal"
    sized_by = slice(1, None)

    @staticmethod
    def seen(recording: JudgedRecording) -> FloatArray:
        """Return the evidence of the best place, and its `size_features`, (10,)."""
        return np.append(recording.passage.evidence, size_features(recording.passage))


def size_features(passage: Passage) -> FloatArray:
    """Return the features from which a size is estimated, (9,).

    The features are the channels at the place, the time from sensor to sensor, the logarithms of
    depth and shape, and the logarithms of the channels' spreads over the run. Logarithms fit,
    because the size multiplies depth and shape. The time fits, because a large nodule slows the
    capsule down.
    """
    risen = np.maximum([passage.depth, passage.shape], _LEAST_CHANNEL)
    spreads = [passage.level_spread, passage.depth_spread, passage.shape_spread]
    plain = [passage.level, passage.depth, passage.shape, passage.lag_samples]
    return np.concatenate([plain, np.log(risen), np.log(spreads)])
