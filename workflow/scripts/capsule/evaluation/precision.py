"""How many recordings give a rate with an interval as narrow as wanted."""

from math import ceil, sqrt
from statistics import NormalDist


def recordings_needed(rate: float, half_width: float, confidence: float) -> int:
    """Count the recordings whose Wilson interval is no wider than wanted.

    Half the width of Wilson's interval of n recordings is
    ``z sqrt(p q n + z^2 / 4) / (n + z^2)``; it falls as n grows, and equals the wanted w at the
    greater root of ``w^2 m^2 - p q z^2 m - (1/4 - p q) z^4 = 0``, with ``m = n + z^2``.

    Parameters
    ----------
    rate : float
        The rate p that is expected, 0 to 1; q = 1 - p. That n p need not be whole is not heeded.
    half_width : float
        Half the width w of the interval that is wanted, such as 0.1 for +-10 points; above 0.
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
    # A hair less, for a count that rounding lifts above a whole number.
    return max(ceil(count - 1e-9), 1)


def recordings_needed_within(low: float, high: float, half_width: float, confidence: float) -> int:
    """Count the recordings that suffice whatever the rate is between two ends.

    Parameters
    ----------
    low, high : float
        Ends of the rates that are thought possible, such as of an interval so far.
    half_width, confidence : float
        As in `recordings_needed`.

    Returns
    -------
    int
        For the rate nearest to one half, where an interval is widest.
    """
    return recordings_needed(min(max(0.5, low), high), half_width, confidence)
