"""What is learned without a few recordings of an archive.

The sizes follow from sums over all recordings minus those left out, and differ from learning anew
by rounding; where what is left is too far from the whole for that, they are learned anew. The
curves without each single recording are fitted all at once, near the curve of all.
"""

from functools import cached_property

import numpy as np

from capsule.detectors.operating_point import Probability, fit_probabilities, fit_probability
from capsule.detectors.sizing import SizeModel, fit_sizes

# Recordings times folds that are learned from at a time, for the processor's cache.
_BLOCK = 2**14
# Differences of sums that keep less than this of them have lost too many digits.
_LEAST_REST = 1e-6


class ProbabilityWithout:
    """The logistic curve of `fit_probability` without a few recordings.

    Parameters
    ----------
    scores : (n,) array
        Scores of all training recordings, none unknown.
    nodule : (n,) array of bool
        Which of them were made over a nodule.
    prevalence : float
        As in `fit_probability`.
    """

    def __init__(self, scores: np.ndarray, nodule: np.ndarray, prevalence: float) -> None:
        self._scores, self._nodule, self._prevalence = scores, nodule, prevalence
        self.whole = fit_probability(scores, nodule, prevalence)

    def without(self, left_out: np.ndarray) -> Probability | None:
        """Give the curve without some recordings, by their places; None as in `fit_probability`."""
        if left_out.size == 0:
            return self.whole
        if left_out.size == 1:
            return self._without_each[left_out[0]]
        taught = np.ones((1, self._scores.size), dtype=bool)
        taught[:, left_out] = False
        return self._fit(taught)[0]

    @cached_property
    def _without_each(self) -> list[Probability | None]:
        """Curves without each single recording: who asks for one will ask for the others."""
        places = np.arange(self._scores.size)
        rows = max(_BLOCK // places.size, 1)
        blocks = (places[start : start + rows, np.newaxis] for start in places[::rows])
        return [curve for alone in blocks for curve in self._fit(alone != places)]

    def _fit(self, taught: np.ndarray) -> list[Probability | None]:
        return fit_probabilities(self._scores, self._nodule, self._prevalence, taught, self.whole)


class SizesWithout:
    """The size model of `fit_sizes` without a few recordings: sums over all, minus those.

    Parameters
    ----------
    features : (n, F) array
        Features of all training recordings made over nodules.
    sizes_mm : (n,) array
        Their true sizes.
    ridge : float
        As in `fit_sizes`.
    """

    def __init__(self, features: np.ndarray, sizes_mm: np.ndarray, ridge: float) -> None:
        self._features, self._sizes_mm, self._ridge = features, sizes_mm, ridge
        self.whole = fit_sizes(features, sizes_mm, ridge)
        if self.whole is None:
            return
        self._mean, self._mean_mm = features.mean(axis=0), sizes_mm.mean()
        self._centred, self._centred_mm = features - self._mean, sizes_mm - self._mean_mm
        self._square = self._centred.T @ self._centred
        self._least_spread = _LEAST_REST * np.diag(self._square)
        self._penalty = ridge * np.eye(features.shape[1])
        self._product = self._centred.T @ self._centred_mm
        self._known_mm, self._of_size = np.unique(sizes_mm, return_counts=True)

    def without(self, left_out: np.ndarray) -> SizeModel | None:
        """Give the model without some recordings, by their places; None without any other."""
        if left_out.size == 0:
            return self.whole
        found = self._from_sums(left_out)
        if found is not None:
            return found
        taught = np.delete(np.arange(self._sizes_mm.size), left_out)
        return fit_sizes(self._features[taught], self._sizes_mm[taught], self._ridge)

    def _from_sums(self, left_out: np.ndarray) -> SizeModel | None:
        """Give the model without some recordings; None where too few digits would be left."""
        count = self._sizes_mm.size - left_out.size
        if count < 1:
            return None
        gone, gone_mm = self._centred[left_out], self._centred_mm[left_out]
        # The sums about the new means, from those about the means of all.
        shift, shift_mm = -gone.sum(axis=0) / count, -gone_mm.sum() / count
        square = self._square - gone.T @ gone - count * np.outer(shift, shift)
        product = self._product - gone.T @ gone_mm - count * shift * shift_mm
        spread = square.diagonal()
        if (spread < self._least_spread).any() or not (spread > 0).all():
            return None
        scale = np.sqrt(spread / count)
        normal = square / np.outer(scale, scale) + self._penalty
        coefficients = np.linalg.solve(normal, product / scale)
        places = np.searchsorted(self._known_mm, self._sizes_mm[left_out])
        rest = self._of_size - np.bincount(places, minlength=self._known_mm.size)
        left_mm = self._known_mm[rest > 0]
        return SizeModel(
            self._mean + shift,
            scale,
            coefficients,
            float(self._mean_mm + shift_mm),
            float(left_mm[0]),
            float(left_mm[-1]),
        )
