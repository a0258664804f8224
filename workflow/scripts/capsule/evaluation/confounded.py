"""Find the keys of the header from which the nodule follows, among the recordings that teach.

A detector may then learn the value, such as the source, instead of the nodule.

It imports nothing heavy, because the end of a run uses it.
"""

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from capsule.evaluation.value_alone import Told, spoken_for, told
from capsule.held_out import places_of, teaching
from capsule.kinds import Row
from capsule.names import size_mm
from capsule.words import enumerate_words

# Columns of results/recordings.csv, in words. Site and set-up belong to one size by design.
KEYS = {"source": "source", "session": "session", "unit": "unit", "rate_hz": "sampling rate"}
# Stands for all values that a single place has: they tell nothing of another place.
OWN = "\0"
# A simulated source ends with its seed, which differs between sessions.
_SEED = re.compile(r", seed [^,]*$")


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
    of_keys = (of_values(key, said, sizes_mm, places) for key, said in values.items())
    return [each for each in of_keys if each]


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
    nodules_mm, alone_mm = [], []
    all_mm = sorted(set(nodules.values()))
    for each in all_mm:
        those = {name for name, size in nodules.items() if size == each}
        if told(found, those, healthy, places).too_well(len(all_mm)):
            nodules_mm.append(each)
        right = {name for name, size in sizes.items() if size == each}
        if told(right, those, nodules.keys() - those, places).too_well(len(all_mm)):
            alone_mm.append(each)
    counts: dict[str, Counter[float]] = {}
    for name, value in said.items():
        counts.setdefault(value, Counter())[sizes_mm[name]] += 1
    of_all = told(found, nodules.keys(), healthy, places)
    ordered = sorted(counts.items(), key=lambda each: (-each[1].total(), each[0]))
    return Confounded(key, of_all, tuple(nodules_mm), tuple(alone_mm), dict(ordered))
