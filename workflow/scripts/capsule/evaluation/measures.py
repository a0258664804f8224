"""The whole evaluation of an archive, and its tables of measures that rate the detectors."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from itertools import combinations

import numpy as np
import pandas as pd

from capsule.arrays import BoolArray, FloatArray, RecordArray
from capsule.detectors.base import TrainingArchive
from capsule.detectors.registry import detector_class, detector_row
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.cross_validation import (
    LEAVE_ONE_OUT,
    Detectors,
    Rows,
    cross_validate,
    folds_of,
)
from capsule.evaluation.intervals import (
    UNKNOWN,
    Interval,
    Units,
    auc_interval,
    effective_count,
    gain_interval,
    height_at,
    rate,
    ratio_interval,
)
from capsule.evaluation.learning import COLUMNS as LEARNING
from capsule.evaluation.learning import learning_rows
from capsule.evaluation.rates import (
    ANY,
    by_size,
    cells_over,
    cluster_unit,
    confusion,
    detection,
    of_each,
    rate_over,
    sizing,
    units_of,
    with_ends,
    with_value,
)
from capsule.evaluation.sites import detections_by_passes
from capsule.kinds import Cells, Settings
from capsule.recordings.names import sort_key

# The columns of a prediction that the verdict's follow.
KEY = ["recording", "size_mm", "detector", "scheme"]
ALWAYS = "always_nodule"
_GRID = np.linspace(0.0, 1.0, 21)


def evaluate_archive(archive: TrainingArchive, index: Rows) -> dict[str, pd.DataFrame]:
    """Return all tables of the evaluation of an archive, as in results/evaluation/.

    They are ``predictions``, ``learning`` and those of `measure_tables`.

    Parameters
    ----------
    archive : TrainingArchive
        As in `capsule.evaluation.cross_validation.Detectors`.
    index : mapping of str to mapping
        Row in results/recordings.csv of each accepted labelled recording, ordered by content.
    """
    rules, detectors = archive.settings["evaluation"], Detectors(archive)
    folds = folds_of(index, rules)
    rows = cross_validate(detectors, folds)
    predictions = pd.DataFrame(rows, columns=[*KEY, *detectors.columns])
    quick = [name for name in detectors.names if not detector_row(name).by_templates]
    learners = {name: detector_class(name) for name in quick}
    learned = learning_rows(learners, archive, predictions, folds)
    return {
        "predictions": by_name(predictions),
        "learning": pd.DataFrame(learned, columns=LEARNING),
        **measure_tables(predictions, archive.templates.sizes_mm, rules, index),
    }


def by_name(predictions: pd.DataFrame) -> pd.DataFrame:
    """Return predictions sorted by detector (in order of appearance), then by recording."""
    names = sorted(set(predictions["recording"]), key=sort_key)
    turn = predictions["recording"].map({name: number for number, name in enumerate(names)})
    return predictions.iloc[np.lexsort((turn, pd.factorize(predictions["detector"])[0]))]


def measure_tables(
    predictions: pd.DataFrame,
    sizes_mm: Collection[float],
    rules: Settings,
    index: Rows | None = None,
    names: Collection[str] = tuple(COLUMNS),
) -> dict[str, pd.DataFrame]:
    """Return the tables that rate the detectors, with detector and scheme in each row.

    Parameters
    ----------
    predictions, index
        As in `capsule.evaluation.rates.of_each`.
    sizes_mm : collection of float
        Sizes that have a template, including 0, ascending.
    rules : mapping
        Section ``evaluation`` of the configuration, or the keys that the tables need.
    names : collection of str
        The wanted tables, of `COLUMNS`.
    """
    rules = {**rules, "sizes_mm": sizes_mm}
    made: dict[str, list[Cells]] = {name: [] for name in names}
    schemes: dict[str, dict[str, RecordArray]] = {}
    for key, rows in of_each(predictions, rules["tolerance_mm"], index):
        schemes.setdefault(key["scheme"], {})[key["detector"]] = rows
        for name in made.keys() & _OF_ONE.keys():
            made[name] += [key | row for row in _OF_ONE[name](rows, rules)]
    for scheme, of_scheme in schemes.items():
        for name in made.keys() & _OF_SCHEME.keys():
            made[name] += _OF_SCHEME[name](scheme, of_scheme, rules)
    return {
        name: pd.DataFrame(rows, columns=None if rows else COLUMNS[name])
        for name, rows in made.items()
    }


def _healthy(rows: RecordArray) -> RecordArray:
    healthy: RecordArray = rows[rows["size_mm"] == 0]
    return healthy


def summary(scheme: str, of_scheme: Mapping[str, RecordArray], rules: Settings) -> Iterator[Cells]:
    """Yield how well each detector tells nodules from none, for any nodule and for each size.

    The recordings are the healthy ones, and those with a nodule of the size. Always predicting a
    nodule is a detector too, `ALWAYS`, whose verdicts have no meaning and no score.

    The experimenter chooses the prevalence of an archive. So the predictive values at the stated
    prevalence follow from the shares of verdicts by Bayes' rule, from `share_right`. A recording
    without a verdict is neither a positive nor a negative one. Only recordings with a verdict and a
    score have a place in the order of the scores, of which ``auc`` is the area under the ROC curve.
    """
    level, prevalence = rules["confidence"], rules["prevalence"]
    odds = prevalence / (1 - prevalence)
    for detector, all_rows in of_scheme.items():
        for size_mm, nodules in by_size(all_rows):
            rows = all_rows[np.isin(all_rows["size_mm"], [0.0, *nodules["size_mm"]])]
            nodule, scored = rows["size_mm"] > 0, with_value(rows, "score")
            yield cells_over(
                rows,
                detector=detector,
                scheme=scheme,
                size_mm=size_mm,
                **_rates(rows, level),
                sensitivity_at_specificity=found_at(rows, rules["specificity"]),
                auc=_area(_healthy(scored), scored[scored["size_mm"] > 0], level),
                prevalence=prevalence,
                ppv=share_right(rows, rows["found"], nodule, odds, level),
                npv=share_right(rows, rows["quiet"], ~nodule, 1 / odds, level),
            )
    always = next(iter(of_scheme.values())).copy()
    always["right"] = always["size_mm"] > 0
    yield cells_over(always, detector=ALWAYS, scheme=scheme, size_mm=ANY, **_rates(always, level))


def _rates(rows: RecordArray, confidence: float) -> Cells:
    """Return the rates of right verdicts on nodules, on healthy recordings, and on both."""
    sensitivity = rate_over(rows[rows["size_mm"] > 0], confidence)
    specificity = rate_over(_healthy(rows), confidence)
    return {
        "recordings": len(rows),
        "accuracy": rate_over(rows, confidence),
        "sensitivity": sensitivity,
        "specificity": specificity,
        "balanced_accuracy": _mean_of(sensitivity, specificity),
    }


def _area(healthy: RecordArray, nodules: RecordArray, confidence: float) -> Interval:
    """Return the area under the ROC curve of the scores of recordings of both kinds."""
    unit = cluster_unit(healthy, nodules)
    units = units_of(healthy, unit), units_of(nodules, unit)
    return auc_interval(healthy["score"], nodules["score"], units, confidence)


def found_at(rows: RecordArray, specificity: float) -> float:
    """Return the share of nodules found if all thresholds move to the wanted share of false alarms.

    It is the height of the ROC curve of score minus threshold, since each fold has a scale of its
    own. A recording without a verdict is a false alarm, or a missed nodule. It is NaN without a
    nodule, without a healthy recording, or if no threshold is known.
    """
    nodule, margins = rows["size_mm"] > 0, rows["score"] - rows["threshold"]
    if nodule.all() or not nodule.any() or np.isnan(margins).all():
        return float("nan")
    known = ~np.isnan(rows["predicted_mm"] + margins)
    scores = np.where(known, margins, np.where(nodule, -np.inf, np.inf))
    weights = rows["weight"][~nodule], rows["weight"][nodule]
    allowed = np.array([1 - specificity])
    return float(height_at(scores[~nodule], scores[nodule], allowed, weights)[0])


def _mean_of(first: Interval, second: Interval) -> Interval:
    """Return the mean of two independent rates, with the interval of Zou and Donner (2008)."""
    value = (first[0] + second[0]) / 2
    low, high = (np.hypot(first[0] - first[end], second[0] - second[end]) / 2 for end in (1, 2))
    # NaN stays NaN as the first argument.
    return value, float(max(value - low, 0.0)), float(min(value + high, 1.0))


def curves(rows: RecordArray, _: Settings) -> Iterator[Cells]:
    """Yield the points of the ROC curves, for any nodule and for each size.

    Without recordings of a kind that have a verdict and a score there is no curve.
    """
    scored = with_value(rows, "score")
    healthy = _healthy(scored)
    for size_mm, nodules in by_size(scored):
        if not len(healthy) or not len(nodules):
            continue
        weights = healthy["weight"], nodules["weight"]
        heights = height_at(healthy["score"], nodules["score"], _GRID, weights)
        for allowed, found in zip(_GRID.tolist(), heights.tolist(), strict=True):
            point = {"false_positive_rate": round(allowed, 10), "true_positive_rate": found}
            yield {"size_mm": size_mm, **point}


def share_right(
    rows: RecordArray, given: BoolArray, right: BoolArray, odds: float, confidence: float
) -> Interval:
    """Return the probability that a verdict is right, with its interval.

    The odds after the verdict are those before it, `odds`, times the ratio of two rates. The
    interval is that of this ratio, from `ratio_interval`, with the effective counts of both rates.
    `given` and `right` (n,) tell where the verdict was given, and for which recordings it is right.
    All values are NaN if it was never given, or if there are no recordings of a kind.
    """
    if not given.any() or right.all() or not right.any():
        return UNKNOWN
    rates, counts = [], []
    for kind in (right, ~right):
        units = units_of(rows[kind])
        hits, size = (float(units.weights @ each) for each in (given[kind], np.ones(kind.sum())))
        count = effective_count(given[kind], units, confidence)
        counts.append((hits if count == size else hits / size * count, count))
        rates.append((hits, size))
    (hits, of_right), (errors, of_wrong) = rates
    ratio = hits * of_wrong / (of_right * errors) if errors else math.inf
    value, low, high = (
        1.0 if each == math.inf else each * odds / (1 + each * odds)
        for each in (ratio, *ratio_interval(*counts[0], *counts[1], confidence))
    )
    # Rounding in the last digit must not move an end past the value.
    return value, min(low, value), max(high, value)


def prevalence_weights(nodule: BoolArray, prevalence: float, weights: FloatArray) -> FloatArray:
    """Return weights scaled to the prevalence of nodules; the sum is 1."""
    of_nodules, of_healthy = weights[nodule].sum(), weights[~nodule].sum()
    if not of_nodules or not of_healthy:
        return np.full(nodule.size, np.nan)
    scale = np.where(nodule, prevalence / of_nodules, (1 - prevalence) / of_healthy)
    scaled: FloatArray = weights * scale
    return scaled


def brier_score(probability: FloatArray | float, nodule: BoolArray, weights: FloatArray) -> float:
    """Return the mean squared error of the probability, with weights whose sum is 1; 0 is best."""
    return float(np.sum(weights * (probability - nodule) ** 2))


def calibration(rows: RecordArray, rules: Settings) -> Iterator[Cells]:
    """Yield the stated probability and the observed frequency of nodules, of all and in each bin.

    Both are weighted to the prevalence, and NaN if the bin is empty. A probability in a bin is
    treated as a verdict. The frequency of nodules in the bin is then a predictive value with its
    interval: five nodules and no healthy recording do not prove 100 %.

    The first row is of all recordings, without the ends of a bin. It alone has the Brier scores of
    the detector and of always stating the prevalence.
    """
    known, bins = with_value(rows, "probability"), rules["calibration_bins"]
    nodule, stated = known["size_mm"] > 0, known["probability"]
    if not known.size:
        return
    prevalence = rules["prevalence"]
    odds = prevalence / (1 - prevalence)
    weights = prevalence_weights(nodule, prevalence, known["weight"])

    def frequency(inside: BoolArray) -> Cells:
        total = weights[inside].sum()
        return {
            "recordings": int(inside.sum()),
            "stated": float((weights * stated)[inside].sum() / total) if total > 0 else np.nan,
            "observed": share_right(known, inside, nodule, odds, rules["confidence"]),
        }

    yield cells_over(
        known,
        stated_low=np.nan,
        stated_high=np.nan,
        **frequency(np.ones(known.size, dtype=bool)),
        prevalence=prevalence,
        brier=brier_score(stated, nodule, weights),
        brier_uninformed=brier_score(prevalence, nodule, weights),
    )
    bin_of = np.minimum((stated * bins).astype(int), bins - 1)
    for turn in range(bins):
        ends = {"stated_low": turn / bins, "stated_high": (turn + 1) / bins}
        yield cells_over(known[bin_of == turn], **ends, **frequency(bin_of == turn))


def comparisons(
    scheme: str, of_scheme: Mapping[str, RecordArray], rules: Settings
) -> Iterator[Cells]:
    """Yield the comparison of every two detectors on the same recordings, for each measure.

    ``difference`` is that of the rates of correct verdicts, second minus first, from
    `gain_interval`.
    """
    for (one, first), (other, second) in combinations(of_scheme.items(), 2):
        for measure, mark in (("detection", "right"), ("size_within_tolerance", "within")):
            whole, *sizes = by_size(first)
            healthy = [(0.0, _healthy(first))] if mark == "right" else []
            for size_mm, rows in (whole, *healthy, *sizes):
                # All detectors judge the same recordings, in the same order.
                others = second[np.isin(second["turn"], rows["turn"])]
                right, units = (rows[mark], others[mark]), units_of(rows)
                yield cells_over(
                    rows,
                    scheme=scheme,
                    first=one,
                    second=other,
                    measure=measure,
                    size_mm=size_mm,
                    recordings=len(rows),
                    difference=gain_interval(*right, units, rules["confidence"]),
                    mcnemar_p=sign_test(*right, units),
                )


def sign_test(first_right: BoolArray, second_right: BoolArray, units: Units) -> float:
    """Return the two-sided probability of wins this unequal if neither detector is better.

    Each cluster is won by the detector whose rate is higher there. If each cluster is of one
    recording, this is McNemar's exact test. It is NaN without a recording.
    """
    if not units.clusters.size:
        return float("nan")
    _, cluster_of = np.unique(units.clusters, return_inverse=True)
    gains = np.bincount(cluster_of, units.weights * (second_right.astype(float) - first_right))
    # Rounding: thirds of both signs need not cancel.
    gains = np.where(np.abs(gains) < 1e-9, 0.0, gains)
    wins, count = int(np.sum(gains > 0)), int(np.count_nonzero(gains))
    tail = sum(math.comb(count, fewer) for fewer in range(min(wins, count - wins) + 1))
    chance: float = 2 * tail / 2**count
    return min(chance, 1.0)


def retests(scheme: str, of_scheme: Mapping[str, RecordArray], rules: Settings) -> Iterator[Cells]:
    """Yield the rates of detection if several passes over a site are judged together.

    Passes over one site with another label are another site. Nothing is yielded if no site has
    several passes, nor under another scheme than leave-one-out: the gain is shown once.
    """
    for detector, rows in of_scheme.items() if scheme == LEAVE_ONE_OUT else ():
        table = pd.DataFrame(rows)
        several = table.duplicated(["site", "size_mm"]).any()
        for count in rules["passes"] if several else ():
            judged = detections_by_passes(table, detector, count, rules["specificity"])
            for size_mm, found in judged.groupby("size_mm")["detected"]:
                detected = rate(int(found.sum()), found.size, rules["confidence"])
                key = {"detector": detector, "scheme": scheme, "passes": count}
                yield with_ends(**key, size_mm=size_mm, sites=found.size, detected=detected)


# The tables of one detector under one scheme, and those of all detectors under one scheme.
_OF_ONE: Mapping[str, Callable[[RecordArray, Settings], Iterator[Cells]]] = {
    "detection": detection,
    "sizing": sizing,
    "confusion": confusion,
    "calibration": calibration,
    "roc": curves,
}
_OF_SCHEME = {"summary": summary, "comparison": comparisons, "retest": retests}
