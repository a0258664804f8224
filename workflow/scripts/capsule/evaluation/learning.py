"""The learning curve: the rates that a part of an archive reaches, to see if more would help.

The places of the archive are dealt at random into four parts, with each size spread evenly. One,
two or three parts teach, and the rest is judged: no place, and no near copy, is on both sides. A
small archive is divided several times, and every part takes its turn. A large archive needs fewer
turns to judge as many recordings, which limits the work. The last point is leave-one-out, where all
recordings except those of one place or of a few teach.

The true sizes of the recordings come in an order that does not depend on names. A split is the list
of the recordings that it judges; all others teach.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from math import ceil

import numpy as np
import pandas as pd

from capsule.arrays import RecordArray
from capsule.detectors.base import Detector, TrainingArchive
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT, Fold, grouped
from capsule.evaluation.intervals import gain_interval
from capsule.evaluation.rates import cells_over, is_right, rate_over, units_of
from capsule.kinds import Cells
from capsule.seeding import generator

PARTS = 4
# Wanted number of recordings times splits at each share, and the largest number of splits.
_DRAWN, _MOST_SPLITS = 960, 40
# The share that stands for leave-one-out.
ALL_BUT_ONE = 1.0
COLUMNS = [
    *("detector", "share", "splits", "taught", "taught_healthy"),
    *("size_from_mm", "size_to_mm", "taught_of_size", "judged", "clusters"),
    *("rate", "rate_low", "rate_high", "gain", "gain_low", "gain_high"),
]


def deal(
    sizes_mm: Mapping[str, float], numbers: np.random.Generator, places: Mapping[str, str]
) -> list[list[str]]:
    """Return the recordings in four parts, with each size spread as evenly as possible.

    The random numbers shuffle the places of each size. All recordings of a place come into one
    part.
    """
    members = grouped(sizes_mm, places).values()
    shuffled: list[list[str]] = []
    for size_mm in sorted(set(sizes_mm.values())):
        # A place with several labels is dealt with its smallest size.
        of_size = [each for each in members if min(sizes_mm[name] for name in each) == size_mm]
        shuffled += [of_size[place] for place in numbers.permutation(len(of_size))]
    return [list(chain(*shuffled[part::PARTS])) for part in range(PARTS)]


def draw_splits(
    sizes_mm: Mapping[str, float], seed: int, places: Mapping[str, str]
) -> dict[float, list[list[str]]]:
    """Draw the splits at a quarter, a half and three quarters of an archive, by this share.

    There is no share if there is no recording.
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
        count / PARTS: [list(chain(*parts[count:])) for parts in turned]
        for count in range(1, PARTS)
    }


def mean_taught(
    left_out: Collection[tuple[Collection[str], int]], sizes_mm: Mapping[str, float]
) -> dict[float, float]:
    """Return how many recordings of each size teach, as a weighted mean.

    What is left out stands in pairs of its names, which may be of other recordings too, and the
    weight.
    """
    left, total = Counter[float](), sum(weight for _, weight in left_out)
    for names, weight in left_out:
        for name in sizes_mm.keys() & names:
            left[sizes_mm[name]] += weight
    counts = Counter(sizes_mm.values())
    return {size: count - left[size] / total for size, count in counts.items()}


def mean_right(
    detector: type[Detector],
    archive: TrainingArchive,
    splits: Sequence[Sequence[str]],
    apart: Sequence[str] = (),
) -> pd.Series:
    """Teach a detector with each split, and return how often each recording is judged correctly.

    Recordings that stand apart, those of held-out sessions, teach nothing. No verdict is not a
    correct one. A split that teaches too little for any verdict does not count. The share of
    correct verdicts is NaN if no split counts.
    """
    rights = []
    for judged in splits:
        model = detector.taught(archive, [*judged, *apart])
        verdicts = [model.verdict(archive.recordings[name]).predicted_mm for name in judged]
        if not np.isnan(verdicts).all():
            rights.append(_right(pd.Series(verdicts, judged), archive.sizes_mm))
    return pd.DataFrame(rights, columns=list(archive.sizes_mm), dtype=float).mean()


def _right(predicted_mm: pd.Series, sizes_mm: Mapping[str, float]) -> pd.Series:
    """Return 1 for each recording with a correct verdict (nodule or none), 0 for the others."""
    true_mm = np.array([sizes_mm[name] for name in predicted_mm.index], dtype=np.float64)
    return pd.Series(is_right(predicted_mm.to_numpy(), true_mm), predicted_mm.index, dtype=float)


def size_ranges(sizes_mm: Iterable[float]) -> list[tuple[float, float]]:
    """Return the ranges that have rates: no nodule, each size, and all except the smallest size."""
    sizes = sorted(set(sizes_mm))
    wide = [(first, last) for first, last in main_ranges(sizes) if first < last]
    return [(size, size) for size in sizes] + wide


def main_ranges(sizes_mm: Iterable[float]) -> list[tuple[float, float]]:
    """Return the most informative ranges: no nodule, the smallest size, and all larger sizes."""
    sizes = sorted(set(sizes_mm))
    healthy, nodules = ([size for size in sizes if (size > 0) == kind] for kind in (False, True))
    ranges = [(size, size) for size in healthy + nodules[:1]]
    return [*ranges, (nodules[1], nodules[-1])] if len(nodules) > 1 else ranges


def learning_rows(
    detectors: Mapping[str, type[Detector]],
    archive: TrainingArchive,
    predictions: pd.DataFrame,
    folds: Sequence[Fold],
) -> list[Cells]:
    """Return the rates of each detector for each number of recordings that teach it.

    There is one row for each detector, share and range of sizes, with the columns `COLUMNS`.
    ``taught``, ``taught_healthy`` and ``taught_of_size`` are means over the splits. ``rate`` is the
    specificity if both sizes are 0, otherwise the sensitivity; its Wilson interval counts each
    recording once, over places. ``gain`` is the rate of leave-one-out minus this rate
    (`capsule.evaluation.intervals.gain_interval`).

    The archive teaches the detectors. The rows of leave-one-out among the predictions give the last
    point. Folds are as in `capsule.evaluation.cross_validation.cross_validate`.
    """
    rules = archive.settings["evaluation"]
    apart = [name for fold in folds if fold.scheme == HELD_OUT for name in fold.judged]
    sizes_mm = {name: size for name, size in archive.sizes_mm.items() if name not in set(apart)}
    places = {name: archive.places.get(name, name) for name in sizes_mm}
    by_share = draw_splits(sizes_mm, rules["seed"], places)
    taught = {
        share: mean_taught([(judged, 1) for judged in splits], sizes_mm)
        for share, splits in by_share.items()
    }
    right = {
        (name, share): mean_right(detector, archive, splits, apart)
        for name, detector in detectors.items()
        for share, splits in by_share.items()
    }
    alone = predictions[predictions["scheme"] == LEAVE_ONE_OUT].set_index("recording")
    alone = alone[alone.index.isin([*sizes_mm])]
    if len(alone):
        of_scheme = [fold for fold in folds if fold.scheme == LEAVE_ONE_OUT]
        counted = [(fold.left_out, len(fold.judged)) for fold in of_scheme]
        taught[ALL_BUT_ONE] = mean_taught(counted, sizes_mm)
    recordings = pd.DataFrame({"size_mm": pd.Series(sizes_mm, dtype=float), "setup": -1})
    recordings["place"] = pd.factorize(pd.Series(places))[0]
    passes = recordings.groupby(["place", "size_mm"])["place"].transform("size")
    recordings["weight"] = 1.0 / passes
    rows = []
    for name in detectors:
        last = _right(alone.loc[alone["detector"] == name, "predicted_mm"], sizes_mm)
        for share, counts in taught.items():
            # The last point has nothing to gain.
            after = last if share < ALL_BUT_ONE else np.nan
            rated = recordings.assign(right=right.get((name, share), last), after=after)
            records = np.asarray(rated.to_records(index=False))
            key = {"detector": name, "share": share, "splits": len(by_share.get(share, last))}
            rows += [key | row for row in _rate_rows(records, counts, rules["confidence"])]
    return rows


def _rate_rows(
    rated: RecordArray, counts: Mapping[float, float], confidence: float
) -> Iterator[Cells]:
    """Yield the rates at one share for each range of sizes; `after` is under leave-one-out."""
    for first, last in size_ranges(rated["size_mm"]):
        of_range = rated[(rated["size_mm"] >= first) & (rated["size_mm"] <= last)]
        # In a large archive not every recording is judged at every share.
        known = of_range[~np.isnan(of_range["right"])]
        right, after = of_range["right"], of_range["after"]
        yield cells_over(
            known,
            taught=round(sum(counts.values()), 6),
            taught_healthy=counts.get(0.0, 0.0),
            size_from_mm=first,
            size_to_mm=last,
            taught_of_size=sum(n for size, n in counts.items() if first <= size <= last),
            judged=len(known),
            rate=rate_over(known, confidence),
            gain=gain_interval(right, after, units_of(of_range), confidence),
        )
