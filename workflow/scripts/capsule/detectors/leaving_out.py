"""Models that are learned without a few recordings of an archive.

A caller that needs the model without one recording usually needs the models without each of the
others. Models of neighbours are therefore learned at once. The curves are fitted side by side,
starting from the curve of all recordings. The size models follow from sums over all recordings
minus one, and differ from a new fit only by rounding. A new fit is made if one recording dominates
the sums, or if several recordings are left out.
"""

from functools import cache, cached_property, lru_cache

import numpy as np

from capsule.arrays import BoolArray, FloatArray, IntArray
from capsule.detectors.probability import Probability, fit_probabilities, fit_probability
from capsule.detectors.sizing import SizeModel, fit_sizes, left_out_errors

# Recordings times folds that are fitted at a time, so that they fit into the processor's cache.
_BLOCK = 2**14
# If a difference of sums is a smaller share than this of the sum, it has lost too many digits.
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

    def __init__(self, scores: FloatArray, nodule: BoolArray, prevalence: float) -> None:
        self._scores, self._nodule, self._prevalence = scores, nodule, prevalence
        self.whole = fit_probability(scores, nodule, prevalence)
        self._rows = max(_BLOCK // max(scores.size, 1), 1)
        self._without_each = cache(self._fit_block)

    def without(self, left_out: IntArray) -> Probability | None:
        """Return the curve without the recordings at some places; None as in `fit_probability`."""
        if left_out.size == 0:
            return self.whole
        if left_out.size == 1:
            block, row = divmod(int(left_out[0]), self._rows)
            return self._without_each(block)[row]
        taught = np.ones((1, self._scores.size), dtype=bool)
        taught[:, left_out] = False
        return self._fit(taught)[0]

    def _fit_block(self, block: int) -> list[Probability | None]:
        """Return the curves without each single recording of some neighbouring ones."""
        places = np.arange(self._scores.size)
        alone = places[block * self._rows : (block + 1) * self._rows, np.newaxis]
        return self._fit(alone != places)

    def _fit(self, taught: BoolArray) -> list[Probability | None]:
        return fit_probabilities(self._scores, self._nodule, self._prevalence, taught, self.whole)


class SizesWithout:
    """The size model of `fit_sizes` without a few recordings.

    Parameters
    ----------
    features : (n, F) array
        Features of all training recordings made over nodules.
    sizes_mm : (n,) array
        Their true sizes.
    ridge : float
        As in `fit_sizes`.
    """

    def __init__(self, features: FloatArray, sizes_mm: FloatArray, ridge: float) -> None:
        self._features, self._sizes_mm, self._ridge = features, sizes_mm, ridge
        self.whole = fit_sizes(features, sizes_mm, ridge)
        # A fold asks for its model twice: for its errors, and for itself.
        self._anew = lru_cache(1)(self._fit_others)

    def without(self, left_out: IntArray) -> SizeModel | None:
        """Return the model without the recordings at some places; None if none remains."""
        if left_out.size == 0:
            return self.whole
        alone = self._without_each[left_out[0]] if left_out.size == 1 else None
        return self._anew(tuple(left_out.tolist())) if alone is None else alone

    def errors_without(self, left_out: IntArray) -> FloatArray:
        """Return the size error of each remaining recording, predicted by the rest of them.

        Parameters
        ----------
        left_out : (m,) array of int
            Places of the recordings that teach nothing.

        Returns
        -------
        (n - m,) array
            Errors in mm, from `left_out_errors`.
        """
        return self._errors_of_all if left_out.size == 0 else self._errors(left_out)

    @cached_property
    def _errors_of_all(self) -> FloatArray:
        return self._errors(np.array([], dtype=int))

    def _errors(self, left_out: IntArray) -> FloatArray:
        model = self.without(left_out)
        if model is None:
            return np.empty(0)
        return left_out_errors(model, *self._others(left_out), self._ridge)

    def _fit_others(self, left_out: tuple[int, ...]) -> SizeModel | None:
        return fit_sizes(*self._others(np.array(left_out)), self._ridge)

    def _others(self, left_out: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the features and sizes of the others."""
        return np.delete(self._features, left_out, axis=0), np.delete(self._sizes_mm, left_out)

    @cached_property
    def _without_each(self) -> list[SizeModel | None]:
        """Models without each single recording; None if too few digits would be left."""
        count = self._sizes_mm.size - 1
        if count < 1:
            return [None] * self._sizes_mm.size
        mean, mean_mm = self._features.mean(axis=0), self._sizes_mm.mean()
        gone, gone_mm = self._features - mean, self._sizes_mm - mean_mm
        whole = gone.T @ gone
        # The sums about the new means follow from those about the means of all recordings.
        outer = gone[:, :, np.newaxis] * gone[:, np.newaxis]
        square = whole - outer * (1 + 1 / count)
        product = gone.T @ gone_mm - gone * gone_mm[:, np.newaxis] * (1 + 1 / count)
        spread = np.diagonal(square, axis1=1, axis2=2)
        enough = (spread > 0) & (spread >= _LEAST_REST * np.diag(whole))
        usable: BoolArray = np.asarray(enough.all(axis=1))
        scale = np.sqrt(np.where(usable[:, np.newaxis], spread, count) / count)
        normal = square / (scale[:, :, np.newaxis] * scale[:, np.newaxis])
        normal += self._ridge * np.eye(mean.size)
        normal[~usable] = np.eye(mean.size)
        coefficients = np.linalg.solve(normal, (product / scale)[..., np.newaxis])[..., 0]
        ordered = np.sort(self._sizes_mm)
        # If the only recording of the smallest size is left out, the next size is the smallest.
        smallest = np.where(self._sizes_mm == ordered[0], ordered[1], ordered[0])
        largest = np.where(self._sizes_mm == ordered[-1], ordered[-2], ordered[-1])
        intercepts = mean_mm - gone_mm / count
        return [
            SizeModel(*learned) if known else None
            for known, *learned in zip(
                usable, mean - gone / count, scale, coefficients,
                intercepts.tolist(), smallest.tolist(), largest.tolist(), strict=True,
            )
        ]  # fmt: skip
