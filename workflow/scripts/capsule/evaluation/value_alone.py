"""Guess the class of recordings from a value of their headers alone, and count right guesses.

It imports nothing heavy, because the end of a run uses it.
"""

from collections import Counter, defaultdict
from collections.abc import Mapping, Set
from dataclasses import dataclass
from math import ceil, exp, fsum, inf, lgamma

# A value speaks for a class that has it at least so many times as often as all others together.
TIMES = 3
# The mean of the two classes' rates; guessing has 0.5.
LEAST = 0.8
# The largest probability that chance alone gives such rates.
CHANCE = 0.01
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Told:
    """The number of places of a class, and of the others, that a value alone tells rightly.

    Attributes
    ----------
    found, of : float
        Places of the class; a place whose recordings have several values counts in parts.
    passed, others : float
        Places of the others.
    """

    found: float
    of: float
    passed: float
    others: float

    @property
    def all_right(self) -> bool:
        """Return whether every place is told rightly."""
        right = self.found + self.passed > self.of + self.others - _ROUNDING
        return bool(self.of and self.others) and right

    def too_well(self, of_tests: int = 1) -> bool:
        """Return whether the mean of both rates is at least `LEAST`, and not by chance.

        Parameters
        ----------
        of_tests : int
            Number of tests of which this is one (Bonferroni 1936).
        """
        if not self.of or not self.others:
            return False
        mean = (self.found / self.of + self.passed / self.others) / 2
        return mean >= LEAST - _ROUNDING and self.chance() <= CHANCE / of_tests

    def chance(self) -> float:
        """Return the one-sided p-value of Fisher's exact test; parts of places count as wrong."""
        of, others = ceil(self.of - _ROUNDING), ceil(self.others - _ROUNDING)
        hits = int(self.found + _ROUNDING)
        called = hits + others - int(self.passed + _ROUNDING)
        ways = (_choose(of, n) + _choose(others, called - n) for n in range(hits, of + 1))
        return sum(exp(each - _choose(of + others, called)) for each in ways)


def spoken_for(
    classes: Mapping[str, float], values: Mapping[str, str], places: Mapping[str, str]
) -> dict[str, float | None]:
    """Return the class for which the value of each recording speaks, by all other places.

    Parameters
    ----------
    classes : mapping of str to float
        The class of each recording.
    values, places : mapping of str to str
        Value and place of each of these recordings.

    Returns
    -------
    dict of str to float or None
        The class whose share of places with the value is at least `TIMES` times the sum of those of
        all other classes; None if there is none.
    """
    several = Counter((each, places[name]) for name, each in classes.items())
    # Weights of the places that have a value, by class; the same at each place.
    held: defaultdict[tuple[float, str], float] = defaultdict(float)
    own: defaultdict[tuple[float, str, str], float] = defaultdict(float)
    for name, each in classes.items():
        weight = 1 / several[each, places[name]]
        held[each, values[name]] += weight
        own[each, values[name], places[name]] += weight
    totals = Counter(each for each, _ in several)
    spoken: dict[str, float | None] = {}
    for name in classes:
        value, place = values[name], places[name]
        shares = {}
        for each, total in totals.items():
            rest = total - ((each, place) in several)
            weight = held.get((each, value), 0) - own.get((each, value, place), 0)
            shares[each] = weight / max(rest, 1)
        best = max(shares, key=lambda each: shares[each])
        others = sum(shares.values()) - shares[best]
        clear = shares[best] > _ROUNDING and shares[best] >= TIMES * others - _ROUNDING
        spoken[name] = best if clear else None
    return spoken


def told(called: Set[str], wanted: Set[str], others: Set[str], places: Mapping[str, str]) -> Told:
    """Return how many places of a class, and of the others, are told rightly.

    Parameters
    ----------
    called : set of str
        The recordings that are taken for recordings of the class.
    wanted, others : set of str
        The recordings of the class, and those of others.
    places : mapping of str to str
        The place of each recording.
    """
    at, elsewhere = (Counter(places[name] for name in each) for each in (wanted, others))
    # The same in any order, as Python's own sum is not.
    found = fsum(1 / at[places[name]] for name in wanted & called)
    passed = fsum(1 / elsewhere[places[name]] for name in others - called)
    return Told(found, len(at), passed, len(elsewhere))


def _choose(of: int, count: int) -> float:
    """Return the logarithm of a binomial coefficient, minus infinity if it is 0."""
    if not 0 <= count <= of:
        return -inf
    return lgamma(of + 1) - lgamma(count + 1) - lgamma(of - count + 1)
