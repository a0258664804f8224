"""The receiver operating characteristic (ROC curve) of a score."""

import numpy as np

from capsule.arrays import FloatArray, IntArray

# The draws of the bootstrap are evaluated in blocks of about this many scores, which fit into the
# processor's cache.
_VALUES_AT_ONCE = 2**13


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
    # One call for all draws, which takes the same random numbers as a call a draw and kind.
    places = generator.integers(0, np.repeat([n, m], [n, m]), (repeats, n + m))
    levels = max(healthy.max(), nodule.max()) + 1
    healthy_drawn = _counts(healthy[places[:, :n]], levels)
    nodule_drawn = _counts(nodule[places[:, n:]], levels)
    # How many healthy recordings and nodules of a draw are not above each rank.
    healthy_below, nodule_below = healthy_drawn.cumsum(axis=1), nodule_drawn.cumsum(axis=1)
    # A healthy recording below a nodule counts twice, one that ties with it once.
    wins = (nodule_drawn * (2 * healthy_below - healthy_drawn)).sum(axis=1)
    # With k false positives allowed, the threshold is the lowest rank that n - k are not above. An
    # offset for each draw keeps all draws in order when joined into one.
    rows = np.arange(repeats)[:, np.newaxis]
    joined, wanted = healthy_below + (n + 1) * rows, n - _allowed(grid, n) + (n + 1) * rows
    thresholds = joined.ravel().searchsorted(wanted.ravel())
    return wins / m / (2 * n), 1.0 - nodule_below.ravel()[thresholds].reshape(repeats, -1) / m


def _counts(ranks: IntArray, levels: int) -> IntArray:
    """Return how often each rank 0..L - 1 occurs in each row of ranks (R, n), as (R, L)."""
    offsets = levels * np.arange(ranks.shape[0])[:, np.newaxis]
    counted = np.bincount((ranks + offsets).ravel(), minlength=levels * ranks.shape[0])
    counts: IntArray = counted.reshape(-1, levels)
    return counts


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
