"""Intervals of estimated sizes, computed from the errors of cross-validated predictions."""

import numpy as np

from capsule.arrays import FloatArray


def conformal_reach(errors: FloatArray, share: float) -> float:
    """Return half the width of an interval that holds a wanted share of new values.

    Parameters
    ----------
    errors : (n,) array
        Predicted minus true value of each recording, from a prediction that left it out.
    share : float
        The wanted share, such as 0.9.

    Returns
    -------
    float
        The error of rank ceil((n + 1) share) by magnitude (the jackknife of Barber et al. 2021);
        infinite with fewer than share / (1 - share) errors, which are too few.
    """
    count = errors.size
    # Slightly less, because rounding can lift a product such as 10 x 0.9 above a whole number.
    rank = max(int(np.ceil((count + 1) * share - 1e-9)), 1)
    if rank > count:
        return float("inf")
    return float(np.partition(np.abs(errors), rank - 1)[rank - 1])


def size_interval(
    estimate_mm: float, reach_mm: float, known_mm: tuple[float, ...]
) -> tuple[float, float]:
    """Return the ends of a size's interval, cut at the archive's sizes.

    Parameters
    ----------
    estimate_mm : float
        The size, between the archive's smallest and largest.
    reach_mm : float
        From `conformal_reach`.
    known_mm : tuple of float
        Nodule sizes of the archive, ascending.

    Returns
    -------
    low, high : float
        In mm; NaN if the estimate is NaN.
    """
    low, high = estimate_mm - reach_mm, estimate_mm + reach_mm
    return max(low, known_mm[0]), min(high, known_mm[-1])
