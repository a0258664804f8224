"""The rates of correct verdicts, as the paper defines them, with intervals."""

import math
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.kinds import Cells, Row

_RATES = {
    name: [name, f"{name}_low", f"{name}_high"]
    for name in ("precision", "recall", "specificity", "exact_rate", "within_rate")
}
_KEY = ["detector", "scheme"]
# The columns of every table; a table without rows has them too.
COLUMNS = {
    "detection": [*_KEY, "size_mm", "tp", "fp", "fn", *_RATES["precision"], *_RATES["recall"]],
    "specificity": [*_KEY, "healthy", "true_negatives", *_RATES["specificity"]],
    "sizing": [
        *_KEY,
        "size_mm",
        "recordings",
        "exact",
        *_RATES["exact_rate"],
        "within",
        *_RATES["within_rate"],
        "one_sided",
        "mean_absolute_error_mm",
    ],
    "confusion": [*_KEY, "size_mm", "predicted_mm", "count"],
}


def rate(hits: float, count: int, confidence: float) -> tuple[float, float, float]:
    """Return a rate and its Wilson interval.

    Parameters
    ----------
    hits, count : float, int
        How many of how many. Hits that are means of several verdicts need not be whole numbers.
    confidence : float
        Level of the interval, such as 0.95.

    Returns
    -------
    value, low, high : float
        All NaN if the count is 0.
    """
    if count == 0:
        return float("nan"), float("nan"), float("nan")
    share = hits / count
    z = NormalDist().inv_cdf(0.5 + confidence / 2)
    centre = share + z**2 / (2 * count)
    reach = z * math.sqrt(share * (1 - share) / count + (z / (2 * count)) ** 2)
    scale = 1 + z**2 / count
    # If all or none are hits, the interval ends exactly there; rounding would move it.
    low = 0.0 if hits == 0 else (centre - reach) / scale
    high = 1.0 if hits == count else (centre + reach) / scale
    return share, min(low, share), max(high, share)


def interval_columns(name: str, values: Sequence[float]) -> dict[str, float]:
    """Return a value and its interval's ends as ``name``, ``name_low`` and ``name_high``."""
    return dict(zip((name, f"{name}_low", f"{name}_high"), values, strict=True))


def rate_columns(name: str, hits: float, count: int, confidence: float) -> dict[str, float]:
    """Return a rate and its Wilson interval, named as in `interval_columns`."""
    return interval_columns(name, rate(hits, count, confidence))


def is_within(
    predicted_mm: FloatArray | float, true_mm: FloatArray | float, tolerance_mm: float
) -> BoolArray:
    """Return whether a predicted size is within the tolerance; never true for a missed nodule."""
    # A little more, for rounding: 2.3 mm must lie within 0.2 mm of 2.5 mm.
    near = np.abs(predicted_mm - true_mm) <= tolerance_mm + 1e-9
    return (np.asarray(predicted_mm) > 0) & near


def detection_counts(true_mm: FloatArray, predicted_mm: FloatArray, size_mm: float) -> Cells:
    """Return the numbers of true positives, false positives and false negatives of one size b.

    Only these definitions give the paper's numbers. TP: recordings of size b in which any nodule is
    detected. FN: recordings of size b in which none is detected. FP: recordings without a nodule
    whose predicted size is exactly b.

    Parameters
    ----------
    true_mm, predicted_mm : (R,) array
        Sizes in mm of the recordings, 0 for no nodule.
    size_mm : float
        The size b.

    Returns
    -------
    dict
        ``tp``, ``fp`` and ``fn``.
    """
    of_size, detected = true_mm == size_mm, predicted_mm > 0
    return {
        "tp": int(np.sum(of_size & detected)),
        "fp": int(np.sum((true_mm == 0) & (predicted_mm == size_mm))),
        "fn": int(np.sum(of_size & ~detected)),
    }


def detection_table(
    true_mm: FloatArray, predicted_mm: FloatArray, sizes_mm: Sequence[float], confidence: float
) -> list[Cells]:
    """Return precision and recall of every nodule size, with intervals."""
    rows = []
    for size_mm in sizes_mm:
        counts = detection_counts(true_mm, predicted_mm, size_mm)
        row = {"size_mm": size_mm, **counts}
        positives = counts["tp"] + counts["fp"]
        row |= rate_columns("precision", counts["tp"], positives, confidence)
        row |= rate_columns("recall", counts["tp"], counts["tp"] + counts["fn"], confidence)
        rows.append(row)
    return rows


def specificity_row(true_mm: FloatArray, predicted_mm: FloatArray, confidence: float) -> Cells:
    """Return the share of recordings without a nodule in which none is detected."""
    healthy = true_mm == 0
    negatives = int(np.sum(healthy & (predicted_mm == 0)))
    count = int(np.sum(healthy))
    row = {"healthy": count, "true_negatives": negatives}
    return row | rate_columns("specificity", negatives, count, confidence)


def sizing_table(
    true_mm: FloatArray,
    predicted_mm: FloatArray,
    sizes_mm: Sequence[float],
    tolerance_mm: float,
    confidence: float,
) -> list[Cells]:
    """Return the rates of exact sizes and of sizes within the tolerance, for every nodule size.

    A recording in which no nodule is detected has no size, so it is never within the tolerance. In
    the mean absolute error it counts as 0 mm. ``one_sided`` marks the sizes whose tolerance reaches
    past the largest or the smallest template.

    Parameters
    ----------
    true_mm, predicted_mm : (R,) array
        Sizes in mm of the recordings, 0 for no nodule.
    sizes_mm : sequence of float
        The nodule sizes that have templates.
    tolerance_mm : float
        Allowed error of the size in mm.
    confidence : float
        Level of the intervals.

    Returns
    -------
    list of dict
        One row for each size.
    """
    rows = []
    for size_mm in sizes_mm:
        predicted = predicted_mm[true_mm == size_mm]
        count = predicted.size
        error = np.abs(predicted - size_mm)
        within = is_within(predicted, size_mm, tolerance_mm)
        row = {"size_mm": size_mm, "recordings": count, "exact": int(np.sum(error == 0))}
        row |= rate_columns("exact_rate", row["exact"], count, confidence)
        row["within"] = int(np.sum(within))
        row |= rate_columns("within_rate", row["within"], count, confidence)
        row["one_sided"] = bool(
            size_mm + tolerance_mm > max(sizes_mm) or size_mm - tolerance_mm < min(sizes_mm)
        )
        row["mean_absolute_error_mm"] = float(np.mean(error)) if count else float("nan")
        rows.append(row)
    return rows


def confusion_table(
    true_mm: FloatArray, predicted_mm: FloatArray, sizes_mm: Sequence[float]
) -> list[Cells]:
    """Return the counts of each predicted size for each true size, including no nodule."""
    return [
        {
            "size_mm": actual,
            "predicted_mm": predicted,
            "count": int(np.sum((true_mm == actual) & (predicted_mm == predicted))),
        }
        for actual in sizes_mm
        for predicted in sizes_mm
    ]


def tables(
    predictions: Sequence[Row],
    sizes_mm: Sequence[float],
    *,
    schemes: Sequence[str],
    tolerance_mm: float,
    confidence: float,
) -> dict[str, list[Cells]]:
    """Return every table of rates, with detector and scheme in each row.

    Parameters
    ----------
    predictions : sequence of mapping
        Rows with ``detector``, ``scheme``, ``size_mm`` and ``predicted_mm``; rows without a verdict
        (NaN) are left out.
    sizes_mm : sequence of float
        Sizes that have a template, including 0.
    schemes : sequence of str
        The schemes, in the order of the rows.
    tolerance_mm : float
        Allowed error of the size in mm.
    confidence : float
        Level of the intervals.

    Returns
    -------
    dict of str to list of dict
        ``detection``, ``specificity``, ``sizing`` and ``confusion``.
    """
    nodules = [size for size in sizes_mm if size > 0]
    result: dict[str, list[Cells]] = {
        "detection": [],
        "specificity": [],
        "sizing": [],
        "confusion": [],
    }
    known = [row for row in predictions if not np.isnan(row["predicted_mm"])]
    detectors = list(dict.fromkeys(row["detector"] for row in known))
    for detector in detectors:
        for scheme in schemes:
            rows = [r for r in known if (r["detector"], r["scheme"]) == (detector, scheme)]
            true_mm = np.array([row["size_mm"] for row in rows], dtype=np.float64)
            predicted_mm = np.array([row["predicted_mm"] for row in rows], dtype=np.float64)
            made = {
                "detection": detection_table(true_mm, predicted_mm, nodules, confidence),
                "specificity": [specificity_row(true_mm, predicted_mm, confidence)],
                "sizing": sizing_table(true_mm, predicted_mm, nodules, tolerance_mm, confidence),
                "confusion": confusion_table(true_mm, predicted_mm, sizes_mm),
            }
            key = {"detector": detector, "scheme": scheme}
            for name, table in made.items():
                result[name] += [key | row for row in table]
    return result
