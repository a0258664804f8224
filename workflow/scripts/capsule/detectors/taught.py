"""The detector ``taught``: a network that simulated benches trained, adapted to the archive.

To first order, a change of the network's weights changes its score by the gradient times that
change. A ridge regression on the gradients, and on the evidence of the best place, therefore learns
what to add to the score, so that nodules score as far above healthy recordings as they should. All
of it is learned inside the training fold.
"""

import numpy as np

from capsule.arrays import FloatArray, IntArray, RealArray
from capsule.detectors.base import ScoredDetector, ScoredModel
from capsule.detectors.calibrate import Regression, fit_ridge
from capsule.detectors.training import JudgedRecording
from capsule.kinds import Settings

# Evidence is clipped to this range; values beyond it add no information.
_EVIDENCE = (-1.0, 4.0)
# Wanted rise of the score over a healthy recording, as a share of the height, by size in mm.
_SIZES_MM, _RISE = (0.0, 1.0, 2.0, 3.0), (0.0, 0.6, 0.9, 1.0)


class TaughtModel(ScoredModel):
    """The taught detector's model: the network's score, and what the archive adds to it."""

    name = "taught"

    @staticmethod
    def seen(recording: JudgedRecording) -> RealArray:
        """Return score, evidence of the best place (0 if it is unknown) and gradient, (130,)."""
        features, evidence = recording.features, recording.passage.evidence
        bounded = 0.0 if np.isnan(evidence) else min(max(evidence, _EVIDENCE[0]), _EVIDENCE[1])
        return np.concatenate([[features.score, bounded], features.gradient])

    def score(self, recording: JudgedRecording) -> float:
        """Return the adapted score; NaN if too few recordings teach, or no wave is seen."""
        return super().score(recording) if self.learned else float("nan")

    @classmethod
    def size_features(cls, recording: JudgedRecording) -> RealArray:
        """Return the embedding, (64,)."""
        return recording.features.embedding

    @staticmethod
    def learn(
        seen: RealArray, sizes_mm: FloatArray, places: IntArray, settings: Settings
    ) -> tuple[Regression | None, FloatArray]:
        """Learn what to add to the score; nothing without recordings of two places.

        For the parameters see `ScoredModel.learn`.
        """
        if np.unique(places).size < 2:
            return None, np.full(len(seen), np.nan)
        scores, features = np.asarray(seen[:, 0], dtype=np.float64), seen[:, 1:]
        wanted = settings["height"] * np.interp(sizes_mm, _SIZES_MM, _RISE) - scores
        penalties = np.full(features.shape[1], float(settings["penalty"]))
        penalties[0] /= settings["evidence_weight"] ** 2
        added, without_place = fit_ridge(features, wanted, places, penalties)
        # The score itself is no feature.
        padded = Regression(
            np.insert(added.mean, 0, 0), np.insert(added.coefficients, 0, 0), added.intercept
        )
        return padded, scores + without_place


class TaughtDetector(ScoredDetector):
    """The detector ``taught``, adapted to an archive."""

    Model = TaughtModel
