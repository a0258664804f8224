"""The receiver operating characteristic: every threshold of a score at once."""

import numpy as np

from capsule.arrays import FloatArray


def auc(healthy: FloatArray, nodule: FloatArray) -> float:
    """Give the area under the curve: how often a nodule outscores a healthy recording.

    Parameters
    ----------
    healthy, nodule : (n,), (m,) array
        Scores; ties count half.

    Returns
    -------
    float
        NaN where one of the two is empty.
    """
    if healthy.size == 0 or nodule.size == 0:
        return float("nan")
    # Both in order: the search then walks through memory instead of jumping about.
    ordered, nodule = np.sort(healthy), np.sort(nodule)
    below = ordered.searchsorted(nodule, side="left")
    not_above = ordered.searchsorted(nodule, side="right")
    return float((below.sum() + not_above.sum()) / nodule.size / (2 * healthy.size))


def rates_above(scores: FloatArray, thresholds: FloatArray) -> FloatArray:
    """Give the share of scores above each threshold, (T,)."""
    return 1.0 - np.searchsorted(np.sort(scores), thresholds, side="right") / scores.size


def curve(healthy: FloatArray, nodule: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sweep the threshold over all scores.

    Returns
    -------
    thresholds : (T,) array
        Descending, from infinity, where nothing is called a nodule.
    false_positive_rate, true_positive_rate : (T,) array
    """
    thresholds = np.unique(np.concatenate([healthy, nodule]))[::-1]
    # Below the lowest score everything is called a nodule.
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
    """Draw recordings again, healthy ones and nodules apart, for the bands of the curve.

    Parameters
    ----------
    healthy, nodule : (n,), (m,) array
        Scores.
    grid : (G,) array
        False positive rates at which the band is wanted.
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
        Band of the true positive rate at each false positive rate. Draws may lie to one side of
        what was observed; interval and band are then widened to it.
    """
    areas, heights = np.empty(repeats), np.empty((repeats, grid.size))
    for repeat in range(repeats):
        healthy_drawn = np.sort(healthy[generator.integers(0, healthy.size, healthy.size)])
        nodule_drawn = np.sort(nodule[generator.integers(0, nodule.size, nodule.size)])
        areas[repeat] = auc(healthy_drawn, nodule_drawn)
        heights[repeat] = height_at(healthy_drawn, nodule_drawn, grid)
    tails = [(1 - confidence) / 2, (1 + confidence) / 2]
    low, high = np.quantile(areas, tails)
    band = np.quantile(heights, tails, axis=0)
    area, height = auc(healthy, nodule), height_at(healthy, nodule, grid)
    ends = min(float(low), area), max(float(high), area)
    return ends, np.minimum(band[0], height), np.maximum(band[1], height)


def height_at(healthy: FloatArray, nodule: FloatArray, grid: FloatArray) -> FloatArray:
    """Give the true positive rate reached at no more than each false positive rate, (G,)."""
    ordered = np.sort(healthy)[::-1]
    allowed = np.floor(grid * healthy.size + 1e-9).astype(int)
    # With k false positives allowed, the threshold is the score of rank k + 1 from the top.
    thresholds = np.concatenate([ordered, [-np.inf]])[np.minimum(allowed, healthy.size)]
    return rates_above(nodule, thresholds)
