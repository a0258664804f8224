"""The interval of the ratio of two independent rates."""

import math
from statistics import NormalDist

# Largest logarithm of a ratio that the search for the ends of an interval needs.
_WIDEST = 60.0


def ratio_interval(
    hits: int, count: int, other_hits: int, other_count: int, confidence: float
) -> tuple[float, float]:
    """Return Koopman's score interval of (hits / count) / (other_hits / other_count).

    The interval holds every ratio that a score test does not reject (Koopman, Biometrics 40,
    1984). The test never rejects the measured ratio, so the interval always contains it, even if a
    rate is 0 or 1.

    Parameters
    ----------
    hits, count : int
        The first rate; the count is at least 1.
    other_hits, other_count : int
        The second rate; the count is at least 1.
    confidence : float
        Level of the interval.

    Returns
    -------
    low, high : float
        The upper end is infinite if the second rate is 0. Both ends are NaN if both rates are 0.
    """
    if hits == 0 and other_hits == 0:
        return float("nan"), float("nan")
    z = NormalDist().inv_cdf(0.5 + confidence / 2)
    counts = (hits, count, other_hits, other_count)
    if hits == 0:
        return 0.0, math.exp(_crossing(counts, -z, -_WIDEST))
    if other_hits == 0:
        return math.exp(_crossing(counts, z, _WIDEST)), float("inf")
    counted = math.log(hits / count) - math.log(other_hits / other_count)
    low, high = (math.exp(_crossing(counts, level, counted)) for level in (z, -z))
    return low, high


def _crossing(counts: tuple[int, int, int, int], level: float, counted: float) -> float:
    """Return the logarithm of the ratio at which the score reaches a level, by bisection.

    The score falls as the ratio grows, and is 0 at the measured ratio. It reaches a positive level
    below the measured ratio, and a negative level above it.
    """
    low, high = (-_WIDEST, counted) if level > 0 else (counted, _WIDEST)
    for _ in range(200):
        middle = (low + high) / 2
        if middle in (low, high):
            break
        if _score(counts, math.exp(middle)) > level:
            low = middle
        else:
            high = middle
    # Of the two last values the outer one, so that the interval is not too narrow.
    return low if level > 0 else high


def _score(counts: tuple[int, int, int, int], ratio: float) -> float:
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
