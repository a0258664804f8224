"""Adapt the scorer of the detector ``taught`` to an archive, as strongly as the archive asks for.

Ridge regression predicts what the scorer's scores lack. Benches differ in how much the scorer knows
of them. So each training fold weighs several regressions. They differ in their penalty, and in how
high the scores of small nodules should rise. A regression has more weight if its cross-validated
scores separate the nodules better.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from capsule.arrays import FloatArray, IntArray, RealArray
from capsule.detectors.ridge import Fold, Regression, RidgeWithout

# A nodule should score by so many standard deviations above the healthy mean.
ABOVE, STEEPNESS, LEAST_SPREAD = 1.75, 1.5, 0.05
# Wanted rise of the score over a healthy recording, as a share of the height, by size in mm.
SIZES_MM = (0.0, 1.0, 2.0, 3.0)
RISES = ((0.0, 0.3, 0.7, 1.0), (0.0, 0.6, 0.9, 1.0), (0.0, 1.0, 1.0, 1.0))
# How fast the weight of a regression falls with the nodules that it misses.
STRICTNESS = 0.3
# Smaller weights, relative to the largest one, are left out.
_LEAST_WEIGHT = 0.05
# No more recordings than these weigh, so that the time grows linearly with the archive.
_WEIGHING = 600


class Adapted(NamedTuple):
    """A scorer that a training fold has adapted.

    Attributes
    ----------
    correction : Regression
        Correction to add to the score, from the features of a recording.
    scores : (n - m,) array
        Cross-validated score of each recording that teaches.
    """

    correction: Regression
    scores: FloatArray


class Adaptation:
    """The adaptation to an archive from which recordings can be left out.

    Parameters
    ----------
    features : (n, P) array
        Features of the recordings that teach.
    scores : (n,) array
        Their scores, from the scorer as it was taught beforehand.
    sizes_mm : (n,) array
        True sizes of their nodules in mm; 0 for none.
    height : float
        Wanted rise of the score of nodules of 3 mm and more.
    penalties : sequence of float
        Penalties of the regressions. The largest one alone holds if nothing can be weighed.
    """

    def __init__(
        self,
        features: RealArray,
        scores: FloatArray,
        sizes_mm: FloatArray,
        height: float,
        penalties: Sequence[float],
    ) -> None:
        self._scores, self._sizes_mm = scores, sizes_mm
        rises = np.array([np.interp(sizes_mm, SIZES_MM, rise) for rise in RISES]).T
        lacking = height * rises - scores[:, np.newaxis]
        self._ridges = RidgeWithout(features, lacking, sorted(penalties, reverse=True))
        self._shape = len(penalties), len(RISES)
        self._weighing: IntArray = np.arange(scores.size)
        self._weigher = self
        if scores.size > _WEIGHING:
            self._weighing = np.linspace(0, scores.size - 1, _WEIGHING).astype(int)
            few = self._weighing
            self._weigher = Adaptation(features[few], scores[few], sizes_mm[few], height, penalties)

    def without(self, left_out: IntArray) -> Adapted | None:
        """Adapt the scorer by all recordings except some.

        Parameters
        ----------
        left_out : (m,) array of int
            Places of the recordings that teach nothing, in rising order.

        Returns
        -------
        Adapted or None
            None if fewer than two recordings are left.
        """
        if self._scores.size - left_out.size < 2:
            return None
        weights = self._weigher.weights(np.flatnonzero(np.isin(self._weighing, left_out)))
        scores = np.delete(self._scores, left_out)
        weighed: list[tuple[float, Regression]] = []
        for of_penalty, fold in zip(weights, self._folds(left_out), strict=True):
            if of_penalty.any():
                scores += fold.predictions @ of_penalty
                weighed += zip(of_penalty.tolist(), fold.regressions, strict=True)
        coefficients = np.sum([weight * each.coefficients for weight, each in weighed], axis=0)
        intercept = sum(weight * each.intercept for weight, each in weighed)
        return Adapted(Regression(coefficients, intercept), scores)

    def weights(self, left_out: IntArray) -> FloatArray:
        """Return the weight of each regression, as all recordings except some see it.

        Parameters
        ----------
        left_out : (m,) array of int
            As in `without`.

        Returns
        -------
        (penalties, courses of the wanted scores) array
            Weights whose sum is 1.
        """
        return self._weighed(left_out) if left_out.size else self._weights_of_all

    @cached_property
    def _weights_of_all(self) -> FloatArray:
        return self._weighed(np.array([], dtype=int))

    def _weighed(self, left_out: IntArray) -> FloatArray:
        sizes_mm = np.delete(self._sizes_mm, left_out)
        healthy, nodules = np.count_nonzero(sizes_mm == 0), np.count_nonzero(sizes_mm > 0)
        if healthy < 2 or nodules < 1:
            alone = np.zeros(self._shape)
            alone[0, 0] = 1.0
            return alone
        scores = np.delete(self._scores, left_out)[:, np.newaxis]
        folds = self._folds(left_out)
        losses = np.array([missed(scores + fold.predictions, sizes_mm) for fold in folds])
        weights: FloatArray = np.exp(-STRICTNESS * nodules * (losses - losses.min()))
        weights[weights < _LEAST_WEIGHT] = 0.0
        weights /= weights.sum()
        return weights

    def _folds(self, left_out: IntArray) -> list[Fold]:
        folds = self._ridges.without(left_out)
        assert folds is not None, "at least two recordings are left"
        return folds


def missed(scores: FloatArray, sizes_mm: FloatArray) -> FloatArray:
    """Return a smooth measure of the nodules whose scores are too close to the healthy ones.

    It is the mean of ``log(1 + exp(STEEPNESS (ABOVE - z)))`` over the nodules, with z in standard
    deviations above the mean of the healthy scores. The scorer's training lowers the same measure.

    Parameters
    ----------
    scores : (n, T) array
        Scores of n recordings, T of each.
    sizes_mm : (n,) array
        True sizes of their nodules in mm; 0 for none. At least two are 0, and one is not.

    Returns
    -------
    (T,) array
        The measure for each of T.
    """
    healthy, nodules = scores[sizes_mm == 0], scores[sizes_mm > 0]
    spread = healthy.std(axis=0, ddof=1) + LEAST_SPREAD
    above = (nodules - healthy.mean(axis=0)) / spread
    loss: FloatArray = np.logaddexp(0.0, STEEPNESS * (ABOVE - above)).mean(axis=0)
    return loss
