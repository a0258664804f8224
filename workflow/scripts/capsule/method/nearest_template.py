"""The paper's rule: a recording has the size of the nearest template (eq. F' to eq. RMSEmin).

RMSE^2 = (|V|^2 - gain) / (3 S L), where gain = 2 sum V T(shifted) - |T|^2. The gain of T^0 is 0, so
the verdict is a nodule if the largest gain of another template, the margin, is above 0.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from capsule.arrays import FloatArray
from capsule.method.sliding import RepeatedParticle, SlidingComparison, rmse_at_lag


def template_distances(matrix: FloatArray, templates: Iterable[FloatArray]) -> FloatArray:
    """Compare a recording with every template (eq. F' to eq. RMSEmin).

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix V.
    templates : iterable of B (S, L) arrays
        The templates T^b; one that holds NaN has no distance.

    Returns
    -------
    (B,) array
        The smallest RMSE over all lags; NaN if the matrix or the template holds NaN.
    """
    return compare_templates(matrix, list(map(RepeatedParticle, templates)))[0]


def nearest_size(distances: FloatArray, sizes_mm: Sequence[float]) -> float:
    """Return the size of the nearest template in mm, NaN if no distance is known.

    Parameters
    ----------
    distances : (B,) array
        From `template_distances`.
    sizes_mm : sequence of B floats
        The templates' sizes in mm; 0 is no nodule. Of equal distances the smaller size wins.
    """
    nearest = index_of_largest(-distances)
    return np.nan if nearest is None else float(sizes_mm[nearest])


def index_of_largest(values: FloatArray) -> int | None:
    """Return the index of the largest value that is not NaN, of equal ones the first, or None.

    For the few values of a recording's templates, this is faster than functions on arrays.
    """
    listed = values.tolist()
    known = [index for index, value in enumerate(listed) if value == value]
    return max(known, key=listed.__getitem__, default=None)


def compare_templates(
    matrix: FloatArray, templates: Sequence[RepeatedParticle]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distances, gains and lags of B templates on a recording's matrix (S, L), each (B,).

    A distance is the smallest RMSE over all lags (eq. RMSEmin). A gain is the largest over all
    lags, 0 for T^0, at the lag tau in 1..2L. All three are NaN if matrix or template holds NaN.
    """
    compared = np.full((3, len(templates)), np.nan)
    if not np.isnan(matrix).any():
        gain_of = SlidingComparison(matrix).gain_of
        for index, template in enumerate(templates):
            if template.is_known:
                gain, lag = gain_of(template)
                compared[:, index] = rmse_at_lag(matrix, template.values, lag), gain, lag
    distances, gains, lags = compared
    return distances, gains, lags


def first_peak_sample(lag: float, first_peak: int, length: int) -> float:
    """Return when sensor 1 feels the template's first peak, in samples from the first reading.

    `first_peak` is u, counted from 1. At a `lag` (tau) of L + 1, the template is not shifted.
    """
    return first_peak - 1 + lag - (length + 1)
