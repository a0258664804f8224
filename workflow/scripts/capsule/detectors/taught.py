"""The detector ``taught``: a network that simulated benches trained, adapted to the archive.

To first order, a change of the network's weights changes its score by the gradient times that
change. A ridge regression on the gradients, and on the evidence of the best place, therefore learns
what to add to the score, so that nodules score as far above healthy recordings as they should. All
of it is learned inside the training fold.
"""

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.detectors.base import JudgedRecording, ScoredDetector
from capsule.detectors.calibrate import Regression, fit_ridge
from capsule.detectors.network import EMBEDDED
from capsule.kinds import Settings

# Evidence is clipped to this range; values beyond it add no information.
_EVIDENCE = (-1.0, 4.0)
# Wanted rise of the score over a healthy recording, as a share of the height, by size in mm.
_SIZES_MM, _RISE = (0.0, 1.0, 2.0, 3.0), (0.0, 0.6, 0.9, 1.0)


class Taught(ScoredDetector):
    """The taught detector: the network's score, and what the archive adds to it."""

    name = "taught"
    sized_by = slice(-EMBEDDED, None)

    @staticmethod
    def seen(recording: JudgedRecording) -> FloatArray:
        """Return score, evidence of the best place (0 if unknown), gradient and embedding, (194,).

        The embedding tells the size.
        """
        features, evidence = recording.features, recording.passage.evidence
        bounded = 0.0 if np.isnan(evidence) else min(max(evidence, _EVIDENCE[0]), _EVIDENCE[1])
        return np.concatenate(
            [[features.score, bounded], features.gradient, features.embedding], dtype=np.float64
        )

    def score(self, seen: FloatArray) -> float:
        """Return the adapted score; NaN if too few recordings teach, or no wave is seen."""
        if self.learned is None:
            return float("nan")
        return float(seen[0] + self.learned.of(seen[:-EMBEDDED]))

    @staticmethod
    def learn(
        seen: FloatArray, sizes_mm: FloatArray, places: IntArray, settings: Settings
    ) -> tuple[Regression | None, FloatArray]:
        """Learn what to add to the score; nothing without recordings of two places.

        For the parameters see `ScoredDetector.learn`.
        """
        if np.unique(places).size < 2:
            return None, np.full(len(seen), np.nan)
        scores, features = seen[:, 0], seen[:, 1:-EMBEDDED]
        wanted = settings["height"] * np.interp(sizes_mm, _SIZES_MM, _RISE) - scores
        penalties = np.full(features.shape[1], float(settings["penalty"]))
        penalties[0] /= settings["evidence_weight"] ** 2
        added, without_place = fit_ridge(features, wanted, places, penalties)
        # The score itself is no feature.
        padded = Regression(
            np.insert(added.mean, 0, 0), np.insert(added.coefficients, 0, 0), added.intercept
        )
        return padded, scores + without_place
