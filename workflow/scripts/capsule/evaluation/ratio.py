"""The interval of a ratio of two rates that were counted apart from each other."""

import math
from statistics import NormalDist

# Beyond these logarithms no ratio of two counted rates has an end of its interval.
_WIDEST = 60.0


def ratio_interval(
    hits: int, count: int, other_hits: int, other_count: int, confidence: float
) -> tuple[float, float]:
    """Return Koopman's score interval of (hits / count) / (other_hits / other_count).

    The interval holds every ratio that a score test does not reject (Koopman, Biometrics 40,
    1984). The counted ratio itself is never rejected, so the interval never leaves it out, also
    where a rate is 0 or 1.

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
        The upper end is infinite where the second rate is 0; both are NaN where both rates are.
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
    """Find by bisection the logarithm of the ratio at which the score has a level.

    The score falls with the ratio, and is 0 at the counted one: a positive level is crossed below
    it, a negative one above it.
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
    # The outer one of the two last logarithms.
    return low if level > 0 else high


def _score(counts: tuple[int, int, int, int], ratio: float) -> float:
    """Return how far the counts lie from a ratio of the rates, in standard errors."""
    hits, count, other_hits, other_count = counts
    # The likeliest second rate if the ratio were true: a root of a quadratic equation.
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
