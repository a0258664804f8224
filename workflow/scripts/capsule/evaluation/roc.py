"""The receiver operating characteristic (ROC curve) of a score."""

import numpy as np

from capsule.arrays import FloatArray, IntArray

# The draws of the bootstrap are evaluated in blocks of about this many scores, which fit into the
# processor's cache.
_VALUES_AT_ONCE = 2**14
# From this many recordings on, a call of the generator for each draw is faster than one for all.
_CALL_FOR_EACH_FROM = 1500


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
    draws, needed = _Draws(healthy, nodule), healthy.size - _allowed(grid, healthy.size)
    areas, heights = np.empty(repeats), np.empty((repeats, grid.size))
    at_once = max(1, _VALUES_AT_ONCE // (healthy.size + nodule.size))
    for first in range(0, repeats, at_once):
        some = slice(first, min(first + at_once, repeats))
        areas[some], heights[some] = draws.of(generator, some.stop - first, needed)
    tails = [(1 - confidence) / 2, (1 + confidence) / 2]
    low, high = np.quantile(areas, tails)
    band = np.quantile(heights, tails, axis=0)
    area, height = auc(healthy, nodule), height_at(healthy, nodule, grid)
    ends = min(float(low), area), max(float(high), area)
    return ends, np.minimum(band[0], height), np.maximum(band[1], height)


class _Draws:
    """Draws of a bootstrap, in the order of the scores, which is sorted only once.

    Parameters
    ----------
    healthy, nodule : (n,), (m,) array
        Scores.
    """

    def __init__(self, healthy: FloatArray, nodule: FloatArray) -> None:
        self._orders = np.argsort(healthy), np.argsort(nodule)
        healthy, nodule = np.sort(healthy), np.sort(nodule)
        # How many healthy scores are below each nodule's, and not above it.
        self._below = healthy.searchsorted(nodule, side="left")
        self._not_above = healthy.searchsorted(nodule, side="right")
        # How many nodules' scores are not above each healthy one; none is below all scores.
        self._passed = np.append(0, nodule.searchsorted(healthy, side="right"))

    def of(
        self, generator: np.random.Generator, repeats: int, needed: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return `auc`, (R,), and the true positive rates, (R, G), of some draws.

        Parameters
        ----------
        generator : numpy.random.Generator
            Source of the draws.
        repeats : int
            Number of draws R.
        needed : (G,) array of int
            How many healthy recordings may not count as nodules.
        """
        healthy, nodule = (
            counts.take(order, axis=1)
            for counts, order in zip(self._choose(generator, repeats), self._orders, strict=True)
        )
        n, m = healthy.shape[1], nodule.shape[1]
        up_to, nodules_up_to = _sums(healthy), _sums(nodule)
        # A healthy recording below a nodule counts twice, one that ties with it once.
        ahead = up_to.take(self._below, axis=1) + up_to.take(self._not_above, axis=1)
        wins = np.vecdot(nodule, ahead)
        # The threshold is the lowest score that enough healthy ones are not above. An offset for
        # each draw keeps all draws in order when joined into one.
        offsets = np.arange(repeats)[:, np.newaxis]
        joined, wanted = up_to + (n + 1) * offsets, needed + (n + 1) * offsets
        reached = joined.ravel().searchsorted(wanted.ravel()).reshape(repeats, -1)
        passed = self._passed[reached - (n + 1) * offsets]
        return wins / m / (2 * n), 1.0 - np.take_along_axis(nodules_up_to, passed, axis=1) / m

    def _choose(self, generator: np.random.Generator, repeats: int) -> tuple[IntArray, IntArray]:
        """Return how often each healthy recording, (R, n), and each nodule, (R, m), is drawn."""
        sizes = n, m = self._orders[0].size, self._orders[1].size
        if n + m < _CALL_FOR_EACH_FROM:
            # This takes the same random numbers as a call for each draw and kind.
            both = generator.integers(0, np.repeat(sizes, sizes), (repeats, n + m))
            return _counts(both[:, :n]), _counts(both[:, n:])
        counts = np.empty((repeats, n), dtype=int), np.empty((repeats, m), dtype=int)
        for draw in range(repeats):
            for of_kind, size in zip(counts, sizes, strict=True):
                of_kind[draw] = np.bincount(generator.integers(0, size, size), minlength=size)
        return counts


def _counts(places: IntArray) -> IntArray:
    """Return how often each place 0..n - 1 occurs in each row of places (R, n), as (R, n)."""
    repeats, size = places.shape
    offsets = size * np.arange(repeats)[:, np.newaxis]
    return np.bincount((places + offsets).ravel(), minlength=size * repeats).reshape(repeats, -1)


def _sums(counts: IntArray) -> IntArray:
    """Return the sums of the first 0..n counts of each row (R, n), as (R, n + 1)."""
    sums = np.zeros((counts.shape[0], counts.shape[1] + 1), dtype=int)
    counts.cumsum(axis=1, out=sums[:, 1:])
    return sums


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
