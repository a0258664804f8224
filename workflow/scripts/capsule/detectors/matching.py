"""The paper's detector: the template with the smallest sliding RMSE."""

from collections.abc import Sequence

import numpy as np

from capsule.sliding import SlidingComparison


def template_distances(matrix: np.ndarray, templates: Sequence[np.ndarray]) -> np.ndarray:
    """Compare a recording with every template (eq. F' to eq. RMSEmin).

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix V.
    templates : sequence of B (S, L) arrays
        The templates T^b; one that holds NaN has no distance.

    Returns
    -------
    (B,) array
        The smallest RMSE over all lags; NaN where the matrix or the template is NaN.
    """
    distances = np.full(len(templates), np.nan)
    if np.isnan(matrix).any():
        return distances
    comparison = SlidingComparison(matrix)
    for index, template in enumerate(templates):
        if not np.isnan(template).any():
            distances[index], _ = comparison.compare(template)
    return distances


def nearest_size(distances: np.ndarray, sizes_mm: Sequence[float]) -> float:
    """Give the size of the nearest template.

    Parameters
    ----------
    distances : (B,) array
        From `template_distances`.
    sizes_mm : sequence of B floats
        The templates' sizes in mm; 0 is no nodule. Of equal distances the smaller size wins.

    Returns
    -------
    float
        Size in mm, 0 for no nodule, NaN where no distance is known.
    """
    if np.isnan(distances).all():
        return float("nan")
    return float(sizes_mm[int(np.nanargmin(distances))])
