"""Find the keys of the header whose values have one class only, among the recordings that teach.

A detector may then learn the value, such as the source, instead of the nodule.

It imports nothing heavy, because the end of a run uses it.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from capsule.kinds import Row
from capsule.recordings.held_out import teaching
from capsule.recordings.names import size_mm
from capsule.recordings.origin import places_of
from capsule.words import enumerate_words

# Columns of results/recordings.csv, in words. Site and set-up belong to one size by design.
KEYS = {"source": "source", "session": "session", "unit": "unit", "rate_hz": "sampling rate"}
# Stands for all values that a single place has: they tell nothing of another place.
OWN = "\0"
# A simulated source ends with its seed, which differs between sessions.
_SEED = re.compile(r", seed [^,]*$")
# The largest probability that a value has one class only by chance.
CHANCE = 0.01


@dataclass(frozen=True)
class Confounded:
    """A key with values of one class only.

    Attributes
    ----------
    key : str
        One of `KEYS`.
    nodules : bool
        Whether a value has nodules only, or healthy places only.
    sizes_mm : tuple of float
        The sizes that are the only ones among the nodules of a value.
    counts : dict of str to Counter
        Recordings by value and size, the most frequent value first. An empty text stands for
        headers without the key, and `OWN` for each value of a single place.
    """

    key: str
    nodules: bool
    sizes_mm: tuple[float, ...]
    counts: dict[str, Counter[float]]

    def what(self) -> str:
        """Return what follows from the key, in words."""
        if self.nodules:
            return "whether there is a nodule"
        return (
            f"the size of nodules of {enumerate_words([f'{size:g}' for size in self.sizes_mm])} mm"
        )


def in_words(found: Iterable[Confounded]) -> str:
    """Return what follows from which keys, as a clause; empty if there is no key."""
    keys: dict[str, list[str]] = {}
    for each in found:
        keys.setdefault(each.what(), []).append(f"from the {KEYS[each.key]}")
    clauses = [f"{what} follows {enumerate_words(those)}" for what, those in keys.items()]
    return ", and ".join(clauses)


def confounded_keys(rows: Mapping[str, Row], held_out: Iterable[str]) -> list[Confounded]:
    """Return the keys with values of one class only, in the order of `KEYS`.

    The rows are those of results/recordings.csv by recording; what is not known is an empty text.
    """
    able = {
        name: row
        for name, row in teaching(rows, held_out).items()
        if row["status"] == "accepted" and size_mm(name) is not None and not row.get("no_verdict")
    }
    sizes_mm, places = {name: size_mm(name) or 0.0 for name in able}, places_of(able)
    found = []
    for key in KEYS:
        values = {name: str(row.get(key) or "") for name, row in able.items()}
        if key == "source":
            values = {name: _SEED.sub("", text) for name, text in values.items()}
        found.append(of_values(key, values, sizes_mm, places))
    return [each for each in found if each.nodules or each.sizes_mm]


def of_values(
    key: str, values: Mapping[str, str], sizes_mm: Mapping[str, float], places: Mapping[str, str]
) -> Confounded:
    """Return what a key tells, from the value, the size and the place of each recording."""
    at = Counter(value for value, _ in {(value, places[name]) for name, value in values.items()})
    said = {name: OWN if at[value] == 1 else value for name, value in values.items()}
    counts: defaultdict[str, Counter[float]] = defaultdict(Counter)
    for name, value in said.items():
        counts[value][sizes_mm[name]] += 1
    ordered = sorted(counts.items(), key=lambda each: (-each[1].total(), each[0]))
    kinds = {name: float(size > 0) for name, size in sizes_mm.items()}
    nodules = {name: size for name, size in sizes_mm.items() if size > 0}
    alone_mm = only_of_one(nodules, said, places).values()
    return Confounded(
        key, bool(only_of_one(kinds, said, places)), tuple(sorted(set(alone_mm))), dict(ordered)
    )


def only_of_one(
    classes: Mapping[str, float], values: Mapping[str, str], places: Mapping[str, str]
) -> dict[str, float]:
    """Return the values whose places are all of one class, each with that class.

    A value counts if so many places of a class meet by chance with a probability of `CHANCE` at
    most, divided by the number of values and classes (Bonferroni 1936). If every value of an
    archive has one class only, all of them count. Class, value and place are by recording.
    """
    held = {(values[name], places[name], each) for name, each in classes.items()}
    totals = Counter(each for _, _, each in held)
    of_values: defaultdict[str, Counter[float]] = defaultdict(Counter)
    for value, _, each in held:
        of_values[value][each] += 1
    if len(totals) < 2:
        return {}
    pure = {value: next(iter(of)) for value, of in of_values.items() if len(of) == 1}
    alone = {value: each for value, each in pure.items() if value != OWN}
    if len(pure) == len(of_values):
        return alone
    least = CHANCE / (len(of_values) * len(totals))
    return {
        value: each
        for value, each in alone.items()
        if (totals[each] / totals.total()) ** of_values[value][each] <= least
    }
