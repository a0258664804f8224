"""The intervals of rates, means, differences and areas, over recordings that may share a place.

What is estimated is the rate at a new place. Each of m passes over a place weighs 1 / m, and passes
over one place succeed or fail together. So each function takes the `Units` of the recordings. If
every cluster is of one recording, the recordings are independent.

An interval is a value with its two ends. All three are NaN without a recording. The ends are NaN if
there are too few recordings or clusters. The confidence is the level of the interval, such as 0.95.
"""

import math
from collections.abc import Callable
from statistics import NormalDist
from typing import NamedTuple, TypeAlias

import numpy as np

from capsule.arrays import BoolArray, FloatArray, IntArray
from capsule.detectors.calibrate import place_weights

#: A value with the ends of its interval.
Interval: TypeAlias = tuple[float, float, float]

UNKNOWN: Interval = (math.nan, math.nan, math.nan)
# Level of `lower_bound`.
ONE_SIDED = 0.95
# Probability of the central range of `new_specificity`.
_OF_NEW = 0.9
# With fewer clusters, their scatter tells nothing, and there is no interval.
FEWEST_CLUSTERS = 3
# Largest logarithm of a ratio that the search for the ends of its interval needs.
_WIDEST = 60.0
# In ranks, and in recordings.
_ROUNDING = 1e-9


class Units(NamedTuple):
    """What recordings stand for in a rate.

    Attributes
    ----------
    weights : (n,) array
        1 / m of each recording, where m are passes over its place.
    clusters : (n,) array of int
        What the next archive draws anew: the place, or the set-up.
    """

    weights: FloatArray
    clusters: IntArray

    @classmethod
    def of_places(cls, places: IntArray) -> "Units":
        """Return the units of recordings whose places are all their passes, numbered from 0 on."""
        return cls(place_weights(places), places)

    @property
    def cluster_count(self) -> int:
        """Number of clusters."""
        return int(np.unique(self.clusters).size)

    def of(self, some: BoolArray) -> "Units":
        """Return the units of some of the recordings."""
        return Units(self.weights[some], self.clusters[some])


def normal_quantile(confidence: float) -> float:
    """Return z, the standard deviations within which the confidence lies."""
    return NormalDist().inv_cdf(0.5 + confidence / 2)


def _student_quantile(degrees: float, confidence: float) -> float:
    """Return t, as `normal_quantile` for Student's distribution."""
    # scipy is imported late: that takes longer than most jobs, and not every user needs it.
    from scipy.special import stdtrit

    return float(stdtrit(degrees, 0.5 + confidence / 2))


def student_factor(clusters: int, confidence: float) -> float:
    """Return (z / t)^2, with t of K - 1 degrees of freedom for K clusters.

    By this factor, a number of recordings pays for a variance that K sums estimate.
    """
    return (normal_quantile(confidence) / _student_quantile(clusters - 1, confidence)) ** 2


def effective_count(
    values: FloatArray | BoolArray, units: Units, confidence: float, variance: float | None = None
) -> float:
    """Return how many independent values tell as much about the weighted mean as these.

    The variance of the mean follows from the weighted sums of the K clusters. The design effect is
    this variance divided by that of independent values, and at least 1. The effective number is
    (sum of w)^2 / (sum of w^2), which is n for equal weights (Kish 1965), divided by it (Rao and
    Scott, Biometrics 48, 1992). If the values do not differ, it is K. It is multiplied by the
    `student_factor`.

    Parameters
    ----------
    values : (n,) array
        The values; for a rate, 1 for a hit and 0 for none.
    units : Units
        The units of the values. If no two values share a cluster, the effective number is that of
        independent values. With fewer clusters than `FEWEST_CLUSTERS`, it is NaN.
    confidence : float
        Level of the interval that is to be computed.
    variance : float, optional
        Variance of a single value; by default p (1 - p) of their mean p, as of a rate.
    """
    if not values.size:
        return 0.0
    # Equal weights become 1, so that rounding leaves their effective number whole.
    weights = units.weights / units.weights.max()
    total = weights.sum()
    labels, cluster_of = np.unique(units.clusters, return_inverse=True)
    independent = float(total**2 / np.sum(weights**2))
    if labels.size == values.size:
        return independent
    if labels.size < FEWEST_CLUSTERS:
        return math.nan
    mean = np.average(values, weights=weights)
    if variance is None:
        variance = float(mean * (1 - mean))
    effective = float(labels.size)
    if variance > 0:
        sums = np.bincount(cluster_of, weights * (values - mean))
        of_mean = labels.size / (labels.size - 1) * float(sums @ sums) / total**2
        effective = min(variance / of_mean, independent) if of_mean > 0 else independent
    return effective * student_factor(labels.size, confidence)


def rate(hits: float, count: float, confidence: float, effective: float | None = None) -> Interval:
    """Return a rate and its Wilson interval, of as many recordings as are effective.

    Hits that are means of several verdicts need not be whole numbers. The effective number is that
    of `effective_count`; by default the count.
    """
    if count == 0:
        return UNKNOWN
    share, size = hits / count, count if effective is None else effective
    if math.isnan(size):
        return share, math.nan, math.nan
    z = normal_quantile(confidence)
    centre = share + z**2 / (2 * size)
    reach = z * math.sqrt(share * (1 - share) / size + (z / (2 * size)) ** 2)
    scale = 1 + z**2 / size
    # If all or none are hits, the interval ends exactly there; rounding would move it.
    low = 0.0 if hits == 0 else (centre - reach) / scale
    high = 1.0 if hits == count else (centre + reach) / scale
    return share, min(low, share), max(high, share)


def rate_of(right: FloatArray | BoolArray, units: Units, confidence: float) -> Interval:
    """Return the weighted share of hits among recordings, and its Wilson interval.

    Each recording of ``right`` is 1 for a hit, 0 for none, or a share between.
    """
    effective, weights = effective_count(right, units, confidence), units.weights
    return rate(float((weights * right).sum()), float(weights.sum()), confidence, effective)


def lower_bound(right: FloatArray | BoolArray, units: Units) -> float:
    """Return the one-sided 95 % lower bound of a rate, from Wilson's interval over clusters.

    A rate is reliably reached if this bound reaches it, not if the estimate does.
    """
    return rate_of(right, units, 2 * ONE_SIDED - 1)[1]


def last_outside(outside: Callable[[float], bool], out: float, inside: float) -> float:
    """Return the last value outside an interval, by bisection from a value outside to one inside.

    If the outer value is inside as well, the interval ends there.
    """
    while outside(out) and (middle := (out + inside) / 2) not in (out, inside):
        out, inside = (middle, inside) if outside(middle) else (out, middle)
    return out


def ratio_interval(
    hits: float, count: float, other_hits: float, other_count: float, confidence: float
) -> tuple[float, float]:
    """Return Koopman's score interval of (hits / count) / (other_hits / other_count).

    The interval holds every ratio that a score test does not reject (Koopman, Biometrics 40,
    1984). The test never rejects the measured ratio, so the interval always contains it, even if a
    rate is 0 or 1.

    The counts are above 0. Effective counts need not be whole numbers. The upper end is infinite if
    the second rate is 0. Both ends are NaN if both rates are 0, or if a count is NaN.
    """
    if hits == other_hits == 0 or math.isnan(count + other_count):
        return math.nan, math.nan
    z = normal_quantile(confidence)
    counts = hits, count, other_hits, other_count
    if hits == 0:
        measured = -_WIDEST
    elif other_hits == 0:
        measured = _WIDEST
    else:
        measured = math.log(hits / count) - math.log(other_hits / other_count)
    # The score falls as the ratio grows, and is 0 at the measured ratio.
    low = last_outside(lambda log: _score(counts, math.exp(log)) > z, -_WIDEST, measured)
    high = last_outside(lambda log: _score(counts, math.exp(log)) <= -z, _WIDEST, measured)
    return 0.0 if hits == 0 else math.exp(low), math.inf if other_hits == 0 else math.exp(high)


def _score(counts: tuple[float, float, float, float], ratio: float) -> float:
    """Return the distance of the counts from a ratio of the rates, in standard errors."""
    hits, count, other_hits, other_count = counts
    # The most likely second rate for this ratio is a root of a quadratic equation.
    total = hits + other_hits
    linear = ratio * (count + other_hits) + hits + other_count
    square = linear**2 - 4 * (count + other_count) * ratio * total
    other_rate = 2 * total / (linear + math.sqrt(max(square, 0.0)))
    rate = min(ratio * other_rate, 1.0)
    variance = rate * (1 - rate) / count
    variance += ratio**2 * other_rate * max(1 - other_rate, 0.0) / other_count
    difference = hits / count - ratio * other_hits / other_count
    if variance == 0.0:
        return math.copysign(math.inf, difference) if difference else 0.0
    return difference / math.sqrt(variance)


def mean_interval(values: FloatArray, units: Units, confidence: float) -> Interval:
    """Return a weighted mean and its Student interval.

    Of values that share no cluster, the degrees of freedom are their effective number less 1: the
    passes over a place that are not among the values make the weights of the others unequal. Over
    clusters, the standard error is that of `effective_count`, which already holds the factor
    of Student's t.
    """
    count = values.size
    if count < 2:
        return (float(values[0]), math.nan, math.nan) if count else UNKNOWN
    weights, total = units.weights, units.weights.sum()
    mean = float(np.average(values, weights=weights))
    off = (values - mean) ** 2
    deviation = math.sqrt(np.sum(weights * off) / (total - np.sum(weights**2) / total))
    size = effective_count(values, units, confidence, deviation**2)
    alone = units.cluster_count == count
    quantile = _student_quantile(size - 1, confidence) if alone else normal_quantile(confidence)
    reach = float(quantile * deviation / size**0.5)
    return mean, mean - reach, mean + reach


def median_interval(values: FloatArray, units: Units, confidence: float) -> Interval:
    """Return a weighted median and its interval, which holds for any distribution.

    The ends are two of the values. Over clusters, they are the values between which the Wilson
    interval of a share of one half lies, of as many recordings as the clusters are worth (Woodruff
    1952). Even the lowest and the highest value of K clusters have the true median between them
    with a probability of ``1 - 2^(1 - K)`` only: where that is too little, there is no interval.
    """
    if values.size == 0:
        return UNKNOWN
    # By their weight among equal values, so that the order of the recordings does not matter.
    order, count = np.lexsort((units.weights, values)), values.size
    ordered = values[order]
    # The rank of each value, counted from 1; 1 / m of a rank for each of m passes over a place.
    ranks = np.cumsum(units.weights[order])
    ranks *= count / ranks[-1]
    middle = ranks.searchsorted([count / 2 - _ROUNDING, count / 2 + _ROUNDING])
    median = float(ordered[middle].mean())
    effective = effective_count(values < median, units, confidence)
    # The ends are the values of these places, counted from 1; a place of 0 is none.
    first = last = 0
    if effective == count:
        from scipy.special import bdtr

        # For each k, the probability that at most k of the values lie below the true median.
        at_most = bdtr(np.arange(count + 1), count, 0.5)
        first = int(np.searchsorted(at_most, (1 - confidence) / 2))
        last = count + 1 - first
    elif not math.isnan(effective) and 2 * 0.5**units.cluster_count <= 1 - confidence:
        _, low, high = rate(0.5 * count, count, confidence, effective)
        first = max(int(ranks.searchsorted(low * count, "right")), 1)
        last = min(int(ranks.searchsorted(high * count)) + 2, count)
    if first == 0:
        return median, math.nan, math.nan
    return median, float(ordered[first - 1]), float(ordered[last - 1])


def gain_interval(
    before: FloatArray | BoolArray, after: FloatArray | BoolArray, units: Units, confidence: float
) -> Interval:
    """Return the mean gain in correct verdicts of the same recordings, with its interval.

    The interval is that of Bonett and Price for paired shares (2012): a Wald interval with two
    added recordings, one that gains everything and one that loses everything. It also holds for
    means over splits, whose differences lie between these two. All recordings together weigh as
    many as `effective_count` says.

    Before and after are shares of correct verdicts of each recording, 0 to 1. A recording with a
    NaN, because it was not judged both times, does not count.
    """
    difference = np.asarray(after, dtype=np.float64) - before
    known = ~np.isnan(difference)
    difference, units = difference[known], units.of(known)
    if difference.size == 0:
        return UNKNOWN
    weights = units.weights
    value = float(np.average(difference, weights=weights))
    variance = float(np.average((difference - value) ** 2, weights=weights))
    effective = effective_count(difference, units, confidence, variance)
    if math.isnan(effective):
        return value, math.nan, math.nan
    widened = np.append(difference, [1.0, -1.0])
    weights = np.append(weights * (effective / weights.sum()), [1.0, 1.0])
    centre = float(np.average(widened, weights=weights))
    variance = np.average((widened - centre) ** 2, weights=weights)
    reach = normal_quantile(confidence) * math.sqrt(variance / (effective + 2))
    # The two added recordings move the interval towards 0; it must still contain the mean.
    return value, min(max(centre - reach, -1.0), value), max(min(centre + reach, 1.0), value)


def new_specificity(healthy: int, specificity: float) -> tuple[float, float]:
    """Return the 90 % range of specificities to expect at new places of this bench.

    It does not hold for a new patient, whose places all differ from these in the same way.

    The threshold is the score of rank k = min(n, ceil((n + 1) specificity)) of n exchangeable
    healthy places. The specificity that it then has is distributed as Beta(k, n + 1 - k), whatever
    the scores are (Vovk, Asian Conference on Machine Learning 2012). It is approximate if the
    scores are cross-validated. Both ends are NaN without a healthy place.
    """
    if healthy == 0:
        return math.nan, math.nan
    from scipy.special import betaincinv

    # Slightly less, because rounding can lift a product such as 20 x 0.95 above a whole number.
    rank = max(min(math.ceil((healthy + 1) * specificity - 1e-9), healthy), 1)
    tails = (1 - _OF_NEW) / 2, (1 + _OF_NEW) / 2
    low, high = (float(betaincinv(rank, healthy + 1 - rank, tail)) for tail in tails)
    return low, high


def recordings_needed(rate: float, half_width: float, confidence: float) -> int:
    """Return how many recordings give a Wilson interval no wider than wanted, at least 1.

    Half the width of the Wilson interval of n recordings is
    ``z sqrt(p q n + z^2 / 4) / (n + z^2)``. It falls as n grows. With ``m = n + z^2``, it equals
    the wanted w at the greater root of ``w^2 m^2 - p q z^2 m - (1/4 - p q) z^4 = 0``.

    The expected rate is p, and q = 1 - p. The product n p need not be a whole number. The half
    width w is above 0, such as 0.1 for +-10 points.
    """
    square = normal_quantile(confidence) ** 2
    spread = rate * (1 - rate)
    root = math.sqrt(spread**2 + 4 * half_width**2 * (0.25 - spread))
    count = square * (spread + root) / (2 * half_width**2) - square
    # Slightly less, because rounding can lift a count above a whole number.
    return max(math.ceil(count - 1e-9), 1)


def auc(healthy: FloatArray, nodule: FloatArray, weights: tuple[FloatArray, FloatArray]) -> float:
    """Return the area under the ROC curve: how often a nodule scores above a healthy recording.

    Ties count half. The weights are those of the healthy recordings and of the nodules. The area is
    NaN if there are no scores of a kind.
    """
    if healthy.size == 0 or nodule.size == 0:
        return math.nan
    quiet, found = weights
    return float((found * _share_below(healthy, quiet, nodule)).sum() / found.sum())


def _share_below(scores: FloatArray, weights: FloatArray, others: FloatArray) -> FloatArray:
    """Return for each of the others the share of the scores below it; equal ones count half.

    The share of none is exactly 0, and that of all exactly 1.
    """
    order = np.argsort(scores, kind="stable")
    below, ordered = np.append(0.0, np.cumsum(weights[order])), scores[order]
    twice = below[ordered.searchsorted(others, "left")]
    twice += below[ordered.searchsorted(others, "right")]
    shares: FloatArray = twice / (2 * below[-1])
    return shares


def height_at(
    healthy: FloatArray,
    nodule: FloatArray,
    grid: FloatArray,
    weights: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Return the true positive rate at no more than each false positive rate, (G,).

    The weights are those of the healthy recordings and of the nodules.
    """
    quiet, found = weights
    order = np.argsort(-healthy, kind="stable")
    alarms = np.cumsum(quiet[order])
    allowed = alarms.searchsorted(grid * quiet.sum() + _ROUNDING, "right")
    # With k false positives allowed, the threshold is the score of rank k + 1 from the top.
    thresholds = np.append(healthy[order], -np.inf)[allowed]
    order = np.argsort(nodule, kind="stable")
    below = np.append(0.0, np.cumsum(found[order]))
    not_above = below[nodule[order].searchsorted(thresholds, side="right")]
    heights: FloatArray = 1.0 - not_above / below[-1]
    return heights


def auc_interval(
    healthy: FloatArray, nodule: FloatArray, units: tuple[Units, Units], confidence: float
) -> Interval:
    """Return the area under the ROC curve, and an interval that does not collapse at 0 or 1.

    The interval holds every area A that is at most z standard errors from the measured one. The
    standard error is that of A (Hanley and McNeil 1982, in the form that Newcombe, Statistics in
    Medicine 25, 2006, calls method 5)::

        V(A) = A (1 - A) / (m n) (1 + N (1 - A) / (2 - A) + N A / (1 + A)),  N = (m + n) / 2 - 1

    Of clusters, m and n are the independent numbers of `effective_count`, divided by the design
    effect, which is at least 1. It is the variance of the area from sums of its components over
    clusters (Obuchowski, Biometrics 53, 1997), divided by that without clusters (DeLong 1988). For
    an area of 0 or 1, m and n are the numbers of clusters. Both are multiplied by the
    `student_factor` of the smaller number of clusters.

    Parameters
    ----------
    healthy, nodule : (m,), (n,) array
        Scores. Without any of a kind, all values are NaN.
    units : (Units, Units)
        The units of both kinds. A cluster may have recordings of both. The ends are NaN with fewer
        than `FEWEST_CLUSTERS` of a kind, if any cluster has several recordings.
    confidence : float
        Level of the interval.
    """
    area = auc(healthy, nodule, (units[0].weights, units[1].weights))
    if math.isnan(area):
        return UNKNOWN
    m, n = (float(each.weights.sum() ** 2 / np.sum(each.weights**2)) for each in units)
    kinds = [each.cluster_count for each in units]
    joined = np.concatenate([each.clusters for each in units])
    if np.unique(joined).size < joined.size:
        if min(kinds) < FEWEST_CLUSTERS:
            return area, math.nan, math.nan
        effect = _effect_on_area(healthy, nodule, units)
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


def _effect_on_area(healthy: FloatArray, nodule: FloatArray, units: tuple[Units, Units]) -> float:
    """Return the design effect of an area, at least 1; 0 if its components do not differ."""
    quiet, found = units[0].weights, units[1].weights
    components = (
        1 - _share_below(nodule, found, healthy),
        _share_below(healthy, quiet, nodule),
    )
    labels = np.unique(np.concatenate([each.clusters for each in units]))
    independent, sums = 0.0, np.zeros(labels.size)
    for values, (weights, clusters) in zip(components, units, strict=True):
        total = weights.sum()
        centred = values - np.average(values, weights=weights)
        count, number = total**2 / np.sum(weights**2), np.unique(clusters).size
        independent += float(weights @ centred**2) / total / max(count - 1, 1)
        # Each kind has its own number of clusters.
        grown = math.sqrt(number / (number - 1)) / total
        cluster_of = np.searchsorted(labels, clusters)
        sums += grown * np.bincount(cluster_of, weights * centred, minlength=labels.size)
    return max(float(sums @ sums) / independent, 1.0) if independent > 0 else 0.0
