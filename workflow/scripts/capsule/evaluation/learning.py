"""The learning curve: the rates that a part of an archive reaches, to see if more would help.

The archive is divided at random into four parts, with each size spread evenly. One, two or three
parts teach, and the rest is judged. A small archive is divided several times, and every part takes
its turn. A large archive needs fewer turns to judge as many recordings, which limits the work. The
last point is leave-one-out, where all recordings except one teach.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import ceil, sqrt
from statistics import NormalDist

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.training import Detector, TrainingArchive
from capsule.evaluation.folds import LEAVE_ONE_OUT
from capsule.evaluation.rates import interval_columns, rate_columns
from capsule.kinds import Cells, Row
from capsule.seeding import generator

PARTS = 4
# The share that stands for leave-one-out: all recordings except the judged one teach.
ALL_BUT_ONE = 1.0
COLUMNS = [
    "detector",
    "share",
    "splits",
    "taught",
    "taught_healthy",
    "size_from_mm",
    "size_to_mm",
    "taught_of_size",
    "judged",
    "rate",
    "rate_low",
    "rate_high",
    "gain",
    "gain_low",
    "gain_high",
]
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


def mean_right(
    detector: Detector, archive: TrainingArchive, splits: Sequence[Split]
) -> dict[str, float]:
    """Teach a detector with each split, and return how often each recording is judged correctly.

    Returns
    -------
    dict of str to float
        Share of correct verdicts of each recording; NaN if it never had a verdict.
    """
    verdicts: dict[str, list[float]] = {name: [] for name in archive.sizes_mm}
    for split in splits:
        model = detector.without(split.judged)
        for name in split.judged:
            predicted_mm = model.verdict(archive.recording(name)).predicted_mm
            verdicts[name].append(is_right(archive.sizes_mm[name], predicted_mm))
    return {name: _mean_of_known(each) for name, each in verdicts.items()}


def is_right(true_mm: float, predicted_mm: float) -> float:
    """Return 1 for a correct verdict (nodule or none), 0 for a wrong one, NaN for no verdict."""
    if np.isnan(predicted_mm):
        return float("nan")
    return float((true_mm > 0) == (predicted_mm > 0))


def _mean_of_known(values: Sequence[float]) -> float:
    known = [value for value in values if not np.isnan(value)]
    return sum(known) / len(known) if known else float("nan")


def size_ranges(sizes_mm: Iterable[float]) -> list[tuple[float, float]]:
    """Return the ranges that have rates: no nodule, each size, and all except the smallest size."""
    sizes = sorted(set(sizes_mm))
    each = [(size, size) for size in sizes]
    return each + [wanted for wanted in main_ranges(sizes) if wanted[0] < wanted[1]]


def main_ranges(sizes_mm: Iterable[float]) -> list[tuple[float, float]]:
    """Return the most informative ranges: no nodule, the smallest size, and all larger sizes."""
    sizes = sorted(set(sizes_mm))
    nodules = [size for size in sizes if size > 0]
    ranges = [(size, size) for size in [*sizes[: len(sizes) - len(nodules)], *nodules[:1]]]
    return [*ranges, (nodules[1], nodules[-1])] if len(nodules) > 1 else ranges


def mean_gain(
    before: FloatArray, after: FloatArray, confidence: float
) -> tuple[float, float, float]:
    """Return the mean gain in correct verdicts of the same recordings, with its interval.

    The interval is that of Bonett and Price for paired shares (2012): a Wald interval with two
    added recordings, one that gains everything and one that loses everything. It also holds for
    means over splits, whose differences lie between these two.

    Parameters
    ----------
    before, after : (n,) array
        Share of correct verdicts of each recording, 0 to 1; NaN if it was never judged.
    confidence : float
        Level of the interval.

    Returns
    -------
    value, low, high : float
        All NaN if no recording was judged both times.
    """
    difference = after - before
    difference = difference[~np.isnan(difference)]
    if difference.size == 0:
        return float("nan"), float("nan"), float("nan")
    widened = np.append(difference, [1.0, -1.0])
    reach = NormalDist().inv_cdf(0.5 + confidence / 2) * sqrt(widened.var() / widened.size)
    centre, value = float(widened.mean()), float(difference.mean())
    # The two added recordings move the interval towards 0; it must still contain the mean.
    return value, min(max(centre - reach, -1.0), value), max(min(centre + reach, 1.0), value)


def learning_rows(
    detectors: Mapping[str, Detector], archive: TrainingArchive, predictions: Iterable[Row]
) -> list[Cells]:
    """Return the rates of each detector for each number of recordings that teach it.

    Parameters
    ----------
    detectors : mapping of str to Detector
        The detectors, taught by the archive.
    archive : TrainingArchive
        The archive whose labelled recordings teach and are judged. The section ``evaluation`` of
        its settings holds seed and confidence.
    predictions : iterable of mapping
        Rows with ``detector``, ``scheme``, ``recording`` and ``predicted_mm``; those of
        leave-one-out give the last point.

    Returns
    -------
    list of dict
        One row for each detector, share and range of sizes, with the columns `COLUMNS`.
        ``taught``, ``taught_healthy`` and ``taught_of_size`` are means over the splits. ``rate`` is
        the specificity if both sizes are 0, otherwise the sensitivity; its Wilson interval counts
        each recording once. ``gain`` is the rate of leave-one-out minus this rate (`mean_gain`).
    """
    sizes_mm, rules = archive.sizes_mm, archive.settings["evaluation"]
    by_share: dict[float, list[Split]] = {}
    for split in draw_splits(sizes_mm, rules["seed"]):
        by_share.setdefault(split.share, []).append(split)
    alone = _left_out_alone(predictions, sizes_mm)
    rows = []
    for name, detector in detectors.items():
        right = {share: mean_right(detector, archive, each) for share, each in by_share.items()}
        last = alone.get(name)
        points = [
            (share, len(each), right[share], last, taught_counts(each, sizes_mm))
            for share, each in by_share.items()
        ]
        if last is not None:
            points.append((ALL_BUT_ONE, len(last), last, None, _counts_without_one(sizes_mm)))
        for share, splits, of_share, after, counts in points:
            key = {"detector": name, "share": share, "splits": splits}
            made = rate_rows(of_share, after, sizes_mm, counts, rules["confidence"])
            rows += [key | row for row in made]
    return rows


def _left_out_alone(
    predictions: Iterable[Row], sizes_mm: Mapping[str, float]
) -> dict[str, dict[str, float]]:
    """Return for each detector its correct verdicts under leave-one-out."""
    alone: dict[str, dict[str, float]] = {}
    for row in predictions:
        if row["scheme"] == LEAVE_ONE_OUT and row["recording"] in sizes_mm:
            name = row["recording"]
            right = is_right(sizes_mm[name], row["predicted_mm"])
            alone.setdefault(row["detector"], {})[name] = right
    return alone


def rate_rows(
    right: Mapping[str, float],
    after: Mapping[str, float] | None,
    sizes_mm: Mapping[str, float],
    counts: Mapping[float, float],
    confidence: float,
) -> list[Cells]:
    """Return the rates of one detector at one share, one row for each range of sizes.

    Parameters
    ----------
    right, after : mapping of str to float
        Share of correct verdicts of each recording, and the same under leave-one-out (None: no
        gain).
    sizes_mm : mapping of str to float
        The recordings and their true sizes.
    counts : mapping of float to float
        Mean number of recordings of each size that teach.
    confidence : float
        Level of the intervals.
    """
    rows = []
    for first, last in size_ranges(sizes_mm.values()):
        names = [name for name, size in sizes_mm.items() if first <= size <= last]
        each = np.array([right[name] for name in names])
        later = np.array([np.nan if after is None else after[name] for name in names])
        known = each[~np.isnan(each)]
        row = {"taught": round(sum(counts.values()), 6), "taught_healthy": counts.get(0.0, 0.0)}
        row |= {"size_from_mm": first, "size_to_mm": last, "judged": known.size}
        row["taught_of_size"] = sum(n for size, n in counts.items() if first <= size <= last)
        row |= rate_columns("rate", float(known.sum()), known.size, confidence)
        rows.append(row | interval_columns("gain", mean_gain(each, later, confidence)))
    return rows


def taught_counts(splits: Sequence[Split], sizes_mm: Mapping[str, float]) -> dict[float, float]:
    """Return how many recordings of each size teach, on average over the splits."""
    times = Counter(sizes_mm[name] for split in splits for name in split.taught)
    return {size_mm: times[size_mm] / len(splits) for size_mm in sorted(set(sizes_mm.values()))}


def _counts_without_one(sizes_mm: Mapping[str, float]) -> dict[float, float]:
    """Return the same as `taught_counts`, for leave-one-out."""
    counts = Counter(sizes_mm.values())
    return {size_mm: count * (1 - 1 / len(sizes_mm)) for size_mm, count in counts.items()}
