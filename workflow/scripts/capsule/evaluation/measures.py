"""The measures that rate the detectors, as tables with detector and scheme in each row."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
import pandas as pd

from capsule.arrays import BoolArray, FloatArray, IntArray
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.cross_validation import LEAVE_ONE_OUT, Rows
from capsule.evaluation.intervals import (
    UNKNOWN,
    Interval,
    effective_count,
    gain_interval,
    mean_interval,
    median_interval,
    rate_of,
    ratio_interval,
)
from capsule.evaluation.rates import (
    cluster_count,
    cluster_unit,
    clusters_of,
    interval_columns,
    is_within,
    of_each,
    rate_over,
)
from capsule.evaluation.roc import auc_interval, height_at
from capsule.evaluation.sites import detections_by_passes, number, passes_by_site
from capsule.kinds import Cells, Settings

ALWAYS = "always_nodule"
ANY = None  # In place of a size, this stands for any nodule.
_GRID = np.linspace(0.0, 1.0, 21)


def measure_tables(
    predictions: pd.DataFrame, index: Rows, rules: Settings
) -> dict[str, pd.DataFrame]:
    """Return all tables named in `COLUMNS`.

    Predictions and index are as in `capsule.evaluation.rates.of_each`. The rules are the section
    ``evaluation`` of the configuration.
    """
    level, tolerance_mm, prevalence = (
        rules[key] for key in ("confidence", "tolerance_mm", "prevalence")
    )
    made: dict[str, list[Cells]] = {name: [] for name in COLUMNS}
    by_scheme: dict[str, list[tuple[Cells, pd.DataFrame]]] = {}
    for key, rows in of_each(predictions, index):
        by_scheme.setdefault(key["scheme"], []).append((key, rows))
        tables = {
            "auc": areas(rows, level),
            "roc": curves(rows),
            "predictive_values": predictive(rows, prevalence, level),
            "calibration": calibration(rows, prevalence, rules["calibration_bins"], level),
            "brier": brier(rows, prevalence),
            "size_error": size_errors(rows, level),
            "localisation": localisation(rows, index, level),
        }
        if key["scheme"] == LEAVE_ONE_OUT:
            tables["retest"] = retests(key["detector"], rows, index, rules)
        for name, table in tables.items():
            made[name] += [key | row for row in table]
    for scheme, of_scheme in by_scheme.items():
        made["summary"] += summary(of_scheme, tolerance_mm, level)
        compared = comparisons(of_scheme, tolerance_mm, level)
        made["comparison"] += [{"scheme": scheme, **row} for row in compared]
    return {
        name: pd.DataFrame(rows, columns=None if rows else COLUMNS[name])
        for name, rows in made.items()
    }


def by_size(rows: pd.DataFrame) -> Iterator[tuple[float | None, pd.DataFrame]]:
    """Yield `ANY` with all recordings over nodules, and each size with its recordings."""
    nodules = rows[rows["size_mm"] > 0]
    yield ANY, nodules
    yield from nodules.groupby("size_mm")


def _healthy(rows: pd.DataFrame) -> pd.DataFrame:
    return rows[rows["size_mm"] == 0]


def _known(rows: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return the recordings that have a verdict, and a value in a column."""
    return rows[rows[column].notna() & rows["predicted_mm"].notna()]


def _right_size(rows: pd.DataFrame, tolerance_mm: float) -> BoolArray:
    return is_within(rows["predicted_mm"].to_numpy(), rows["size_mm"].to_numpy(), tolerance_mm)


def summary(
    of_scheme: Sequence[tuple[Cells, pd.DataFrame]], tolerance_mm: float, confidence: float
) -> Iterator[Cells]:
    """Yield each detector's rates over all recordings, and those of always predicting a nodule.

    A missed nodule has no size, so it is neither exact nor within the tolerance. In the mean
    absolute error it counts as 0 mm, and so does a nodule without a verdict.
    """
    key, first = of_scheme[0]
    always = first.assign(predicted_mm=np.inf, right=first["size_mm"] > 0)
    for label, rows in [*of_scheme, (key | {"detector": ALWAYS}, always)]:
        nodules, healthy = rows[rows["size_mm"] > 0], _healthy(rows)
        sensitivity, specificity = (
            rate_over(kind, kind["right"], confidence) for kind in (nodules, healthy)
        )
        # The baseline names no size.
        sized = nodules if label["detector"] != ALWAYS else nodules[:0]
        error = sized["predicted_mm"].fillna(0.0) - sized["size_mm"]
        values = interval_columns(
            accuracy=rate_over(rows, rows["right"], confidence),
            sensitivity=sensitivity,
            specificity=specificity,
            balanced_accuracy=_mean_of(sensitivity, specificity),
            exact_rate=rate_over(sized, _right_size(sized, 0.0), confidence),
            within_rate=rate_over(sized, _right_size(sized, tolerance_mm), confidence),
            mean_absolute_error_mm=_absolute_error(error, sized, confidence),
        )
        yield label | {"recordings": len(rows)} | values | {"clusters": cluster_count(rows)}


def _mean_of(first: Interval, second: Interval) -> Interval:
    """Return the mean of two independent rates, with the interval of Zou and Donner (2008)."""
    value = (first[0] + second[0]) / 2
    low, high = (np.hypot(first[0] - first[end], second[0] - second[end]) / 2 for end in (1, 2))
    # NaN stays NaN as the first argument.
    return value, float(max(value - low, 0.0)), float(min(value + high, 1.0))


def _absolute_error(error: pd.Series, rows: pd.DataFrame, confidence: float) -> Interval:
    """Return the mean absolute error with its interval, which does not reach below 0."""
    value, low, high = mean_interval(np.abs(error.to_numpy()), confidence, clusters_of(rows))
    # NaN stays NaN as the first argument.
    return value, max(low, 0.0), high


def areas(rows: pd.DataFrame, confidence: float) -> Iterator[Cells]:
    """Yield the areas under the ROC curves, for any nodule and for each size.

    Only recordings with a verdict and a score have a place in the order of the scores.
    """
    for size_mm, healthy, nodules in _scored(rows):
        scores = healthy["score"].to_numpy(), nodules["score"].to_numpy()
        unit = cluster_unit(healthy, nodules)
        clusters = healthy[unit].to_numpy(), nodules[unit].to_numpy()
        area = auc_interval(*scores, confidence, *clusters)
        count = np.unique(np.concatenate(clusters)).size
        yield {"size_mm": size_mm, **interval_columns(auc=area), "clusters": count}


def curves(rows: pd.DataFrame) -> Iterator[Cells]:
    """Yield the points of the ROC curves, for any nodule and for each size."""
    for size_mm, healthy, nodules in _scored(rows):
        heights = height_at(healthy["score"].to_numpy(), nodules["score"].to_numpy(), _GRID)
        for allowed, found in zip(_GRID.tolist(), heights.tolist(), strict=True):
            point = {"false_positive_rate": round(allowed, 10), "true_positive_rate": found}
            yield {"size_mm": size_mm, **point}


def _scored(rows: pd.DataFrame) -> Iterator[tuple[float | None, pd.DataFrame, pd.DataFrame]]:
    """Yield for any nodule and for each size the healthy recordings and the nodules with scores."""
    known = _known(rows, "score")
    healthy = _healthy(known)
    for size_mm, nodules in by_size(known):
        if len(healthy) and len(nodules):
            yield size_mm, healthy, nodules


def predictive(rows: pd.DataFrame, prevalence: float, confidence: float) -> Iterator[Cells]:
    """Yield the predictive values at a stated prevalence, for any nodule and for each size.

    The experimenter chooses the prevalence of an archive. The values therefore follow from the
    shares of verdicts by Bayes' rule, from `share_right`. A recording without a verdict is neither
    a positive nor a negative one.
    """
    odds, healthy = prevalence / (1 - prevalence), _healthy(rows)
    for size_mm, nodules in by_size(rows):
        values = interval_columns(
            sensitivity=rate_over(nodules, nodules["found"], confidence),
            ppv=share_right(nodules, healthy, "found", odds, confidence),
            npv=share_right(healthy, nodules, "quiet", 1 / odds, confidence),
        )
        clusters = cluster_count(pd.concat([healthy, nodules]))
        yield {"size_mm": size_mm, "prevalence": prevalence, **values, "clusters": clusters}


def share_right(
    right: pd.DataFrame, wrong: pd.DataFrame, given: str, odds: float, confidence: float
) -> Interval:
    """Return the probability that a verdict is right, with its interval.

    The odds after the verdict are those before it times the ratio of two rates. The interval is
    that of this ratio, from `ratio_interval`, with the effective counts of both rates. All values
    are NaN if the verdict was never given, or if there are no recordings of a kind.

    Parameters
    ----------
    right, wrong : DataFrame
        The recordings for which the verdict is right, and those for which it is wrong.
    given : str
        The column that tells where the verdict was given.
    odds, confidence : float
        Odds, before the verdict, that it is right; level of the interval.
    """
    hits, errors = int(right[given].sum()), int(wrong[given].sum())
    if hits == errors == 0 or right.empty or wrong.empty:
        return UNKNOWN
    counts = []
    for rows, times in ((right, hits), (wrong, errors)):
        count = effective_count(rows[given].to_numpy(), clusters_of(rows), confidence)
        counts.append((times if count == len(rows) else times / len(rows) * count, count))
    ratio = hits * len(wrong) / (len(right) * errors) if errors else math.inf
    ends = ratio_interval(*counts[0], *counts[1], confidence)
    value, low, high = (
        1.0 if each == math.inf else each * odds / (1 + each * odds) for each in (ratio, *ends)
    )
    # Rounding in the last digit must not move an end past the value.
    return value, min(low, value), max(high, value)


def prevalence_weights(nodule: BoolArray, prevalence: float) -> FloatArray:
    """Return weights that give nodules the stated prevalence; their sum is 1."""
    count = np.count_nonzero(nodule)
    if count in (0, nodule.size):
        return np.full(nodule.size, np.nan)
    return np.where(nodule, prevalence / count, (1 - prevalence) / (nodule.size - count))


def brier_score(probability: FloatArray | float, nodule: BoolArray, prevalence: float) -> float:
    """Return the mean squared error of the probability at the stated prevalence; 0 is best."""
    weights = prevalence_weights(nodule, prevalence)
    return float(np.sum(weights * (probability - nodule) ** 2))


def brier(rows: pd.DataFrame, prevalence: float) -> Iterator[Cells]:
    """Yield the Brier score of a detector that states probabilities."""
    known = _known(rows, "probability")
    nodule = known["size_mm"].to_numpy() > 0
    if nodule.size:
        yield {
            "recordings": nodule.size,
            "prevalence": prevalence,
            "brier": brier_score(known["probability"].to_numpy(), nodule, prevalence),
            "brier_uninformed": brier_score(prevalence, nodule, prevalence),
        }


def calibration(
    rows: pd.DataFrame, prevalence: float, bins: int, confidence: float
) -> Iterator[Cells]:
    """Yield the stated probability and the observed frequency of nodules in each bin.

    Both are weighted to the prevalence, and NaN if the bin is empty. A probability in a bin is
    treated as a verdict. The frequency of nodules in the bin is then a predictive value with its
    interval: five nodules and no healthy recording do not prove 100 %.
    """
    known = _known(rows, "probability")
    nodule, stated = known["size_mm"] > 0, known["probability"].to_numpy()
    bin_of = np.minimum((stated * bins).astype(int), bins - 1)
    weights = prevalence_weights(nodule.to_numpy(), prevalence)
    for turn in range(bins if len(known) else 0):
        inside = bin_of == turn
        binned, odds = known.assign(inside=inside), prevalence / (1 - prevalence)
        observed = share_right(binned[nodule], binned[~nodule], "inside", odds, confidence)
        total = weights[inside].sum()
        yield {
            "stated_low": turn / bins,
            "stated_high": (turn + 1) / bins,
            "recordings": int(inside.sum()),
            "stated": float((weights * stated)[inside].sum() / total) if total > 0 else np.nan,
            **interval_columns(observed=observed),
            "clusters": cluster_count(known[inside]),
        }


def size_errors(rows: pd.DataFrame, confidence: float) -> Iterator[Cells]:
    """Yield bias and absolute error of the estimated size, for any nodule and for each size.

    Only recordings in which a nodule was detected have an estimate.
    """
    for size_mm, nodules in by_size(rows):
        sized = _known(nodules, "estimate_mm")
        error = sized["estimate_mm"] - sized["size_mm"]
        errors = interval_columns(
            bias=mean_interval(error.to_numpy(), confidence, clusters_of(sized)),
            absolute_error=_absolute_error(error, sized, confidence),
        )
        row = {"size_mm": size_mm, "recordings": len(nodules), "detected": len(sized)}
        row |= {f"{name}_mm": value for name, value in errors.items()}
        yield row | {"clusters": cluster_count(sized)}


def localisation(rows: pd.DataFrame, index: Rows, confidence: float) -> Iterator[Cells]:
    """Yield the error of the location, for recordings whose header has the nodule's position."""
    truth = [number(index[name]["nodule_at_mm"]) for name in rows.index]
    located = rows.assign(error=(rows["location_mm"] - truth).where(rows["predicted_mm"] > 0))
    for size_mm, known in by_size(located[located["error"].notna()]):
        if len(known):
            error, clusters = known["error"].to_numpy(), clusters_of(known)
            errors = interval_columns(
                median_absolute_error_mm=median_interval(np.abs(error), confidence, clusters),
                bias_mm=mean_interval(error, confidence, clusters),
            )
            row = {"size_mm": size_mm, "recordings": len(known), **errors}
            yield row | {"clusters": cluster_count(known)}


def comparisons(
    of_scheme: Sequence[tuple[Cells, pd.DataFrame]], tolerance_mm: float, confidence: float
) -> Iterator[Cells]:
    """Yield the comparison of every two detectors on the same recordings, for each measure.

    ``only_first`` and ``only_second`` are numbers of recordings that only this detector judges
    correctly. ``difference`` is that of the rates, second minus first, from `gain_interval`.
    """
    for (one, first), (other, second) in combinations(of_scheme, 2):
        second = second.loc[first.index]
        detected = first.assign(one=first["right"], other=second["right"])
        sized = first.assign(
            one=_right_size(first, tolerance_mm), other=_right_size(second, tolerance_mm)
        )
        whole, *sizes = by_size(detected)
        kinds = [("detection", *kind) for kind in (whole, (0.0, _healthy(detected)), *sizes)]
        kinds += [("size_within_tolerance", *kind) for kind in by_size(sized)]
        for measure, size_mm, rows in kinds:
            right = rows["one"].to_numpy(), rows["other"].to_numpy()
            clusters = clusters_of(rows)
            row = {"first": one["detector"], "second": other["detector"], "measure": measure}
            row |= {"size_mm": size_mm, "recordings": len(rows)}
            row |= {"only_first": int(np.sum(right[0] & ~right[1]))}
            row |= {"only_second": int(np.sum(right[1] & ~right[0]))}
            row |= interval_columns(difference=gain_interval(*right, confidence, clusters))
            row["mcnemar_p"] = sign_test(*right, clusters)
            yield row | {"clusters": cluster_count(rows)}


def sign_test(first_right: BoolArray, second_right: BoolArray, clusters: IntArray) -> float:
    """Return the two-sided probability of wins this unequal if neither detector is better.

    Each cluster is won by the detector that judges more of its recordings correctly. If each
    cluster is of one recording, this is McNemar's exact test. It is NaN without a recording.
    """
    if not clusters.size:
        return float("nan")
    _, cluster_of = np.unique(clusters, return_inverse=True)
    gains = np.bincount(cluster_of, second_right.astype(float) - first_right)
    first, second = int(np.sum(gains < 0)), int(np.sum(gains > 0))
    if first == second:
        return 1.0
    count, ways, cases = first + second, 1, 0
    for wins in range(min(first, second) + 1):
        cases += ways
        ways = ways * (count - wins) // (wins + 1)
    chance: float = 2 * cases / 2**count
    return chance


def retests(detector: str, rows: pd.DataFrame, index: Rows, rules: Settings) -> Iterator[Cells]:
    """Yield the rates of detection if several passes over a site are judged together.

    Passes over one site with another label are another site. Nothing is yielded if no site has
    several passes. The parameters are those of `measure_tables`, for one detector.
    """
    sites = {name: row["site"] for name, row in index.items()}
    passes = passes_by_site(rows.reset_index(names="recording").to_dict("records"), sites)
    several = any(of_site["score"].size > 1 for of_site in passes.values())
    for count in rules["passes"] if several else ():
        judged = detections_by_passes(passes, detector, count, rules["specificity"])
        for size_mm in np.unique(judged[0]).tolist():
            found = judged[1][judged[0] == size_mm]
            row = {"passes": count, "size_mm": size_mm, "sites": found.size}
            yield row | interval_columns(detected=rate_of(found, None, rules["confidence"]))
