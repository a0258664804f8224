"""The three detectors that ship with the project, as `capsule.detectors.registry` lists them.

``template`` is the paper's rule. ``diagonal`` and ``taught`` compare a score with a threshold, by
`capsule.detectors.base.ScoredDetector`.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.detectors.base import (
    Detector,
    JudgedRecording,
    ScoredDetector,
    TrainingArchive,
    Verdict,
)
from capsule.detectors.calibrate import Regression, fit_ridge
from capsule.detectors.network import EMBEDDED
from capsule.detectors.search import Passage
from capsule.kinds import Settings
from capsule.method.sliding import RepeatedParticle
from capsule.method.templates import (
    TemplateSet,
    compare_templates,
    first_peak_sample,
    index_of_largest,
    nearest_size,
)

# In usual depths. A lower limit, so that a place without raised beats has a logarithm, too.
_LEAST_CHANNEL = 0.03
# Evidence is clipped to this range; values beyond it add no information.
_EVIDENCE = (-1.0, 4.0)
# Wanted rise of the score over a healthy recording, as a share of the height, by size in mm.
_SIZES_MM, _RISE = (0.0, 1.0, 2.0, 3.0), (0.0, 0.6, 0.9, 1.0)


@dataclass(frozen=True)
class NearestTemplate(Detector):
    """The detector ``template``, the paper's rule: the size of the nearest template of a fold.

    The templates of all recordings, `whole`, give the sizes and the first peak; `templates` are
    the 1 + B of the fold, T^0 first.
    """

    whole: TemplateSet
    templates: tuple[RepeatedParticle, ...]

    @classmethod
    def taught(cls, archive: TrainingArchive, left_out: Collection[str] = ()) -> Self:
        """Average the templates of the recordings that are not left out."""
        apart = frozenset(left_out)
        # In the order of the archive, because rounding makes a sum depend on the order.
        matrices = archive.templates.without(
            (size_mm, archive.particles.get(name))
            for name, size_mm in archive.sizes_mm.items()
            if name in apart
        )
        return cls(archive.templates, tuple(map(RepeatedParticle, matrices)))

    def verdict(self, recording: JudgedRecording) -> Verdict:
        """Judge one recording; the score is the margin, of which a nodule has one above 0."""
        distances, gains, lags = compare_templates(recording.matrix, self.templates)
        predicted_mm = nearest_size(distances, self.whole.sizes_mm)
        # T^0 comes first and stands for no nodule.
        best = index_of_largest(gains[1:])
        margin = np.nan if best is None else float(gains[1 + best])
        size_mm = location = np.nan
        if best is not None and predicted_mm > 0:
            size_mm, length = predicted_mm, self.templates[0].values.shape[1]
            location = first_peak_sample(float(lags[1 + best]), self.whole.first_peak, length)
        return Verdict(
            predicted_mm,
            margin,
            0.0,
            estimate_mm=size_mm,
            location_samples=location,
            distances=tuple(distances.tolist()),
        )

    def stored(self) -> dict[str, Any]:
        """Return an empty dict, because the templates have a file of their own."""
        return {}

    @classmethod
    def restored(cls, stored: Settings, templates: TemplateSet) -> Self:
        """Return the detector with the templates of all recordings."""
        return cls(templates, tuple(map(RepeatedParticle, templates.matrices)))


class Diagonal(ScoredDetector):
    """The detector ``diagonal``: its score is the evidence of the place at which beats agree."""

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


class Taught(ScoredDetector):
    """The detector ``taught``: a network that simulated benches trained, adapted to the archive.

    To first order, a change of the network's weights changes its score by the gradient times that
    change. A ridge regression on the gradients, and on the evidence of the best place, therefore
    learns what to add to the score, so that nodules score as far above healthy recordings as they
    should. All of it is learned inside the training fold.
    """

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
