"""Estimate of a nodule's size in mm, by ridge regression on a few features."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray

# Smallest value of one minus the leverage; smaller values are rounding errors.
_LEAST_REST = 1e-9


@dataclass(frozen=True)
class SizeModel:
    """A linear model of the size.

    Attributes
    ----------
    mean, scale : (F,) array
        The features are used as (feature - mean) / scale.
    coefficients : (F,) array
        Coefficient of each scaled feature, in mm.
    intercept_mm : float
        Mean size of the training recordings.
    smallest_mm, largest_mm : float
        Range of the sizes of the training recordings; estimates stay within it.
    """

    mean: FloatArray
    scale: FloatArray
    coefficients: FloatArray
    intercept_mm: float
    smallest_mm: float
    largest_mm: float

    def estimate(self, features: FloatArray) -> FloatArray:
        """Return the size in mm for each row of features (n, F), within the range of sizes."""
        size = self.intercept_mm + ((features - self.mean) / self.scale) @ self.coefficients
        return np.minimum(np.maximum(size, self.smallest_mm), self.largest_mm)


def fit_sizes(features: FloatArray, sizes_mm: FloatArray, ridge: float) -> SizeModel | None:
    """Fit the size to the features of recordings made over nodules.

    Parameters
    ----------
    features : (n, F) array
        Features of the training recordings.
    sizes_mm : (n,) array
        Their true sizes, all above 0.
    ridge : float
        Penalty on the squared scaled coefficients, in units of one recording's weight.

    Returns
    -------
    SizeModel or None
        None if there is no recording.
    """
    if sizes_mm.size == 0:
        return None
    mean, scale = features.mean(axis=0), features.std(axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    scaled = (features - mean) / scale
    intercept = float(sizes_mm.mean())
    normal = scaled.T @ scaled + ridge * np.eye(features.shape[1])
    coefficients = np.linalg.solve(normal, scaled.T @ (sizes_mm - intercept))
    return SizeModel(
        mean, scale, coefficients, intercept, float(sizes_mm.min()), float(sizes_mm.max())
    )


def left_out_errors(
    model: SizeModel, features: FloatArray, sizes_mm: FloatArray, ridge: float
) -> FloatArray:
    """Return each recording's size error when the others predict it.

    With the model's scale of the features, no new fit is needed: the error is the residual over one
    minus the leverage (Cook and Weisberg 1982). A prediction may lie outside the range of sizes.

    Parameters
    ----------
    model : SizeModel
        From `fit_sizes` on the same recordings.
    features, sizes_mm, ridge
        As in `fit_sizes`.

    Returns
    -------
    (n,) array
        Predicted minus true size in mm; infinite if the others tell nothing about it.
    """
    scaled = (features - model.mean) / model.scale
    normal = scaled.T @ scaled + ridge * np.eye(features.shape[1])
    leverage = 1 / sizes_mm.size + (scaled * np.linalg.solve(normal, scaled.T).T).sum(axis=1)
    residuals = model.intercept_mm + scaled @ model.coefficients - sizes_mm
    rest = 1 - leverage
    unknown = np.full(sizes_mm.size, np.inf)
    errors: FloatArray = np.divide(residuals, rest, out=unknown, where=rest > _LEAST_REST)
    return errors


def nearest_known(estimate_mm: float, sizes_mm: Sequence[float]) -> float:
    """Return the archive's nodule size nearest to an estimate; of two, the smaller one."""
    known = sorted(size for size in sizes_mm if size > 0)
    if not known or np.isnan(estimate_mm):
        return float("nan")
    return float(min(known, key=lambda size_mm: abs(size_mm - estimate_mm)))
