"""The receiver operating characteristic (ROC curve) of a score."""

import numpy as np

from capsule.arrays import FloatArray, IntArray

# The draws of the bootstrap are evaluated in blocks of about this many scores.
_VALUES_AT_ONCE = 1_000_000


def auc(healthy: FloatArray, nodule: FloatArray) -> float:
    """Return the area under the curve: how often a nodule scores above a healthy recording.

    Parameters
    ----------
    healthy, nodule : (n,), (m,) array
        Scores; ties count half.

    Returns
    -------
    float
        NaN if one of the two is empty.
    """
    if healthy.size == 0 or nodule.size == 0:
        return float("nan")
    # With both sorted, the search passes through memory in order, which is faster.
    ordered, nodule = np.sort(healthy), np.sort(nodule)
    below = ordered.searchsorted(nodule, side="left")
    not_above = ordered.searchsorted(nodule, side="right")
    return float((below.sum() + not_above.sum()) / nodule.size / (2 * healthy.size))


def rates_above(scores: FloatArray, thresholds: FloatArray) -> FloatArray:
    """Return the share of scores above each threshold, (T,)."""
    return 1.0 - np.searchsorted(np.sort(scores), thresholds, side="right") / scores.size


def curve(healthy: FloatArray, nodule: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the ROC curve: both rates at every threshold.

    Returns
    -------
    thresholds : (T,) array
        Descending from infinity, at which no recording counts as a nodule.
    false_positive_rate, true_positive_rate : (T,) array
    """
    thresholds = np.unique(np.concatenate([healthy, nodule]))[::-1]
    # Below the lowest score, every recording counts as a nodule.
    thresholds = np.concatenate([[np.inf], thresholds, [-np.inf]])
    return thresholds, rates_above(healthy, thresholds), rates_above(nodule, thresholds)


def bootstrap(
    healthy: FloatArray,
    nodule: FloatArray,
    grid: FloatArray,
    generator: np.random.Generator,
    repeats: int,
    confidence: float,
) -> tuple[tuple[float, float], FloatArray, FloatArray]:
    """Return bootstrap intervals of the area and of the curve.

    Healthy recordings and nodules are drawn separately.

    Parameters
    ----------
    healthy, nodule : (n,), (m,) array
        Scores.
    grid : (G,) array
        False positive rates at which the band is computed.
    generator : numpy.random.Generator
        Source of the draws.
    repeats : int
        Number of draws.
    confidence : float
        Level of the percentile intervals.

    Returns
    -------
    area : pair of float
        Interval of the area under the curve.
    low, high : (G,) array
        Band of the true positive rate at each false positive rate. If all draws lie on one side of
        the observed value, interval and band are widened to contain it.
    """
    # Only the order of scores matters, so ranks replace them; 0 is below all scores.
    pool = np.unique(np.concatenate([[-np.inf], healthy, nodule]))
    ranks = pool.searchsorted(healthy), pool.searchsorted(nodule)
    areas, heights = np.empty(repeats), np.empty((repeats, grid.size))
    at_once = max(1, _VALUES_AT_ONCE // (healthy.size + nodule.size))
    for first in range(0, repeats, at_once):
        some = slice(first, min(first + at_once, repeats))
        areas[some], heights[some] = _of_draws(*ranks, grid, generator, some.stop - first)
    tails = [(1 - confidence) / 2, (1 + confidence) / 2]
    low, high = np.quantile(areas, tails)
    band = np.quantile(heights, tails, axis=0)
    area, height = auc(healthy, nodule), height_at(healthy, nodule, grid)
    ends = min(float(low), area), max(float(high), area)
    return ends, np.minimum(band[0], height), np.maximum(band[1], height)


def _of_draws(
    healthy: IntArray,
    nodule: IntArray,
    grid: FloatArray,
    generator: np.random.Generator,
    repeats: int,
) -> tuple[FloatArray, FloatArray]:
    """Return `auc`, (R,), and `height_at`, (R, G), of this many draws.

    Parameters
    ----------
    healthy, nodule : (n,), (m,) array of int
        Ranks of the scores; 0 is below all scores.
    """
    n, m = healthy.size, nodule.size
    # Each draw is a row. An offset for each row keeps all rows in order when joined into one.
    ends = (max(healthy.max(), nodule.max()) + 1) * np.arange(repeats)[:, np.newaxis]
    # One call for all draws, which takes the same random numbers as a call a draw and kind.
    places = generator.integers(0, np.repeat([n, m], [n, m]), (repeats, n + m))
    healthy_drawn = np.sort(healthy[places[:, :n]], axis=1) + ends
    nodule_drawn = np.sort(nodule[places[:, n:]], axis=1) + ends
    rows = np.arange(repeats)
    counts = sum(
        healthy_drawn.ravel().searchsorted(nodule_drawn.ravel(), side).reshape(repeats, m).sum(1)
        for side in ("left", "right")
    )
    areas = (counts - 2 * n * m * rows) / m / (2 * n)
    falling = np.concatenate([healthy_drawn[:, ::-1], ends], axis=1)
    thresholds = falling[:, _allowed(grid, n)]
    below = nodule_drawn.ravel().searchsorted(thresholds.ravel(), "right").reshape(repeats, -1)
    return areas, 1.0 - (below - m * rows[:, np.newaxis]) / m


def _allowed(grid: FloatArray, healthy: int) -> IntArray:
    """Return how many healthy recordings may count as nodules at each false positive rate, (G,)."""
    allowed: IntArray = np.floor(grid * healthy + 1e-9).astype(int)
    return np.minimum(allowed, healthy)


def height_at(healthy: FloatArray, nodule: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the true positive rate at no more than each false positive rate, (G,)."""
    ordered = np.sort(healthy)[::-1]
    # With k false positives allowed, the threshold is the score of rank k + 1 from the top.
    thresholds = np.concatenate([ordered, [-np.inf]])[_allowed(grid, healthy.size)]
    return rates_above(nodule, thresholds)
