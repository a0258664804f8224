"""What is learned without a few recordings of an archive.

Who asks for what is learned without one recording will ask for the others: all of it is learned at
once. The curves are fitted side by side, near the curve of all. The sizes follow from sums over all
recordings minus the one, and differ from learning anew by rounding; where a recording is too much
of the whole for that, they are learned anew, as they are without several.
"""

from functools import cached_property

import numpy as np

from capsule.arrays import BoolArray, FloatArray, IntArray
from capsule.detectors.probability import Probability, fit_probabilities, fit_probability
from capsule.detectors.sizing import SizeModel, fit_sizes, left_out_errors

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

    def __init__(self, scores: FloatArray, nodule: BoolArray, prevalence: float) -> None:
        self._scores, self._nodule, self._prevalence = scores, nodule, prevalence
        self.whole = fit_probability(scores, nodule, prevalence)

    def without(self, left_out: IntArray) -> Probability | None:
        """Give the curve without some recordings, by their places; None as in `fit_probability`."""
        if left_out.size == 0:
            return self.whole
        if left_out.size == 1:
            curve: Probability | None = self._without_each[left_out[0]]
            return curve
        taught = np.ones((1, self._scores.size), dtype=bool)
        taught[:, left_out] = False
        return self._fit(taught)[0]

    @cached_property
    def _without_each(self) -> list[Probability | None]:
        """Curves without each single recording."""
        places = np.arange(self._scores.size)
        rows = max(_BLOCK // places.size, 1)
        blocks = (places[start : start + rows, np.newaxis] for start in places[::rows])
        return [curve for alone in blocks for curve in self._fit(alone != places)]

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

    def without(self, left_out: IntArray) -> SizeModel | None:
        """Give the model without some recordings, by their places; None without any other."""
        if left_out.size == 0:
            return self.whole
        alone = self._without_each[left_out[0]] if left_out.size == 1 else None
        return self._anew(left_out) if alone is None else alone

    def errors_without(self, left_out: IntArray) -> FloatArray:
        """Return by how much each of the others is off when the rest of them predict it.

        Parameters
        ----------
        left_out : (m,) array of int
            The recordings that teach nothing, by their places.

        Returns
        -------
        (n - m,) array
            In mm, from `left_out_errors`.
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

    def _anew(self, left_out: IntArray) -> SizeModel | None:
        return fit_sizes(*self._others(left_out), self._ridge)

    def _others(self, left_out: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the features and sizes of the others."""
        taught = np.delete(np.arange(self._sizes_mm.size), left_out)
        return self._features[taught], self._sizes_mm[taught]

    @cached_property
    def _without_each(self) -> list[SizeModel | None]:
        """Models without each single recording; None where too few digits would be left."""
        count = self._sizes_mm.size - 1
        if count < 1:
            return [None] * self._sizes_mm.size
        mean, mean_mm = self._features.mean(axis=0), self._sizes_mm.mean()
        gone, gone_mm = self._features - mean, self._sizes_mm - mean_mm
        whole = gone.T @ gone
        # The sums about the new means, from those about the means of all.
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
        # Without the only one of the least size, the next is the least.
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
