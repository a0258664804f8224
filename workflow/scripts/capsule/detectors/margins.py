"""The margins that may become the threshold when a fold changes the templates.

A margin is a recording's largest gain over all templates. A fold changes templates little, so most
margins stay on their side of the threshold and need not be computed anew.
"""

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.detectors.operating_point import threshold_at


def margin_reach(norms: FloatArray, whole: FloatArray, fold: FloatArray) -> FloatArray:
    """Return a bound on the change of a margin when T' replaces a template T.

    The gain of a template is 2 <V, T shifted> - |T|^2 at its best lag
    (`capsule.detectors.matching.Comparison`). At every lag <V, T' - T> is at most |V| |T' - T|
    (Cauchy and Schwarz). The best gain therefore changes by at most
    2 |V| |T' - T| + ||T'|^2 - |T|^2|.

    Parameters
    ----------
    norms : (n,) array
        |V| of each recording.
    whole, fold : (S, L) array
        T and T'.

    Returns
    -------
    (n,) array
    """
    energy = abs(float((fold**2).sum() - (whole**2).sum()))
    return 2 * norms * np.linalg.norm(fold - whole) + energy


def near_threshold(margins: FloatArray, reach: FloatArray, specificity: float) -> IntArray:
    """Return the recordings whose margin may become the threshold.

    The threshold is an order statistic. It lies between the thresholds of the lowest and of the
    highest values that the margins can have. A margin whose range does not touch this interval
    stays on its side of the threshold. Of the 20 healthy recordings of the shipped archive, 9 are
    near on average; of 200 healthy ones, 10. For the latter, a fold's threshold takes 0.9 ms
    instead of 19 ms.

    Parameters
    ----------
    margins, reach : (n,) array
        Known values of the margins, and the largest distance of each from its true value.
    specificity : float
        As in `threshold_at`.

    Returns
    -------
    array of int
        Places of these recordings among the margins.
    """
    lowest = threshold_at(margins - reach, specificity)
    highest = threshold_at(margins + reach, specificity)
    return np.flatnonzero((margins + reach >= lowest) & (margins - reach <= highest))
