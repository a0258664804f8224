"""The size of a nodule as a number of mm, by ridge regression on a few features."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SizeModel:
    """A linear model of the size.

    Attributes
    ----------
    mean, scale : (F,) array
        The features are used as (feature - mean) / scale.
    coefficients : (F,) array
        In mm for each scaled feature.
    intercept_mm : float
        Mean size of the training recordings.
    smallest_mm, largest_mm : float
        Sizes of the training recordings, beyond which nothing is claimed.
    """

    mean: np.ndarray
    scale: np.ndarray
    coefficients: np.ndarray
    intercept_mm: float
    smallest_mm: float
    largest_mm: float

    def estimate(self, features: np.ndarray) -> np.ndarray:
        """Give the size in mm of each row of features (n, F), between the sizes seen."""
        size = self.intercept_mm + ((features - self.mean) / self.scale) @ self.coefficients
        return np.clip(size, self.smallest_mm, self.largest_mm)


def fit_sizes(features: np.ndarray, sizes_mm: np.ndarray, ridge: float) -> SizeModel | None:
    """Fit the size to the features of recordings made over nodules.

    Parameters
    ----------
    features : (n, F) array
        Features of the training recordings.
    sizes_mm : (n,) array
        Their true sizes, all above 0.
    ridge : float
        Penalty on the squared scaled coefficients, in recordings' worth.

    Returns
    -------
    SizeModel or None
        None without any recording.
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


def nearest_known(estimate_mm: float, sizes_mm: Sequence[float]) -> float:
    """Round an estimate to the nearest nodule size of the archive; the smaller one of two."""
    known = sorted(size for size in sizes_mm if size > 0)
    if not known or np.isnan(estimate_mm):
        return float("nan")
    return float(known[int(np.argmin(np.abs(np.array(known) - estimate_mm)))])
