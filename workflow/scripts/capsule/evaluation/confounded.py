"""Find the keys of the header from which the nodule follows, among the recordings that teach.

A detector may then learn the value, such as the source, instead of the nodule. So the class of each
recording is guessed from its value alone, and right guesses are counted by place.

It imports nothing heavy, because the end of a run uses it.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass
from math import ceil, exp, fsum, inf, lgamma

from capsule.kinds import Row
from capsule.recordings.held_out import places_of, teaching
from capsule.recordings.names import size_mm
from capsule.words import enumerate_words

# Columns of results/recordings.csv, in words. Site and set-up belong to one size by design.
KEYS = {"source": "source", "session": "session", "unit": "unit", "rate_hz": "sampling rate"}
# Stands for all values that a single place has: they tell nothing of another place.
OWN = "\0"
# A simulated source ends with its seed, which differs between sessions.
_SEED = re.compile(r", seed [^,]*$")
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

        This is one of a number of tests (Bonferroni 1936).
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


def _choose(of: int, count: int) -> float:
    """Return the logarithm of a binomial coefficient, minus infinity if it is 0."""
    if not 0 <= count <= of:
        return -inf
    return lgamma(of + 1) - lgamma(count + 1) - lgamma(of - count + 1)


@dataclass(frozen=True)
class Confounded:
    """Facts that the values of a key tell; true if nodules or their sizes follow from it.

    Attributes
    ----------
    key : str
        One of `KEYS`.
    nodules : Told
        Nodules of any size, against healthy places.
    nodules_mm, sizes_mm : tuple of float
        The sizes whose nodules the values tell from healthy places, and from other nodules.
    counts : dict of str to dict of float to int
        Recordings by value and size, the most frequent value first. An empty text stands for
        headers without the key, and `OWN` for each value of a single place.
    """

    key: str
    nodules: Told
    nodules_mm: tuple[float, ...]
    sizes_mm: tuple[float, ...]
    counts: dict[str, Counter[float]]

    def __bool__(self) -> bool:
        """Return whether nodules or their sizes follow from the key."""
        return self.of_any or bool(self.nodules_mm or self.sizes_mm)

    @property
    def of_any(self) -> bool:
        """Return whether it follows from the key if there is a nodule of any size."""
        return self.nodules.all_right or self.nodules.too_well()

    def what(self) -> str:
        """Return what follows from the key, in words."""
        if self.of_any:
            return "whether there is a nodule"
        which = "whether there is a nodule" if self.nodules_mm else "the size of nodules"
        sizes_mm = [f"{size:g}" for size in self.nodules_mm or self.sizes_mm]
        return f"{which} of {enumerate_words(sizes_mm)} mm"


def in_words(found: Iterable[Confounded]) -> str:
    """Return what follows from which keys, as a clause; empty if there is no key."""
    keys: dict[str, list[str]] = {}
    for each in found:
        keys.setdefault(each.what(), []).append(f"from the {KEYS[each.key]}")
    clauses = [f"{what} follows {enumerate_words(those)}" for what, those in keys.items()]
    return ", and ".join(clauses)


def confounded_keys(rows: Mapping[str, Row], held_out: Iterable[str]) -> list[Confounded]:
    """Return the keys from which nodules or their sizes follow, in the order of `KEYS`.

    Parameters
    ----------
    rows : mapping of str to mapping
        Rows of results/recordings.csv by recording; what is not known is an empty text.
    held_out : iterable of str
        The key ``evaluation.held_out``.
    """
    able = {
        name: row
        for name, row in teaching(rows, held_out).items()
        if row["status"] == "accepted" and size_mm(name) is not None and not row.get("no_verdict")
    }
    sizes_mm, places = {name: size_mm(name) or 0.0 for name in able}, places_of(able)
    values = {key: {name: str(row.get(key) or "") for name, row in able.items()} for key in KEYS}
    values["source"] = {name: _SEED.sub("", text) for name, text in values["source"].items()}
    return list(filter(None, (of_values(key, values[key], sizes_mm, places) for key in KEYS)))


def of_values(
    key: str, values: Mapping[str, str], sizes_mm: Mapping[str, float], places: Mapping[str, str]
) -> Confounded:
    """Return what a key tells, from the value, the size and the place of each recording."""
    at = Counter(value for value, _ in {(value, places[name]) for name, value in values.items()})
    said = {name: OWN if at[value] == 1 else value for name, value in values.items()}
    nodules = {name: size for name, size in sizes_mm.items() if size > 0}
    healthy = sizes_mm.keys() - nodules.keys()
    kinds = spoken_for({name: float(name in nodules) for name in said}, said, places)
    sizes = spoken_for(nodules, said, places)
    found = {name for name, kind in kinds.items() if kind}
    all_mm = sorted(set(nodules.values()))
    nodules_mm, alone_mm = [], []
    for each in all_mm:
        those = {name for name, size in nodules.items() if size == each}
        right = {name for name, size in sizes.items() if size == each}
        if told(found, those, healthy, places).too_well(len(all_mm)):
            nodules_mm.append(each)
        if told(right, those, nodules.keys() - those, places).too_well(len(all_mm)):
            alone_mm.append(each)
    counts: defaultdict[str, Counter[float]] = defaultdict(Counter)
    for name, value in said.items():
        counts[value][sizes_mm[name]] += 1
    ordered = sorted(counts.items(), key=lambda each: (-each[1].total(), each[0]))
    of_all = told(found, nodules.keys(), healthy, places)
    return Confounded(key, of_all, tuple(nodules_mm), tuple(alone_mm), dict(ordered))


def spoken_for(
    classes: Mapping[str, float], values: Mapping[str, str], places: Mapping[str, str]
) -> dict[str, float | None]:
    """Return the class for which the value of each recording speaks, by all other places.

    It is the class whose share of places with the value is at least `TIMES` times the sum of those
    of all other classes; None if there is none. Class, value and place are those of each recording.
    """
    several = Counter((each, places[name]) for name, each in classes.items())
    # Weights of the places that have a value, by class, and the same at each place.
    held: defaultdict[tuple[float, str], float] = defaultdict(float)
    own: defaultdict[tuple[float, str, str], float] = defaultdict(float)
    for name, each in classes.items():
        held[each, values[name]] += 1 / several[each, places[name]]
        own[each, values[name], places[name]] += 1 / several[each, places[name]]
    totals = Counter(each for each, _ in several)
    spoken: dict[str, float | None] = {}
    for name in classes:
        value, place = values[name], places[name]
        shares = {
            each: (held[each, value] - own[each, value, place])
            / max(total - ((each, place) in several), 1)
            for each, total in totals.items()
        }
        best = max(shares, key=lambda each: shares[each])
        others = sum(shares.values()) - shares[best]
        clear = shares[best] > _ROUNDING and shares[best] >= TIMES * others - _ROUNDING
        spoken[name] = best if clear else None
    return spoken


def told(called: Set[str], wanted: Set[str], others: Set[str], places: Mapping[str, str]) -> Told:
    """Return how many places of a class, and of the others, are told rightly.

    The recordings that are called are taken for recordings of the wanted class.
    """
    at, elsewhere = (Counter(places[name] for name in each) for each in (wanted, others))
    # The same in any order, as Python's own sum is not.
    found = fsum(1 / at[places[name]] for name in wanted & called)
    passed = fsum(1 / elsewhere[places[name]] for name in others - called)
    return Told(found, len(at), passed, len(elsewhere))
