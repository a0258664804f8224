"""Splits of an archive at random into recordings that teach and recordings that are judged."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import ceil

import numpy as np

from capsule.evaluation.folds import left_out_alone
from capsule.seeding import generator

PARTS = 4
# Wanted number of recordings times splits at each share, and the largest number of splits.
_DRAWN, _MOST_SPLITS = 960, 40


@dataclass(frozen=True)
class Split:
    """A division of an archive into recordings that teach and recordings that are judged.

    Attributes
    ----------
    share : float
        Share of the archive that teaches.
    taught, judged : tuple of str
        Names of the recordings; together they are the whole archive.
    """

    share: float
    taught: tuple[str, ...]
    judged: tuple[str, ...]


def deal(sizes_mm: Mapping[str, float], numbers: np.random.Generator) -> list[list[str]]:
    """Return the recordings in four parts, with each size spread as evenly as possible.

    Parameters
    ----------
    sizes_mm : mapping of str to float
        The recordings and their true sizes, in an order that does not depend on names.
    numbers : Generator
        Source of the random numbers that shuffle the recordings of each size.
    """
    shuffled: list[str] = []
    for size_mm in sorted(set(sizes_mm.values())):
        names = [name for name, size in sizes_mm.items() if size == size_mm]
        shuffled += [names[place] for place in numbers.permutation(len(names))]
    return [shuffled[part::PARTS] for part in range(PARTS)]


def draw_splits(sizes_mm: Mapping[str, float], seed: int) -> list[Split]:
    """Draw the splits at a quarter, a half and three quarters of an archive.

    Parameters
    ----------
    sizes_mm : mapping of str to float
        The recordings and their true sizes, as in `deal`.
    seed : int
        The configured seed.

    Returns
    -------
    list of Split
        The splits, ordered by share; empty if there is no recording.
    """
    if not sizes_mm:
        return []
    wanted = min(ceil(_DRAWN / len(sizes_mm)), _MOST_SPLITS)
    deals, turns = ceil(wanted / PARTS), range(0, PARTS, PARTS // min(wanted, PARTS))
    dealt = [deal(sizes_mm, generator(seed, "learning", str(each))) for each in range(deals)]
    drawn = []
    for count in range(1, PARTS):
        for parts in dealt:
            for first in turns:
                turned = parts[first:] + parts[:first]
                taught, judged = chain(*turned[:count]), chain(*turned[count:])
                drawn.append(Split(count / PARTS, tuple(taught), tuple(judged)))
    return drawn


def taught_counts(splits: Sequence[Split], sizes_mm: Mapping[str, float]) -> dict[float, float]:
    """Return how many recordings of each size teach, on average over the splits."""
    times = Counter(sizes_mm[name] for split in splits for name in split.taught)
    return {size_mm: times[size_mm] / len(splits) for size_mm in sorted(set(sizes_mm.values()))}


def counts_in_folds(sizes_mm: Mapping[str, float], most: int) -> dict[float, float]:
    """Return the same as `taught_counts`, for leave-one-out."""
    sizes = list(sizes_mm.values())
    counts = Counter(sizes)
    left_out = dict.fromkeys(counts, 0)
    folds = Counter(zip(sizes, left_out_alone(sizes, most), strict=True))
    for (size, _), together in folds.items():
        left_out[size] += together**2
    return {size: count - left_out[size] / len(sizes) for size, count in counts.items()}
