"""The learning curve: the rates that a part of an archive reaches, to see if more would help.

The archive is divided at random into four parts, with each size spread evenly. One, two or three
parts teach, and the rest is judged. A small archive is divided several times, and every part takes
its turn. A large archive needs fewer turns to judge as many recordings, which limits the work. The
last point is leave-one-out, where all recordings except one or a few teach.
"""

from collections.abc import Iterable, Mapping, Sequence
from math import sqrt
from statistics import NormalDist

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.training import Detector, TrainingArchive
from capsule.evaluation.folds import LEAVE_ONE_OUT
from capsule.evaluation.learning_splits import Split, counts_in_folds, draw_splits, taught_counts
from capsule.evaluation.rates import interval_columns, rate_columns
from capsule.kinds import Cells, Row, Spread

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
    "rate",
    "rate_low",
    "rate_high",
    "gain",
    "gain_low",
    "gain_high",
]


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
    detectors: Mapping[str, Detector],
    archive: TrainingArchive,
    predictions: Iterable[Row],
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
    spread : callable
        As in `capsule.evaluation.predictions.by_folds`.

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
    counts_alone = counts_in_folds(sizes_mm, rules["most_folds"])
    points_of = [(name, share) for name in detectors for share in by_share]

    def right_at(point: tuple[str, float]) -> dict[str, float]:
        name, share = point
        return mean_right(detectors[name], archive, by_share[share])

    right = dict(zip(points_of, spread(right_at, points_of), strict=True))
    rows = []
    for name in detectors:
        last = alone.get(name)
        points = [
            (share, len(each), right[name, share], last, taught_counts(each, sizes_mm))
            for share, each in by_share.items()
        ]
        if last is not None:
            points.append((ALL_BUT_ONE, len(last), last, None, counts_alone))
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
