"""The errors of estimated sizes, in mm."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.kinds import Cells


def mean_interval(values: FloatArray, confidence: float) -> tuple[float, float, float]:
    """Return a mean and its Student interval; NaN if there are too few values."""
    count = values.size
    if count == 0:
        return float("nan"), float("nan"), float("nan")
    mean = float(values.mean())
    if count == 1:
        return mean, float("nan"), float("nan")
    from scipy.special import stdtrit

    reach = float(stdtrit(count - 1, 0.5 + confidence / 2)) * values.std(ddof=1) / count**0.5
    return mean, mean - float(reach), mean + float(reach)


def median_interval(values: FloatArray, confidence: float) -> tuple[float, float, float]:
    """Return a median and its interval, which holds for any distribution.

    The ends are two of the values. They are unknown (NaN) if there are too few values for the
    confidence.
    """
    if values.size == 0:
        return float("nan"), float("nan"), float("nan")
    ordered = np.sort(values)
    median = float(np.median(ordered))
    from scipy.special import bdtr

    # For each k, the probability that at most k of the values lie below the true median.
    at_most = bdtr(np.arange(ordered.size + 1), ordered.size, 0.5)
    # The ends are the values of this rank from below and from above, counted from 1.
    rank = int(np.searchsorted(at_most, (1 - confidence) / 2))
    if rank == 0:
        return median, float("nan"), float("nan")
    return median, float(ordered[rank - 1]), float(ordered[-rank])


def size_error_row(true_mm: FloatArray, estimate_mm: FloatArray, confidence: float) -> Cells:
    """Return bias and mean absolute error of the recordings in which a nodule was detected.

    Parameters
    ----------
    true_mm, estimate_mm : (n,) array
        Sizes in mm; a missed nodule has no estimate (NaN).
    confidence : float
        Level of the intervals.

    Returns
    -------
    dict
        ``recordings``, ``detected``; ``bias_mm`` and ``absolute_error_mm``, each with ``_low`` and
        ``_high``.
    """
    error = (estimate_mm - true_mm)[~np.isnan(estimate_mm)]
    row: dict[str, float] = {"recordings": true_mm.size, "detected": error.size}
    for name, values in (("bias", error), ("absolute_error", np.abs(error))):
        ends = ("_mm", "_low_mm", "_high_mm")
        cells = zip(ends, mean_interval(values, confidence), strict=True)
        row |= {f"{name}{end}": value for end, value in cells}
    # NaN is not smaller than 0, so it stays NaN.
    if row["absolute_error_low_mm"] < 0:
        row["absolute_error_low_mm"] = 0.0
    return row
