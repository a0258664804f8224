"""The receiver operating characteristic (ROC curve) of a score, and the area under it (AUC)."""

import math

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.evaluation.intervals import (
    FEWEST_CLUSTERS,
    UNKNOWN,
    Interval,
    last_outside,
    normal_quantile,
    student_factor,
)


def auc(healthy: FloatArray, nodule: FloatArray) -> float:
    """Return the area under the ROC curve: how often a nodule scores above a healthy recording.

    Ties count half. The area is NaN if there are no scores of a kind.
    """
    if healthy.size == 0 or nodule.size == 0:
        return math.nan
    return float(_twice_below(healthy, nodule).sum() / nodule.size / (2 * healthy.size))


def _twice_below(scores: FloatArray, others: FloatArray) -> IntArray:
    """Return for each of the others twice the number of scores below it; equal ones count half."""
    ordered = np.sort(scores)
    twice: IntArray = ordered.searchsorted(others, "left") + ordered.searchsorted(others, "right")
    return twice


def height_at(healthy: FloatArray, nodule: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the true positive rate at no more than each false positive rate, (G,)."""
    allowed = np.minimum(np.floor(grid * healthy.size + 1e-9).astype(int), healthy.size)
    # With k false positives allowed, the threshold is the score of rank k + 1 from the top.
    thresholds = np.append(np.sort(healthy)[::-1], -np.inf)[allowed]
    not_above = np.sort(nodule).searchsorted(thresholds, side="right")
    heights: FloatArray = 1.0 - not_above / nodule.size
    return heights


def auc_interval(
    healthy: FloatArray,
    nodule: FloatArray,
    confidence: float,
    healthy_clusters: IntArray | None = None,
    nodule_clusters: IntArray | None = None,
) -> Interval:
    """Return the area under the ROC curve, and an interval that does not collapse at 0 or 1.

    The interval holds every area A that is at most z standard errors from the measured one. The
    standard error is that of A (Hanley and McNeil 1982, in the form that Newcombe, Statistics in
    Medicine 25, 2006, calls method 5)::

        V(A) = A (1 - A) / (m n) (1 + N (1 - A) / (2 - A) + N A / (1 + A)),  N = (m + n) / 2 - 1

    With clusters, m and n are divided by the design effect, which is at least 1. It is the variance
    of the area from sums of its components over clusters (Obuchowski, Biometrics 53, 1997), divided
    by that without clusters (DeLong 1988). For an area of 0 or 1, m and n are the numbers of
    clusters. Both are multiplied by the `student_factor` of the smaller number of clusters.

    Parameters
    ----------
    healthy, nodule : (m,), (n,) array
        Scores. Without any of a kind, all values are NaN.
    confidence : float
        Level of the interval.
    healthy_clusters, nodule_clusters : (m,), (n,) array of int, optional
        The cluster of each recording. A cluster may have recordings of both kinds. The ends are NaN
        with fewer than `FEWEST_CLUSTERS` of a kind, if any cluster has several recordings.
    """
    area = auc(healthy, nodule)
    if math.isnan(area):
        return UNKNOWN
    m, n = float(healthy.size), float(nodule.size)
    if healthy_clusters is not None and nodule_clusters is not None:
        kinds = [np.unique(each).size for each in (healthy_clusters, nodule_clusters)]
        joined = np.concatenate([healthy_clusters, nodule_clusters])
        if np.unique(joined).size < joined.size:
            if min(kinds) < FEWEST_CLUSTERS:
                return area, math.nan, math.nan
            effect = _effect_on_area(healthy, nodule, joined)
            m, n = (m / effect, n / effect) if effect else (float(kinds[0]), float(kinds[1]))
            factor = student_factor(min(kinds), confidence)
            m, n = m * factor, n * factor
    z = normal_quantile(confidence)

    def outside(candidate: float) -> bool:
        together = max((m + n) / 2 - 1, 0.0)
        spread = 1 + together * (1 - candidate) / (2 - candidate)
        spread += together * candidate / (1 + candidate)
        return (candidate - area) ** 2 > z**2 * candidate * (1 - candidate) * spread / (m * n)

    return area, last_outside(outside, 0.0, area), last_outside(outside, 1.0, area)


def _effect_on_area(healthy: FloatArray, nodule: FloatArray, clusters: IntArray) -> float:
    """Return the design effect of an area, at least 1; 0 if its components do not differ.

    The clusters, (m + n,), are first those of the healthy recordings.
    """
    below = _twice_below(nodule, healthy) / (2 * nodule.size)
    components = np.concatenate([1 - below, _twice_below(healthy, nodule) / (2 * healthy.size)])
    of_nodule = np.arange(components.size) >= healthy.size
    labels, cluster_of = np.unique(clusters, return_inverse=True)
    independent, sums = 0.0, np.zeros(labels.size)
    for kind in (of_nodule, ~of_nodule):
        centred = components[kind] - components[kind].mean()
        size, number = centred.size, np.unique(clusters[kind]).size
        independent += float(centred @ centred) / (size * max(size - 1, 1))
        # Each kind has its own number of clusters.
        grown = math.sqrt(number / (number - 1)) / size
        sums += grown * np.bincount(cluster_of[kind], centred, minlength=labels.size)
    return max(float(sums @ sums) / independent, 1.0) if independent > 0 else 0.0
