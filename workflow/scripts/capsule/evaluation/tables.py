"""The tables that rate the detectors, with detector and scheme in each row."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.detectors.registry import detector_row
from capsule.evaluation import agreement, reliability, roc, size_error
from capsule.evaluation.prevalence import predictive_values
from capsule.evaluation.rates import interval_columns, is_within, rate, rate_columns
from capsule.evaluation.sites import Passes, detections_by_passes
from capsule.kinds import Cells
from capsule.seeding import generator

ALWAYS = "always_nodule"
ANY = None  # In place of a size, this stands for any nodule.
_GRID = np.linspace(0.0, 1.0, 21)


@dataclass(frozen=True)
class Verdicts:
    """The verdicts of one detector under one scheme on R recordings; NaN is unknown.

    Attributes
    ----------
    key : dict of str to str
        ``detector`` and ``scheme``.
    recordings : tuple of str
    size_mm, predicted_mm, score, probability, estimate_mm, location_mm : (R,) array
    """

    key: Cells
    recordings: tuple[str, ...]
    size_mm: FloatArray
    predicted_mm: FloatArray
    score: FloatArray
    probability: FloatArray
    estimate_mm: FloatArray
    location_mm: FloatArray

    @property
    def detected(self) -> BoolArray:
        """Return in which recordings a nodule is detected, (R,) of bool."""
        return self.predicted_mm > 0

    def of(self, size_mm: float | None) -> BoolArray:
        """Return which recordings were made over a nodule of this size, or over any nodule."""
        return self.size_mm > 0 if size_mm is ANY else self.size_mm == size_mm

    def nodule_sizes(self) -> list[float]:
        """Return the sizes of the nodules, ascending."""
        return sorted({float(size) for size in self.size_mm if size > 0})


def collect(rows: Sequence[Mapping[str, str]]) -> list[Verdicts]:
    """Return predictions grouped by detector and scheme, without those that have no verdict."""
    numbers = [name for name in Verdicts.__annotations__ if name not in ("key", "recordings")]
    groups: dict[tuple[str, str], list[Mapping[str, str]]] = {}
    for row in rows:
        if row["predicted_mm"]:
            groups.setdefault((row["detector"], row["scheme"]), []).append(row)
    return [
        Verdicts(
            {"detector": detector, "scheme": scheme},
            tuple(row["recording"] for row in group),
            **{name: np.array([float(row[name] or "nan") for row in group]) for name in numbers},
        )
        for (detector, scheme), group in groups.items()
    ]


def summary(of_scheme: Sequence[Verdicts], tolerance_mm: float, confidence: float) -> list[Cells]:
    """Return each detector's rates over all recordings, and those of always predicting a nodule.

    The interval of the balanced accuracy is computed from the intervals of sensitivity and
    specificity (Zou and Donner 2008). A missed nodule has no size, so it is neither exact nor
    within the tolerance.
    """
    key, nodule = of_scheme[0].key, of_scheme[0].of(ANY)
    judged: list[tuple[Cells, BoolArray, BoolArray, Verdicts | None]] = [
        (each.key, each.of(ANY), each.detected, each) for each in of_scheme
    ]
    everything = np.ones(nodule.size, dtype=bool)
    judged.append((key | {"detector": ALWAYS}, nodule, everything, None))
    rows = []
    for label, truth, detected, verdicts in judged:
        hits, quiet = int(np.sum(detected & truth)), int(np.sum(~detected & ~truth))
        sensitivity = rate(hits, int(truth.sum()), confidence)
        specificity = rate(quiet, int((~truth).sum()), confidence)
        row = label | {"recordings": truth.size}
        row |= rate_columns("accuracy", hits + quiet, truth.size, confidence)
        row |= interval_columns("sensitivity", sensitivity)
        row |= interval_columns("specificity", specificity)
        row |= interval_columns("balanced_accuracy", _mean_of(sensitivity, specificity))
        for name, allowed_mm in (("exact_rate", 0.0), ("within_rate", tolerance_mm)):
            values = (float("nan"),) * 3
            if verdicts is not None:
                right = _right_size(verdicts, allowed_mm)[truth]
                values = rate(int(right.sum()), right.size, confidence)
            row |= interval_columns(name, values)
        rows.append(row)
    return rows


def _mean_of(first: Sequence[float], second: Sequence[float]) -> tuple[float, float, float]:
    """Return the mean of two independent estimates, with its interval."""
    value = (first[0] + second[0]) / 2
    reach = [np.hypot(first[0] - first[end], second[0] - second[end]) / 2 for end in (1, 2)]
    return value, float(max(value - reach[0], 0.0)), float(min(value + reach[1], 1.0))


def curves(
    verdicts: Verdicts, seed: int, repeats: int, confidence: float
) -> tuple[list[Cells], list[Cells]]:
    """Return the areas under the ROC curves, and the curves, for any nodule and for each size."""
    areas, points = [], []
    known = ~np.isnan(verdicts.score)
    healthy = verdicts.score[known & (verdicts.size_mm == 0)]
    for size_mm in (ANY, *verdicts.nodule_sizes()):
        nodule = verdicts.score[known & verdicts.of(size_mm)]
        if healthy.size == 0 or nodule.size == 0:
            continue
        numbers = generator(seed, "roc", *verdicts.key.values(), str(size_mm))
        area, low, high = roc.bootstrap(healthy, nodule, _GRID, numbers, repeats, confidence)
        label = verdicts.key | {"size_mm": size_mm}
        areas.append(label | interval_columns("auc", (roc.auc(healthy, nodule), *area)))
        heights = roc.height_at(healthy, nodule, _GRID)
        for index, bounds in enumerate(zip(heights, low, high, strict=True)):
            point = {"false_positive_rate": round(float(_GRID[index]), 10)}
            points.append(
                label | point | interval_columns("true_positive_rate", list(map(float, bounds)))
            )
    return areas, points


def predictive(verdicts: Verdicts, prevalence: float, confidence: float) -> list[Cells]:
    """Return the predictive values at a stated prevalence, for any nodule and for each size."""
    healthy = verdicts.size_mm == 0
    quiet = int(np.sum(healthy & ~verdicts.detected))
    rows = []
    for size_mm in (ANY, *verdicts.nodule_sizes()):
        of_size = verdicts.of(size_mm)
        hits, count = int(np.sum(of_size & verdicts.detected)), int(of_size.sum())
        row = verdicts.key | {"size_mm": size_mm, "prevalence": prevalence}
        row |= rate_columns("sensitivity", hits, count, confidence)
        rows.append(
            row | predictive_values(hits, count, quiet, int(healthy.sum()), prevalence, confidence)
        )
    return rows


def calibrated(
    verdicts: Verdicts, prevalence: float, bins: int, confidence: float
) -> tuple[list[Cells], list[Cells]]:
    """Return calibration and Brier score of a detector that states probabilities."""
    known = ~np.isnan(verdicts.probability)
    if not known.any():
        return [], []
    probability, nodule = verdicts.probability[known], verdicts.of(ANY)[known]
    table = reliability.calibration_table(probability, nodule, prevalence, bins, confidence)
    uninformed = np.full(nodule.size, prevalence)
    score = {
        "recordings": nodule.size,
        "prevalence": prevalence,
        "brier": reliability.brier_score(probability, nodule, prevalence),
        "brier_uninformed": reliability.brier_score(uninformed, nodule, prevalence),
    }
    return [verdicts.key | row for row in table], [verdicts.key | score]


def size_errors(verdicts: Verdicts, confidence: float) -> list[Cells]:
    """Return bias and absolute error of the estimated size, for any nodule and for each size."""
    return [
        verdicts.key
        | {"size_mm": size_mm}
        | size_error.size_error_row(
            verdicts.size_mm[verdicts.of(size_mm)],
            verdicts.estimate_mm[verdicts.of(size_mm)],
            confidence,
        )
        for size_mm in (ANY, *verdicts.nodule_sizes())
    ]


def localisation(
    verdicts: Verdicts, nodule_at_mm: Mapping[str, float], confidence: float
) -> list[Cells]:
    """Return the error of the location, for recordings whose header has the nodule's position."""
    truth = np.array([nodule_at_mm.get(name, np.nan) for name in verdicts.recordings])
    error = np.where(verdicts.detected, verdicts.location_mm - truth, np.nan)
    rows = []
    for size_mm in (ANY, *verdicts.nodule_sizes()):
        known = error[verdicts.of(size_mm)]
        known = known[~np.isnan(known)]
        if known.size:
            row = verdicts.key | {"size_mm": size_mm, "recordings": known.size}
            median = size_error.median_interval(np.abs(known), confidence)
            row |= interval_columns("median_absolute_error_mm", median)
            bias = size_error.mean_interval(known, confidence)
            rows.append(row | interval_columns("bias_mm", bias))
    return rows


def comparisons(
    of_scheme: Sequence[Verdicts], tolerance_mm: float, confidence: float
) -> list[Cells]:
    """Return the comparison of every two detectors on the same recordings, for each measure."""
    rows = []
    for first, second in combinations(of_scheme, 2):
        both = sorted(set(first.recordings) & set(second.recordings))
        pick = [_rows_of(verdicts, both) for verdicts in (first, second)]
        truth = first.size_mm[pick[0]]
        for measure in ("detection", "size_within_tolerance"):
            right = [
                _right(v, measure, tolerance_mm)[chosen]
                for v, chosen in zip((first, second), pick, strict=True)
            ]
            healthy = [0.0] if measure == "detection" else []
            for size_mm in (ANY, *healthy, *first.nodule_sizes()):
                chosen = truth > 0 if size_mm is ANY else truth == size_mm
                row: Cells = {"scheme": first.key["scheme"], "first": first.key["detector"]}
                row |= {"second": second.key["detector"], "measure": measure, "size_mm": size_mm}
                row["recordings"] = int(chosen.sum())
                difference = agreement.paired_difference(
                    right[0][chosen], right[1][chosen], confidence
                )
                rows.append(row | difference)
    return rows


def _rows_of(verdicts: Verdicts, names: Sequence[str]) -> list[int]:
    """Return the rows of some recordings."""
    row_of = {name: row for row, name in enumerate(verdicts.recordings)}
    return [row_of[name] for name in names]


def _right(verdicts: Verdicts, measure: str, tolerance_mm: float) -> BoolArray:
    if measure == "detection":
        right: BoolArray = verdicts.detected == verdicts.of(ANY)
        return right
    return _right_size(verdicts, tolerance_mm)


def _right_size(verdicts: Verdicts, tolerance_mm: float) -> BoolArray:
    return np.asarray(is_within(verdicts.predicted_mm, verdicts.size_mm, tolerance_mm))


def permutation(verdicts: Verdicts, seed: int, repeats: int, confidence: float) -> list[Cells]:
    """Return the area under the curve, and its distribution for randomly permuted labels."""
    known = ~np.isnan(verdicts.score)
    score, nodule = verdicts.score[known], verdicts.of(ANY)[known]
    if nodule.all() or not nodule.any():
        return []
    observed = roc.auc(score[~nodule], score[nodule])
    numbers = generator(seed, "permutation", *verdicts.key.values())
    chance = agreement.permuted_areas(score, nodule, numbers, repeats)
    low, high = np.quantile(chance, [(1 - confidence) / 2, (1 + confidence) / 2])
    row = verdicts.key | {"auc": observed, "by_chance": float(chance.mean())}
    row |= {"by_chance_low": float(low), "by_chance_high": float(high)}
    return [row | {"p": agreement.exceedance(observed, chance)}]


def retests(
    verdicts: Verdicts,
    sites: Mapping[str, str],
    counts: Sequence[int],
    specificity: float,
    confidence: float,
) -> list[Cells]:
    """Return the rates of detection if several passes over a site are judged together."""
    named = [sites.get(name) or f"\n{name}" for name in verdicts.recordings]
    places: dict[str, list[int]] = {}
    for place, site in enumerate(named):
        places.setdefault(site, []).append(place)
    passes = {
        site: Passes(
            float(verdicts.size_mm[each[0]]),
            verdicts.score[each],
            verdicts.estimate_mm[each],
            verdicts.location_mm[each],
            # The intervals of the size are not needed, only whether a nodule is detected.
            *[np.full(len(each), np.nan)] * 2,
        )
        for site, each in places.items()
    }
    fixed = detector_row(verdicts.key["detector"]).fixed_threshold
    rows = []
    for count in counts:
        true_mm, detected = detections_by_passes(passes, count, specificity, fixed)
        for size_mm in sorted(set(true_mm.tolist())):
            of_size = true_mm == size_mm
            hits = int(np.sum(of_size & detected))
            row = verdicts.key | {"passes": count, "size_mm": size_mm, "sites": int(of_size.sum())}
            rows.append(row | rate_columns("detected", hits, row["sites"], confidence))
    return rows
