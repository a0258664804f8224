"""The measures that rate the detectors, as tables with detector and scheme in each row."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
import pandas as pd

from capsule.arrays import BoolArray, FloatArray, IntArray
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.cross_validation import LEAVE_ONE_OUT
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
    rate_columns,
)
from capsule.evaluation.roc import auc_interval, height_at
from capsule.evaluation.sites import detections_by_passes, number, passes_by_site
from capsule.kinds import Cells, Settings

ALWAYS = "always_nodule"
ANY = None  # In place of a size, this stands for any nodule.
_GRID = np.linspace(0.0, 1.0, 21)
# Measures of sizes in the summary, which the baseline does not name.
_OF_SIZES = ("exact_rate", "within_rate", "mean_absolute_error_mm")


def measure_tables(
    predictions: pd.DataFrame, index: Mapping[str, Mapping[str, str]], rules: Settings
) -> dict[str, pd.DataFrame]:
    """Return all tables named in `COLUMNS`.

    Parameters
    ----------
    predictions : DataFrame
        One row for each detector, recording and scheme, as in results/evaluation/predictions.csv.
    index : mapping of str to mapping
        The row in results/recordings.csv of each recording.
    rules : mapping
        Section ``evaluation`` of the configuration.

    Returns
    -------
    dict of str to DataFrame
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
        for row in comparisons(of_scheme, tolerance_mm, level):
            made["comparison"].append({"scheme": scheme, **row})
    return {
        name: pd.DataFrame(rows, columns=None if rows else COLUMNS[name])
        for name, rows in made.items()
    }


def of_size(rows: pd.DataFrame, size_mm: float | None) -> pd.DataFrame:
    """Return the recordings over a nodule of this size (0: none), or over `ANY` nodule."""
    true_mm = rows["size_mm"]
    return rows[true_mm > 0 if size_mm is ANY else true_mm == size_mm]


def each_size(rows: pd.DataFrame) -> list[float | None]:
    """Return `ANY`, and the sizes of the nodules, ascending."""
    return [ANY, *sorted({float(size) for size in rows["size_mm"] if size > 0})]


def is_right(rows: pd.DataFrame) -> BoolArray:
    """Return which verdicts (nodule or none) are right; never true without a verdict."""
    nodule, predicted_mm = rows["size_mm"].to_numpy() > 0, rows["predicted_mm"].to_numpy()
    right: BoolArray = np.where(nodule, predicted_mm > 0, predicted_mm == 0)
    return right


def summary(
    of_scheme: Sequence[tuple[Cells, pd.DataFrame]], tolerance_mm: float, confidence: float
) -> Iterator[Cells]:
    """Yield each detector's rates over all recordings, and those of always predicting a nodule.

    The interval of the balanced accuracy is computed from the intervals of sensitivity and
    specificity (Zou and Donner 2008). A missed nodule has no size, so it is neither exact nor
    within the tolerance. In the mean absolute error it counts as 0 mm, and so does a nodule without
    a verdict.
    """
    key, first = of_scheme[0]
    always = first.assign(predicted_mm=np.inf)
    for label, rows in [*of_scheme, (key | {"detector": ALWAYS}, always)]:
        nodules, healthy = of_size(rows, ANY), of_size(rows, 0.0)
        row = label | {"recordings": len(rows)}
        row |= rate_columns("accuracy", rows, is_right(rows), confidence)
        row |= rate_columns("sensitivity", nodules, is_right(nodules), confidence)
        row |= rate_columns("specificity", healthy, is_right(healthy), confidence)
        of_kinds = (
            [row[f"{name}{end}"] for end in ("", "_low", "_high")]
            for name in ("sensitivity", "specificity")
        )
        row |= interval_columns("balanced_accuracy", _mean_of(*of_kinds))
        if label["detector"] == ALWAYS:
            for name in _OF_SIZES:
                row |= interval_columns(name, UNKNOWN)
        else:
            row |= _size_rates(nodules, tolerance_mm, confidence)
        yield row | {"clusters": cluster_count(rows)}


def _size_rates(nodules: pd.DataFrame, tolerance_mm: float, confidence: float) -> Cells:
    """Return the measures `_OF_SIZES`, over all nodules."""
    clusters = clusters_of(nodules)
    predicted_mm = nodules["predicted_mm"].fillna(0.0).to_numpy()
    error = np.abs(predicted_mm - nodules["size_mm"].to_numpy())
    mean, low, high = mean_interval(error, confidence, clusters)
    # NaN stays NaN as the first argument.
    values = mean, max(low, 0.0), high
    exact, within = (_right_size(nodules, allowed_mm) for allowed_mm in (0.0, tolerance_mm))
    rates = (rate_of(right, clusters, confidence) for right in (exact, within))
    row: Cells = {}
    for name, interval in zip(_OF_SIZES, (*rates, values), strict=True):
        row |= interval_columns(name, interval)
    return row


def _mean_of(first: Sequence[float], second: Sequence[float]) -> Interval:
    """Return the mean of two independent estimates, with its interval."""
    value = (first[0] + second[0]) / 2
    reach = [np.hypot(first[0] - first[end], second[0] - second[end]) / 2 for end in (1, 2)]
    # NaN stays NaN as the first argument.
    return value, float(max(value - reach[0], 0.0)), float(min(value + reach[1], 1.0))


def _right_size(rows: pd.DataFrame, tolerance_mm: float) -> BoolArray:
    return is_within(rows["predicted_mm"].to_numpy(), rows["size_mm"].to_numpy(), tolerance_mm)


def areas(rows: pd.DataFrame, confidence: float) -> Iterator[Cells]:
    """Yield the areas under the ROC curves, for any nodule and for each size.

    Only recordings with a verdict and a score have a place in the order of the scores.
    """
    for size_mm, healthy, nodules in _scored(rows):
        kinds = healthy, nodules
        unit = cluster_unit(*kinds)
        clusters = [each[unit].to_numpy() for each in kinds]
        area = auc_interval(
            healthy["score"].to_numpy(), nodules["score"].to_numpy(), confidence, *clusters
        )
        row = {"size_mm": size_mm, **interval_columns("auc", area)}
        yield row | {"clusters": np.unique(np.concatenate(clusters)).size}


def _scored(rows: pd.DataFrame) -> Iterator[tuple[float | None, pd.DataFrame, pd.DataFrame]]:
    """Yield for any nodule and for each size the healthy recordings and the nodules with scores."""
    known = rows[rows["score"].notna() & rows["predicted_mm"].notna()]
    for size_mm in each_size(rows):
        healthy, nodules = of_size(known, 0.0), of_size(known, size_mm)
        if len(healthy) and len(nodules):
            yield size_mm, healthy, nodules


def curves(rows: pd.DataFrame) -> Iterator[Cells]:
    """Yield the points of the ROC curves, for any nodule and for each size."""
    for size_mm, healthy, nodules in _scored(rows):
        heights = height_at(healthy["score"].to_numpy(), nodules["score"].to_numpy(), _GRID)
        for allowed, found in zip(_GRID.tolist(), heights.tolist(), strict=True):
            point = {"false_positive_rate": round(allowed, 10), "true_positive_rate": found}
            yield {"size_mm": size_mm, **point}


def predictive(rows: pd.DataFrame, prevalence: float, confidence: float) -> Iterator[Cells]:
    """Yield the predictive values at a stated prevalence, for any nodule and for each size.

    The experimenter chooses the prevalence of an archive. The values therefore follow from the
    shares of verdicts by Bayes' rule, from `share_right`. A recording without a verdict is neither
    a positive nor a negative one.
    """
    odds = prevalence / (1 - prevalence)
    healthy = of_size(rows, 0.0)
    alarms, quiet = healthy["predicted_mm"] > 0, healthy["predicted_mm"] == 0
    for size_mm in each_size(rows):
        nodules = of_size(rows, size_mm)
        found, missed = nodules["predicted_mm"] > 0, nodules["predicted_mm"] == 0
        row: Cells = {"size_mm": size_mm, "prevalence": prevalence}
        row |= rate_columns("sensitivity", nodules, found, confidence)
        positive = share_right(nodules, found, healthy, alarms, odds, confidence)
        negative = share_right(healthy, quiet, nodules, missed, 1 / odds, confidence)
        row |= interval_columns("ppv", positive) | interval_columns("npv", negative)
        yield row | {"clusters": cluster_count(pd.concat([healthy, nodules]))}


def share_right(
    right: pd.DataFrame,
    given_right: pd.Series | BoolArray,
    wrong: pd.DataFrame,
    given_wrong: pd.Series | BoolArray,
    odds: float,
    confidence: float,
) -> Interval:
    """Return the probability that a verdict is right, with its interval.

    The odds after the verdict are those before it times the ratio of two rates. The interval is
    that of this ratio, from `ratio_interval`, with the effective counts of both rates.

    Parameters
    ----------
    right, wrong : DataFrame
        The recordings for which the verdict is right, and those for which it is wrong.
    given_right, given_wrong : (n,), (m,) array of bool
        For which of them the verdict was given.
    odds : float
        Odds, before the verdict, that it is right.
    confidence : float
        Level of the interval.

    Returns
    -------
    value, low, high : float
        All NaN if the verdict was never given, or if there are no recordings of a kind.
    """
    hits, of_right = int(given_right.sum()), len(right)
    errors, of_wrong = int(given_wrong.sum()), len(wrong)
    if hits == errors == 0 or not of_right or not of_wrong:
        return UNKNOWN
    ratio = hits * of_wrong / (of_right * errors) if errors else float("inf")
    low, high = ratio_interval(
        *_effective_counts(right, given_right, confidence),
        *_effective_counts(wrong, given_wrong, confidence),
        confidence=confidence,
    )
    value = _share(ratio * odds)
    # Rounding in the last digit must not move an end past the value.
    return value, min(_share(low * odds), value), max(_share(high * odds), value)


def _effective_counts(
    rows: pd.DataFrame, given: pd.Series | BoolArray, confidence: float
) -> tuple[float, float]:
    """Return how often a verdict was given, and of how many, as independent recordings."""
    count, hits = len(rows), int(given.sum())
    effective = effective_count(np.asarray(given), clusters_of(rows), confidence)
    return (hits if effective == count else hits / count * effective), effective


def _share(odds: float) -> float:
    return 1.0 if odds == float("inf") else odds / (1 + odds)


def prevalence_weights(nodule: BoolArray, prevalence: float) -> FloatArray:
    """Return weights that give nodules the stated prevalence; their sum is 1."""
    count = np.count_nonzero(nodule)
    if count in (0, nodule.size):
        return np.full(nodule.size, np.nan)
    return np.where(nodule, prevalence / count, (1 - prevalence) / (nodule.size - count))


def brier_score(probability: FloatArray, nodule: BoolArray, prevalence: float) -> float:
    """Return the mean squared error of the probability at the stated prevalence; 0 is best."""
    weights = prevalence_weights(nodule, prevalence)
    return float(np.sum(weights * (probability - nodule) ** 2))


def brier(rows: pd.DataFrame, prevalence: float) -> Iterator[Cells]:
    """Yield the Brier score of a detector that states probabilities."""
    known = rows[rows["probability"].notna() & rows["predicted_mm"].notna()]
    probability, nodule = known["probability"].to_numpy(), known["size_mm"].to_numpy() > 0
    if len(known):
        yield {
            "recordings": nodule.size,
            "prevalence": prevalence,
            "brier": brier_score(probability, nodule, prevalence),
            "brier_uninformed": brier_score(np.full(nodule.size, prevalence), nodule, prevalence),
        }


def calibration(
    rows: pd.DataFrame, prevalence: float, bins: int, confidence: float
) -> Iterator[Cells]:
    """Yield the stated probability and the observed frequency of nodules in each bin.

    A probability in a bin is treated as a verdict. The frequency of nodules in the bin is then a
    predictive value with its interval: five nodules and no healthy recording do not prove 100 %.

    Parameters
    ----------
    rows : DataFrame
        From `of_each`; only recordings with a probability, at the prevalence, count.
    prevalence : float
        Prevalence to which the recordings are weighted.
    bins : int
        Number of equal intervals of the probability.
    confidence : float
        Level of the intervals.

    Yields
    ------
    dict
        One row for each bin: ``stated_low``, ``stated_high``, ``recordings``, ``stated`` (mean),
        ``observed`` with ``_low`` and ``_high``, and ``clusters``; NaN if the bin is empty.
    """
    known = rows[rows["probability"].notna() & rows["predicted_mm"].notna()]
    if known.empty:
        return
    probability, nodule = known["probability"].to_numpy(), known["size_mm"].to_numpy() > 0
    bin_of = np.minimum((probability * bins).astype(int), bins - 1)
    weights, odds = prevalence_weights(nodule, prevalence), prevalence / (1 - prevalence)
    kinds = known[nodule], known[~nodule]
    for index in range(bins):
        inside = bin_of == index
        total = weights[inside].sum()
        stated = (weights * probability)[inside].sum() / total if total > 0 else np.nan
        observed = share_right(
            kinds[0], inside[nodule], kinds[1], inside[~nodule], odds, confidence
        )
        row = {"stated_low": index / bins, "stated_high": (index + 1) / bins}
        row |= {"recordings": int(inside.sum()), "stated": float(stated)}
        row |= interval_columns("observed", observed)
        yield row | {"clusters": cluster_count(known[inside])}


def size_errors(rows: pd.DataFrame, confidence: float) -> Iterator[Cells]:
    """Yield bias and absolute error of the estimated size, for any nodule and for each size.

    Only recordings in which a nodule was detected have an estimate.
    """
    for size_mm in each_size(rows):
        nodules = of_size(rows, size_mm)
        sized = nodules[nodules["estimate_mm"].notna() & nodules["predicted_mm"].notna()]
        error = (sized["estimate_mm"] - sized["size_mm"]).to_numpy(dtype=np.float64)
        row: Cells = {"size_mm": size_mm, "recordings": len(nodules), "detected": len(sized)}
        for name, values in (("bias", error), ("absolute_error", np.abs(error))):
            mean = mean_interval(values, confidence, clusters_of(sized))
            ends = (f"{name}_mm", f"{name}_low_mm", f"{name}_high_mm")
            row |= dict(zip(ends, mean, strict=True))
        # NaN is not smaller than 0, so it stays NaN.
        if row["absolute_error_low_mm"] < 0:
            row["absolute_error_low_mm"] = 0.0
        yield row | {"clusters": cluster_count(sized)}


def localisation(
    rows: pd.DataFrame, index: Mapping[str, Mapping[str, str]], confidence: float
) -> Iterator[Cells]:
    """Yield the error of the location, for recordings whose header has the nodule's position."""
    truth = [number(index[name]["nodule_at_mm"]) for name in rows.index]
    located = rows.assign(error=(rows["location_mm"] - truth).where(rows["predicted_mm"] > 0))
    located = located[located["error"].notna()]
    for size_mm in each_size(rows):
        known = of_size(located, size_mm)
        if len(known):
            error, clusters = known["error"].to_numpy(), clusters_of(known)
            row: Cells = {"size_mm": size_mm, "recordings": len(known)}
            median = median_interval(np.abs(error), confidence, clusters)
            row |= interval_columns("median_absolute_error_mm", median)
            row |= interval_columns("bias_mm", mean_interval(error, confidence, clusters))
            yield row | {"clusters": cluster_count(known)}


def comparisons(
    of_scheme: Sequence[tuple[Cells, pd.DataFrame]], tolerance_mm: float, confidence: float
) -> Iterator[Cells]:
    """Yield the comparison of every two detectors on the same recordings, for each measure.

    ``only_first`` and ``only_second`` are numbers of recordings that only this detector judges
    correctly. ``difference`` is that of the rates, second minus first, from `gain_interval`.
    """
    for (one, first), (other, second) in combinations(of_scheme, 2):
        names = first.index.intersection(second.index)
        both = first.loc[names], second.loc[names]
        for measure in ("detection", "size_within_tolerance"):
            healthy = [0.0] if measure == "detection" else []
            for size_mm in (ANY, *healthy, *each_size(first)[1:]):
                chosen = [of_size(rows, size_mm) for rows in both]
                one_right, other_right = (
                    is_right(rows) if measure == "detection" else _right_size(rows, tolerance_mm)
                    for rows in chosen
                )
                row = {"first": one["detector"], "second": other["detector"], "measure": measure}
                row |= {"size_mm": size_mm, "recordings": len(chosen[0])}
                row |= {"only_first": int(np.sum(one_right & ~other_right))}
                row |= {"only_second": int(np.sum(other_right & ~one_right))}
                clusters = clusters_of(chosen[0])
                gain = gain_interval(one_right, other_right, confidence, clusters)
                row |= interval_columns("difference", gain)
                row["mcnemar_p"] = sign_test(one_right, other_right, clusters)
                yield row | {"clusters": cluster_count(chosen[0])}


def sign_test(first_right: BoolArray, second_right: BoolArray, clusters: IntArray) -> float:
    """Return the two-sided probability of wins this unequal if neither detector is better.

    Each cluster is won by the detector that judges more of its recordings correctly. If each
    cluster is of one recording, this is McNemar's exact test.

    Parameters
    ----------
    first_right, second_right : (n,) array of bool
        Which recordings each detector judges correctly.
    clusters : (n,) array of int
        The cluster of each recording.

    Returns
    -------
    float
        NaN without a recording.
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


def retests(
    detector: str, rows: pd.DataFrame, index: Mapping[str, Mapping[str, str]], rules: Settings
) -> Iterator[Cells]:
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
            yield row | interval_columns("detected", rate_of(found, None, rules["confidence"]))
