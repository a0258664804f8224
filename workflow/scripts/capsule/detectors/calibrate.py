"""Calibrate a detector: threshold, probability of a nodule, sizes and their intervals.

The unit is the place. Passes over one place share its gut wall and its nodule, so each recording
counts 1 / m for a place of m passes, and what leaves a recording out leaves its place out. In all
functions, `places` is the number of the place of each recording, (n,), from 0 on.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from capsule.arrays import BoolArray, FloatArray, IntArray, RealArray
from capsule.kinds import Settings

# Smallest eigenvalue of one minus the leverage; smaller values are rounding errors.
_LEAST_REST = 1e-9
# Precision of the prior on the slope of the logistic curve.
_PRIOR = 0.1


def place_weights(places: IntArray) -> FloatArray:
    """Return 1 / m of each recording, where m recordings are of its place, (n,)."""
    weights: FloatArray = 1.0 / np.bincount(places)[places]
    return weights


def upper_quantile(values: FloatArray, places: IntArray, share: float) -> float:
    """Return the value that a pass over a new place exceeds with a probability of 1 - share.

    It is a weighted quantile of `values` (n,): each of m passes over one of K places weighs
    1 / ((K + 1) m), and 1 / (K + 1) lies at infinity (hierarchical conformal prediction; Y. Lee,
    R. F. Barber and R. Willett, Distribution-free inference with hierarchical data, 2023). With one
    pass a place, it is the value of rank ceil((K + 1) share). Fewer than share / (1 - share) places
    are too few: the result is infinite.
    """
    order = np.argsort(values, kind="stable")
    weights = place_weights(places)[order]
    reached = np.cumsum(weights) / (weights.sum() + 1)
    # Slightly less, because rounding can lift a product such as 20 x 0.95 above a whole number.
    enough = np.flatnonzero(reached >= share - 1e-9)
    return float(values[order[enough[0]]]) if enough.size else float("inf")


def rank_threshold(healthy_scores: FloatArray, places: IntArray, specificity: float) -> float:
    """Return the threshold that limits how often a new healthy recording causes a false alarm.

    A score above the threshold means a nodule. It is the `upper_quantile` of the scores (n,) of
    healthy recordings, from a model that their places did not teach; with too few places, it is the
    largest score, which guarantees less. NaN if there is no score.
    """
    if healthy_scores.size == 0:
        return float("nan")
    return min(upper_quantile(healthy_scores, places, specificity), float(healthy_scores.max()))


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
        return 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0)))


def fit_probability(
    scores: FloatArray, nodule: BoolArray, places: IntArray, prevalence: float
) -> Probability | None:
    """Fit a logistic curve, with the recordings weighted to a stated prevalence of nodules.

    The scores (n,) come from a model that their places did not teach; `nodule` (n,) tells which
    were made over a nodule. The healthy recordings standardize the score. A weak Gaussian prior on
    the slope keeps the curve finite if the two kinds do not overlap. There is no curve (None) with
    fewer than two healthy recordings or no nodule, or if the healthy scores do not vary.
    """
    healthy = ~nodule
    if np.count_nonzero(healthy) < 2 or not nodule.any() or np.ptp(scores[healthy]) == 0:
        return None
    weight = place_weights(places)
    centre = float(np.average(scores[healthy], weights=weight[healthy]))
    scale = float(np.sqrt(np.average((scores[healthy] - centre) ** 2, weights=weight[healthy])))
    scaled = (scores - centre) / scale
    share = weight[nodule].sum() / weight.sum()
    weight = weight * np.where(nodule, prevalence / share, (1 - prevalence) / (1 - share))
    design = np.column_stack([np.ones_like(scaled), scaled])
    prior = np.diag([0.0, _PRIOR])
    coefficients = np.array([np.log(prevalence / (1 - prevalence)), 0.0])
    for _ in range(50):
        chance = 1.0 / (1.0 + np.exp(-np.clip(design @ coefficients, -50.0, 50.0)))
        gradient = design.T @ (weight * (nodule - chance)) - prior @ coefficients
        curvature = (design.T * (weight * chance * (1 - chance))) @ design + prior
        step = np.linalg.solve(curvature + 1e-9 * np.eye(2), gradient)
        # Newton's method overshoots where the curve is steep, so the steps are limited to 4 units.
        longest = np.abs(step).max()
        coefficients = coefficients + step * min(1.0, 4.0 / max(longest, 1e-300))
        # Newton's method squares the error in each step: the next one is below rounding.
        if longest < 1e-7:
            break
    return Probability(centre, scale, *map(float, coefficients))


@dataclass(frozen=True)
class Regression:
    """A linear model of features.

    Attributes
    ----------
    mean : (F,) array
        Mean of each feature over the training recordings.
    coefficients : (F,) array
        Factor on each feature's difference from its mean.
    intercept : float
        Mean of the values that the model predicts.
    """

    mean: FloatArray
    coefficients: FloatArray
    intercept: float

    def of(self, features: RealArray) -> Any:  # noqa: ANN401  a float, or an array
        """Return the prediction for features (F,), or for each row of features (n, F)."""
        return self.intercept + (features - self.mean) @ self.coefficients

    @classmethod
    def restored(cls, stored: Settings) -> "Regression":
        """Return the model from its stored values."""
        return cls(np.array(stored["mean"]), np.array(stored["coefficients"]), stored["intercept"])


def fit_ridge(
    features: RealArray, values: FloatArray, places: IntArray, penalties: FloatArray | float
) -> tuple[Regression, FloatArray]:
    """Fit values (n,) of at least one recording to features (n, F) by ridge regression.

    With X the centred features and P the penalties on each squared coefficient, the coefficients
    are (X'X + P)^-1 X'y. The hat matrix is H = 1 / n + X (X'X + P)^-1 X'. If the recordings b of a
    place teach nothing, the errors of their predictions are (1 - H_bb)^-1 times their residuals
    (R. D. Cook and S. Weisberg, Residuals and Influence in Regression, 1982), so no further fit is
    needed.

    Returns
    -------
    Regression
    (n,) array
        Prediction of each recording by the other places; NaN if these tell nothing about it.
    """
    mean, intercept = features.mean(axis=0, dtype=float), float(values.mean())
    centred = features - mean
    gram = centred.T @ centred
    gram[np.diag_indices_from(gram)] += penalties
    # Rows as in `centred`: to solve for all recordings at a time takes twice as long.
    influence = centred @ np.linalg.inv(gram)
    coefficients = (values - intercept) @ influence
    residuals = values - intercept - centred @ coefficients
    rest = 1 - 1 / values.size - np.vecdot(centred, influence)
    errors = np.full(values.size, np.nan)
    np.divide(residuals, rest, out=errors, where=rest > _LEAST_REST)
    for place in np.flatnonzero(np.bincount(places) > 1):
        some = np.flatnonzero(places == place)
        rest_of = np.eye(some.size) - 1 / values.size - centred[some] @ influence[some].T
        known = np.linalg.eigvalsh(rest_of)[0] > _LEAST_REST
        errors[some] = np.linalg.solve(rest_of, residuals[some]) if known else np.nan
    return Regression(mean, coefficients, intercept), values - errors


@dataclass(frozen=True)
class SizeModel:
    """An estimate of a nodule's size with its interval.

    Attributes
    ----------
    regression : Regression
        From the features of a recording to its size in mm.
    half_width_mm : float
        Half the width of the interval of a size; infinite if too few nodules teach it.
    known_mm : tuple of float
        Nodule sizes of the archive, ascending; estimates stay between the first and the last.
    """

    regression: Regression
    half_width_mm: float
    known_mm: tuple[float, ...]

    def estimate(self, features: RealArray) -> FloatArray:
        """Return the size in mm for each row of features (n, F), or for one, (F,)."""
        smallest, largest = self.known_mm[0], self.known_mm[-1]
        sizes: FloatArray = np.clip(self.regression.of(features), smallest, largest)
        return sizes

    def interval(self, estimate_mm: float) -> tuple[float, float]:
        """Return the ends of the interval of an estimated size, in mm.

        It starts at the archive's smallest size at the earliest. If it reaches the largest, it has
        no upper end (infinity), because no larger nodule has taught where it ends.
        """
        low, high = estimate_mm - self.half_width_mm, estimate_mm + self.half_width_mm
        return max(low, self.known_mm[0]), high if high < self.known_mm[-1] else float("inf")

    def nearest(self, estimate_mm: float) -> float:
        """Return the archive's nodule size nearest to an estimate; of two, the smaller one."""
        return min(self.known_mm, key=lambda size_mm: abs(size_mm - estimate_mm))

    @classmethod
    def restored(cls, stored: Settings) -> "SizeModel":
        """Return the model from its stored values."""
        half_width = stored["half_width_mm"]
        return cls(
            Regression.restored(stored["regression"]),
            float("inf") if half_width is None else half_width,
            tuple(stored["known_mm"]),
        )


def fit_sizes(
    features: RealArray,
    sizes_mm: FloatArray,
    places: IntArray,
    detected: BoolArray,
    *,
    ridge: float,
    confidence: float,
) -> SizeModel | None:
    """Fit the size of nodules to features, and the width of its interval; None without a nodule.

    The interval holds the size of a detected nodule at a new place with the wanted confidence: its
    half width is the `upper_quantile` of the errors of predictions from the other places (jackknife
    prediction intervals; R. F. Barber et al., Annals of Statistics 49, 2021). Only detected nodules
    get a size, so only their errors count (selection-conditional prediction; Y. Jin and Z. Ren,
    2025).

    Parameters
    ----------
    features : (n, F) array
        Features of the recordings of nodules.
    sizes_mm, places, detected : (n,) array
        Their true sizes, their places, and which are detected by a model that their place did not
        teach.
    ridge : float
        Penalty on the squared coefficients of features that are scaled to a deviation of 1.
    confidence : float
        Share of the intervals that should hold the size.
    """
    if sizes_mm.size == 0:
        return None
    variance = features.var(axis=0, dtype=float)
    # Scaling the features is the same as scaling the penalties. A constant one counts as it is.
    penalties = ridge * np.where(variance > 0, variance, 1.0)
    regression, predicted_mm = fit_ridge(features, sizes_mm, places, penalties)
    errors = np.abs(predicted_mm - sizes_mm)[detected]
    errors = np.where(np.isnan(errors), np.inf, errors)
    half_width = upper_quantile(errors, places[detected], confidence)
    return SizeModel(regression, half_width, tuple(np.unique(sizes_mm).tolist()))
