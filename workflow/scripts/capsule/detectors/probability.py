"""The probability of a nodule as a logistic curve of the score."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class Probability:
    """A logistic curve from the score to the probability of a nodule.

    Attributes
    ----------
    centre, scale : float
        The score is used as (score - centre) / scale.
    intercept, slope : float
        Coefficients of the log odds, at the prevalence of the fit.
    """

    centre: float
    scale: float
    intercept: float
    slope: float

    def of(self, scores: FloatArray | float) -> FloatArray:
        """Return the probability of a nodule at each score; NaN where the score is unknown."""
        odds = self.intercept + self.slope * (np.asarray(scores) - self.centre) / self.scale
        return 1.0 / (1.0 + np.exp(-np.minimum(np.maximum(odds, -50.0), 50.0)))


def fit_probability(scores: FloatArray, nodule: BoolArray, prevalence: float) -> Probability | None:
    """Fit the logistic curve, with the recordings weighted to a stated prevalence.

    The healthy recordings standardize the score. A weak Gaussian prior on the slope keeps the curve
    finite if the two kinds do not overlap.

    Parameters
    ----------
    scores : (n,) array
        Scores of the training recordings.
    nodule : (n,) array of bool
        Which of them were made over a nodule.
    prevalence : float
        Share of recordings with a nodule in the later use of the detector.

    Returns
    -------
    Probability or None
        None if one of the two kinds is missing, or the healthy scores do not vary.
    """
    everybody = np.ones((1, scores.size), dtype=bool)
    return fit_probabilities(scores, nodule, prevalence, everybody)[0]


def fit_probabilities(
    scores: FloatArray,
    nodule: BoolArray,
    prevalence: float,
    taught: BoolArray,
    start: Probability | None = None,
    iterations: int = 50,
) -> list[Probability | None]:
    """Fit the logistic curve of `fit_probability` to many folds at once.

    Parameters
    ----------
    scores, nodule, prevalence
        As in `fit_probability`, of all recordings.
    taught : (F, n) array of bool
        Which recordings each fold is taught by.
    start : Probability, optional
        A curve near those of the folds. Starting from it takes fewer steps.
    iterations : int
        Largest number of Newton steps.

    Returns
    -------
    list of F Probability or None
        The same curves as from `fit_probability` with the recordings of each fold.
    """
    curves: list[Probability | None] = [None] * len(taught)
    of_both_kinds = ((taught & ~nodule).sum(axis=1) >= 2) & (taught & nodule).any(axis=1)
    folds = np.flatnonzero(of_both_kinds)
    centre, scale = _mean_and_spread(scores, taught[folds] & ~nodule)
    vary = scale > 0
    folds, centre, scale = folds[vary], centre[vary, np.newaxis], scale[vary, np.newaxis]
    taught = taught[folds]
    scaled = (scores - centre) / scale
    share = (taught & nodule).sum(axis=1, keepdims=True) / taught.sum(axis=1, keepdims=True)
    weight = taught * np.where(nodule, prevalence / share, (1 - prevalence) / (1 - share))
    observed = weight * nodule
    intercept, slope = np.full_like(centre, np.log(prevalence / (1 - prevalence))), 0 * centre
    if start is not None:
        intercept = start.intercept + start.slope * (centre - start.centre) / start.scale
        slope = start.slope * scale / start.scale
    coefficients = np.hstack([intercept, slope])
    prior, least = np.diag([0.0, 0.1]), 1e-9 * np.eye(2)
    gradient, curvature = np.empty((folds.size, 2)), np.empty((folds.size, 2, 2))
    # In place, so that large arrays stay in the processor's cache.
    chance, expected = np.empty_like(scaled), np.empty_like(scaled)
    for _ in range(iterations):
        np.multiply(-coefficients[:, 1:], scaled, out=chance)
        chance -= coefficients[:, :1]
        np.maximum(chance, -50.0, out=chance)
        np.minimum(chance, 50.0, out=chance)
        np.exp(chance, out=chance)
        chance += 1.0
        np.reciprocal(chance, out=chance)
        np.multiply(weight, chance, out=expected)
        chance *= expected
        steep = np.subtract(expected, chance, out=chance)
        left = np.subtract(observed, expected, out=expected)
        left.sum(axis=1, out=gradient[:, 0])
        np.vecdot(left, scaled, out=gradient[:, 1])
        steep.sum(axis=1, out=curvature[:, 0, 0])
        tilted = np.multiply(steep, scaled, out=steep)
        tilted.sum(axis=1, out=curvature[:, 0, 1])
        curvature[:, 1, 0] = curvature[:, 0, 1]
        np.vecdot(tilted, scaled, out=curvature[:, 1, 1])
        curvature += prior
        curvature += least
        gradient -= coefficients @ prior
        step = np.linalg.solve(curvature, gradient[..., np.newaxis])[..., 0]
        # Newton's method overshoots where the curve is steep, so the steps are limited to 4 units.
        longest = np.abs(step).max(axis=1, keepdims=True, initial=1e-300)
        coefficients += step * np.minimum(1.0, 4.0 / longest)
        # Newton's method squares the error in each step: the next one is below rounding.
        if longest.max(initial=0.0) < 1e-7:
            break
    for fold, *curve in zip(folds, centre[:, 0], scale[:, 0], *coefficients.T, strict=True):
        curves[fold] = Probability(*map(float, curve))
    return curves


def _mean_and_spread(scores: FloatArray, counted: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation (F,) of the scores (n,) that each fold counts (F, n)."""
    count = counted.sum(axis=1)
    mean = (counted * scores).sum(axis=1) / count
    square = (counted * (scores - mean[:, np.newaxis]) ** 2).sum(axis=1) / count
    return mean, np.sqrt(square)
