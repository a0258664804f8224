"""The number of recordings that a rate needs for an interval of a wanted width."""

from math import ceil, sqrt
from statistics import NormalDist


def recordings_needed(rate: float, half_width: float, confidence: float) -> int:
    """Return how many recordings give a Wilson interval no wider than wanted.

    Half the width of the Wilson interval of n recordings is
    ``z sqrt(p q n + z^2 / 4) / (n + z^2)``. It falls as n grows. With ``m = n + z^2``, it equals
    the wanted w at the greater root of ``w^2 m^2 - p q z^2 m - (1/4 - p q) z^4 = 0``.

    Parameters
    ----------
    rate : float
        The expected rate p, 0 to 1; q = 1 - p. The product n p need not be a whole number.
    half_width : float
        Half the wanted width w of the interval, such as 0.1 for +-10 points; above 0.
    confidence : float
        Level of the interval, such as 0.95.

    Returns
    -------
    int
        At least 1.
    """
    square = NormalDist().inv_cdf(0.5 + confidence / 2) ** 2
    spread = rate * (1 - rate)
    root = sqrt(spread**2 + 4 * half_width**2 * (0.25 - spread))
    count = square * (spread + root) / (2 * half_width**2) - square
    # Slightly less, because rounding can lift a count above a whole number.
    return max(ceil(count - 1e-9), 1)


def recordings_needed_within(low: float, high: float, half_width: float, confidence: float) -> int:
    """Return how many recordings are enough for every rate between two ends.

    Parameters
    ----------
    low, high : float
        Smallest and largest possible rate, such as the ends of an interval measured so far.
    half_width, confidence : float
        As in `recordings_needed`.

    Returns
    -------
    int
        The number for the rate nearest to one half, where the interval is widest.
    """
    return recordings_needed(min(max(0.5, low), high), half_width, confidence)
