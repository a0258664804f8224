"""The learning curve: the rates that a part of an archive reaches, to see if more would help.

The places of the archive are dealt at random into four parts, with each size spread evenly. One,
two or three parts teach, and the rest is judged: no place, and no near copy, is on both sides. A
small archive is divided several times, and every part takes its turn. A large archive needs fewer
turns to judge as many recordings, which limits the work. The last point is leave-one-out, where all
recordings except those of one place or of a few teach.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from math import ceil
from typing import NamedTuple

import numpy as np
import pandas as pd

from capsule.detectors.training import Detector, TrainingArchive
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT, Fold, grouped
from capsule.evaluation.intervals import gain_interval, rate_of
from capsule.evaluation.rates import interval_columns
from capsule.kinds import Cells, Row, Spread
from capsule.seeding import generator

PARTS = 4
# Wanted number of recordings times splits at each share, and the largest number of splits.
_DRAWN, _MOST_SPLITS = 960, 40
# The share that stands for leave-one-out.
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
    "clusters",
    "rate",
    "rate_low",
    "rate_high",
    "gain",
    "gain_low",
    "gain_high",
]


class Split(NamedTuple):
    """The names of the recordings that teach, and of those that are judged: the whole archive."""

    taught: tuple[str, ...]
    judged: tuple[str, ...]


def deal(
    sizes_mm: Mapping[str, float], numbers: np.random.Generator, places: Mapping[str, str]
) -> list[list[str]]:
    """Return the recordings in four parts, with each size spread as evenly as possible.

    Parameters
    ----------
    sizes_mm : mapping of str to float
        The recordings and their true sizes, in an order that does not depend on names.
    numbers : Generator
        Source of the random numbers that shuffle the places of each size.
    places : mapping of str to str
        The place of each recording. All recordings of a place come into one part.
    """
    members = grouped(sizes_mm, places)
    shuffled: list[list[str]] = []
    for size_mm in sorted(set(sizes_mm.values())):
        # A place with several labels is dealt with its smallest size.
        of_size = [m for m in members.values() if min(sizes_mm[name] for name in m) == size_mm]
        shuffled += [of_size[place] for place in numbers.permutation(len(of_size))]
    return [list(chain(*shuffled[part::PARTS])) for part in range(PARTS)]


def draw_splits(
    sizes_mm: Mapping[str, float], seed: int, places: Mapping[str, str]
) -> dict[float, list[Split]]:
    """Draw the splits at a quarter, a half and three quarters of an archive.

    Parameters
    ----------
    sizes_mm : mapping of str to float
        The recordings and their true sizes, as in `deal`.
    seed : int
        The configured seed.
    places : mapping of str to str
        The place of each recording, as in `deal`.

    Returns
    -------
    dict of float to list of Split
        The splits by the share of the archive that teaches; empty if there is no recording.
    """
    if not sizes_mm:
        return {}
    wanted = min(ceil(_DRAWN / len(sizes_mm)), _MOST_SPLITS)
    deals, turns = ceil(wanted / PARTS), range(0, PARTS, PARTS // min(wanted, PARTS))
    dealt = [
        deal(sizes_mm, generator(seed, "learning", str(each)), places) for each in range(deals)
    ]
    turned = [parts[first:] + parts[:first] for parts in dealt for first in turns]
    return {
        count / PARTS: [
            Split(tuple(chain(*parts[:count])), tuple(chain(*parts[count:]))) for parts in turned
        ]
        for count in range(1, PARTS)
    }


def taught_counts(splits: Sequence[Split], sizes_mm: Mapping[str, float]) -> dict[float, float]:
    """Return how many recordings of each size teach, on average over the splits."""
    times = Counter(sizes_mm[name] for split in splits for name in split.taught)
    return {size_mm: times[size_mm] / len(splits) for size_mm in sorted(set(sizes_mm.values()))}


def counts_in_folds(folds: Sequence[Fold], sizes_mm: Mapping[str, float]) -> dict[float, float]:
    """Return how many recordings of each size teach, on average over the judged recordings.

    Parameters
    ----------
    folds : sequence of Fold
        The folds of one scheme.
    sizes_mm : mapping of str to float
        The recordings that may teach, and their true sizes.
    """
    counts, judged = Counter(sizes_mm.values()), sum(len(fold.judged) for fold in folds)
    left_out: Counter[float] = Counter()
    for fold in folds:
        for name in fold.left_out & sizes_mm.keys():
            left_out[sizes_mm[name]] += len(fold.judged)
    return {size: count - left_out[size] / judged for size, count in counts.items()}


def mean_right(
    detector: Detector, archive: TrainingArchive, splits: Sequence[Split], apart: Sequence[str] = ()
) -> dict[str, float]:
    """Teach a detector with each split, and return how often each recording is judged correctly.

    Recordings that stand apart, those of held-out sessions, teach nothing.

    Returns
    -------
    dict of str to float
        Share of correct verdicts of each recording. No verdict is not a correct one. A split that
        teaches too little for any verdict does not count; NaN if no split counts.
    """
    verdicts: dict[str, list[float]] = {}
    for split in splits:
        model = detector.without([*split.judged, *apart])
        predicted_mm = {
            name: model.verdict(archive.recording(name)).predicted_mm for name in split.judged
        }
        taught_enough = not all(map(np.isnan, predicted_mm.values()))
        for name, predicted in predicted_mm.items():
            rights = verdicts.setdefault(name, [])
            if taught_enough:
                rights.append(is_right(archive.sizes_mm[name], predicted))
    return {
        name: sum(each) / len(each) if each else float("nan") for name, each in verdicts.items()
    }


def is_right(true_mm: float, predicted_mm: float) -> float:
    """Return 1 for a correct verdict (nodule or none), 0 for a wrong one and for no verdict."""
    return float(predicted_mm > 0 if true_mm > 0 else predicted_mm == 0)


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


def learning_rows(
    detectors: Mapping[str, Detector],
    archive: TrainingArchive,
    predictions: Iterable[Row],
    folds: Sequence[Fold],
    spread: Spread = map,
) -> list[Cells]:
    """Return the rates of each detector for each number of recordings that teach it.

    Parameters
    ----------
    detectors : mapping of str to Detector
        The detectors, taught by the archive.
    archive : TrainingArchive
        The archive whose labelled recordings teach and are judged. The section ``evaluation`` of
        its settings holds seed, confidence and the largest number of folds.
    predictions : iterable of mapping
        Rows with ``detector``, ``scheme``, ``recording`` and ``predicted_mm``; those of
        leave-one-out give the last point.
    folds : sequence of Fold
        The folds of the evaluation. They tell which recordings are held out.
    spread : callable
        As in `capsule.evaluation.cross_validation.cross_validate`.

    Returns
    -------
    list of dict
        One row for each detector, share and range of sizes, with the columns `COLUMNS`.
        ``taught``, ``taught_healthy`` and ``taught_of_size`` are means over the splits. ``rate`` is
        the specificity if both sizes are 0, otherwise the sensitivity; its Wilson interval counts
        each recording once, over places. ``gain`` is the rate of leave-one-out minus this rate
        (`capsule.evaluation.intervals.gain_interval`).
    """
    rules = archive.settings["evaluation"]
    apart = [name for fold in folds if fold.scheme == HELD_OUT for name in fold.judged]
    sizes_mm = {name: size for name, size in archive.sizes_mm.items() if name not in set(apart)}
    places = {name: archive.places.get(name, name) for name in sizes_mm}
    by_share = draw_splits(sizes_mm, rules["seed"], places)
    recordings = pd.DataFrame({"size_mm": pd.Series(sizes_mm, dtype=float)})
    recordings["place"] = pd.factorize(pd.Series(places))[0]
    alone = _left_out_alone(predictions, sizes_mm)
    alone_folds = [fold for fold in folds if fold.scheme == LEAVE_ONE_OUT]
    points_of = [(name, share) for name in detectors for share in by_share]

    def right_at(point: tuple[str, float]) -> dict[str, float]:
        name, share = point
        return mean_right(detectors[name], archive, by_share[share], apart)

    right = dict(zip(points_of, spread(right_at, points_of), strict=True))
    rows = []
    for name in detectors:
        last = alone.get(name)
        points = [
            (share, len(each), right[name, share], last or {}, taught_counts(each, sizes_mm))
            for share, each in by_share.items()
        ]
        if last is not None:
            counts_alone = counts_in_folds(alone_folds, sizes_mm)
            points.append((ALL_BUT_ONE, len(last), last, {}, counts_alone))
        for share, splits, of_share, after, counts in points:
            key = {"detector": name, "share": share, "splits": splits}
            made = _rate_rows(of_share, after, recordings, counts, rules["confidence"])
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


def _rate_rows(
    right: Mapping[str, float],
    after: Mapping[str, float],
    recordings: pd.DataFrame,
    counts: Mapping[float, float],
    confidence: float,
) -> Iterator[Cells]:
    """Yield the rates at one share for each range of sizes; `after` is under leave-one-out."""
    # In a large archive not every recording is judged at every share.
    rated = recordings.assign(right=pd.Series(right), after=pd.Series(after, dtype=float))
    for first, last in size_ranges(rated["size_mm"]):
        of_range = rated[rated["size_mm"].between(first, last)]
        clusters, each, later = (of_range[name].to_numpy() for name in ("place", "right", "after"))
        known = ~np.isnan(each)
        yield {
            "taught": round(sum(counts.values()), 6),
            "taught_healthy": counts.get(0.0, 0.0),
            "size_from_mm": first,
            "size_to_mm": last,
            "taught_of_size": sum(n for size, n in counts.items() if first <= size <= last),
            "judged": int(known.sum()),
            "clusters": np.unique(clusters[known]).size,
            **interval_columns(rate=rate_of(each[known], clusters[known], confidence)),
            **interval_columns(gain=gain_interval(each, later, confidence, clusters)),
        }
