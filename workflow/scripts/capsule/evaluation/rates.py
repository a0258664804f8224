"""The rates of correct verdicts, as the paper defines them, with intervals.

A recording without a verdict counts as a failure: it stays in the denominators of sensitivity,
specificity and the rates of sizes. A precision is a share of given verdicts (Schuetz et al., BMJ
345, 2012). A detector that gives no verdict at all under a scheme has no rows.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from capsule.arrays import BoolArray, FloatArray, IntArray
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT, RESUBSTITUTION
from capsule.evaluation.intervals import (
    FEWEST_CLUSTERS,
    Interval,
    lower_bound,
    rate_of,
)
from capsule.kinds import Cells, Settings
from capsule.places import places_of

_RATES = {
    name: [name, f"{name}_low", f"{name}_high"]
    for name in ("precision", "recall", "specificity", "exact_rate", "within_rate", "share")
}
_BOUND = {name: [*_RATES[name], f"{name}_at_least"] for name in _RATES}
_KEY = ["detector", "scheme"]
# The columns of every table; a table without rows has them too.
COLUMNS = {
    "detection": [
        *(*_KEY, "size_mm", "tp", "fp", "fn"),
        *(*_BOUND["precision"], *_BOUND["recall"], "clusters"),
    ],
    "specificity": [*_KEY, "healthy", "true_negatives", *_BOUND["specificity"], "clusters"],
    "sizing": [
        *(*_KEY, "size_mm", "recordings", "exact", *_RATES["exact_rate"]),
        *("within", *_RATES["within_rate"], "one_sided", "mean_absolute_error_mm", "clusters"),
    ],
    "confusion": [*_KEY, "size_mm", "predicted_mm", "count", *_RATES["share"]],
}
# Under these, the place is left out, or nothing; under any other one, whole set-ups may be.
_OVER_PLACES = (LEAVE_ONE_OUT, RESUBSTITUTION)


def interval_columns(name: str, values: Interval) -> dict[str, float]:
    """Return a value and its interval's ends as ``name``, ``name_low`` and ``name_high``."""
    return dict(zip((name, f"{name}_low", f"{name}_high"), values, strict=True))


def rate_columns(
    name: str, rows: pd.DataFrame, right: pd.Series | BoolArray, confidence: float
) -> dict[str, float]:
    """Return the share of right verdicts and its Wilson interval over clusters.

    Parameters
    ----------
    name : str
        Names the columns, as in `interval_columns`.
    rows : DataFrame
        The n recordings, from `of_each`.
    right : (n,) array of bool
        Which are right; the others are failures.
    confidence : float
        Level of the interval.
    """
    return interval_columns(name, rate_of(np.asarray(right), clusters_of(rows), confidence))


def bounded_columns(
    name: str, rows: pd.DataFrame, right: pd.Series | BoolArray, confidence: float
) -> dict[str, float]:
    """Return the columns of `rate_columns`, and `lower_bound` as ``name_at_least``."""
    columns = rate_columns(name, rows, right, confidence)
    return columns | {f"{name}_at_least": lower_bound(np.asarray(right), clusters_of(rows))}


def is_within(
    predicted_mm: FloatArray | float, true_mm: FloatArray | float, tolerance_mm: float
) -> BoolArray:
    """Return whether a predicted size is within the tolerance; never true for a missed nodule."""
    # A little more, for rounding: 2.3 mm must lie within 0.2 mm of 2.5 mm.
    near = np.abs(predicted_mm - true_mm) <= tolerance_mm + 1e-9
    return (np.asarray(predicted_mm) > 0) & near


def with_clusters(
    predictions: pd.DataFrame, index: Mapping[str, Mapping[str, str]] | None
) -> pd.DataFrame:
    """Return predictions with the place and the set-up of each recording, in the index's order.

    Parameters
    ----------
    predictions : DataFrame
        results/evaluation/predictions.csv.
    index : mapping of str to mapping, optional
        Rows of results/recordings.csv. If not given, each recording is a place of its own.

    Returns
    -------
    DataFrame
        With ``place`` and ``setup``, whole numbers. The set-up is -1 if the header names none, or
        if the scheme leaves out places at most.
    """
    if index is None:
        of_scheme = predictions.groupby(_KEY, sort=False).cumcount()
        return predictions.assign(place=of_scheme, setup=-1)
    turn = {name: number for number, name in enumerate(index)}
    places, setups = places_of(index), {name: row.get("setup") for name, row in index.items()}
    numbers = {name: number for number, name in enumerate(dict.fromkeys(setups.values())) if name}
    named = predictions["recording"]
    joined = predictions.assign(
        place=[turn[places[name]] for name in named],
        setup=[numbers.get(setups[name] or "", -1) for name in named],
    )
    joined.loc[joined["scheme"].isin(_OVER_PLACES), "setup"] = -1
    return joined.iloc[np.argsort([turn[name] for name in named], kind="stable")]


def cluster_unit(*kinds: pd.DataFrame) -> str:
    """Return the column with the clusters of a measure: what the next archive draws anew.

    It is the set-up, if every recording has one and each kind has at least three. It is the place
    otherwise.

    Parameters
    ----------
    *kinds : DataFrame
        The recordings of each rate that the measure is made of.
    """
    for rows in kinds:
        setups = rows["setup"].to_numpy()
        if (setups < 0).any() or np.unique(setups).size < FEWEST_CLUSTERS:
            return "place"
    return "setup"


def clusters_of(rows: pd.DataFrame) -> IntArray:
    """Return the cluster of each recording of a rate, as in `cluster_unit`."""
    clusters: IntArray = rows[cluster_unit(rows)].to_numpy()
    return clusters


def cluster_count(rows: pd.DataFrame) -> int:
    """Return the number of clusters, on which the intervals of a row of a table rest."""
    return int(np.unique(clusters_of(rows)).size)


def of_each(
    predictions: pd.DataFrame, index: Mapping[str, Mapping[str, str]] | None = None
) -> Iterator[tuple[Cells, pd.DataFrame]]:
    """Yield the verdicts of each detector under each scheme, if it gave any.

    Parameters
    ----------
    predictions, index
        As in `with_clusters`.

    Yields
    ------
    key : dict of str to str
        ``detector`` and ``scheme``.
    rows : DataFrame
        The columns of numbers, with ``place`` and ``setup``, by recording.
    """
    if predictions.empty:
        return
    joined = with_clusters(predictions, index)
    if "recording" in joined:
        joined = joined.set_index("recording")
    schemes = list(dict.fromkeys(predictions["scheme"]))
    for detector in predictions["detector"].unique():
        for scheme in sorted(schemes, key=_turn_of):
            rows = joined[(joined["detector"] == detector) & (joined["scheme"] == scheme)]
            if rows["predicted_mm"].notna().any():
                yield {"detector": detector, "scheme": scheme}, rows.select_dtypes("number")


def _turn_of(scheme: str) -> int:
    """Return the turn of a scheme in a table: what was held out first, what was learned last."""
    return {HELD_OUT: 0, LEAVE_ONE_OUT: 1, RESUBSTITUTION: 3}.get(scheme, 2)


def detection_table(
    rows: pd.DataFrame, sizes_mm: Sequence[float], confidence: float
) -> Iterator[Cells]:
    """Yield precision and recall of every nodule size b, with intervals.

    Only these definitions give the paper's numbers. TP: recordings of size b in which any nodule is
    detected. FN: recordings of size b in which none is detected. FP: recordings without a nodule
    whose predicted size is exactly b.
    """
    true_mm, predicted_mm = rows["size_mm"], rows["predicted_mm"]
    for size_mm in sizes_mm:
        of_size, detected = true_mm == size_mm, predicted_mm > 0
        hit, alarm = of_size & detected, (true_mm == 0) & (predicted_mm == size_mm)
        row: Cells = {"size_mm": size_mm, "tp": int(hit.sum()), "fp": int(alarm.sum())}
        row["fn"] = int((of_size & ~detected).sum())
        positive = hit | alarm
        row |= bounded_columns("precision", rows[positive], hit[positive], confidence)
        row |= bounded_columns("recall", rows[of_size], hit[of_size], confidence)
        yield row | {"clusters": cluster_count(rows[of_size])}


def specificity_row(rows: pd.DataFrame, confidence: float) -> Cells:
    """Return the share of recordings without a nodule in which none is detected."""
    healthy = rows[rows["size_mm"] == 0]
    right = healthy["predicted_mm"] == 0
    row: Cells = {"healthy": len(healthy), "true_negatives": int(right.sum())}
    row |= bounded_columns("specificity", healthy, right, confidence)
    return row | {"clusters": cluster_count(healthy)}


def sizing_table(
    rows: pd.DataFrame, sizes_mm: Sequence[float], tolerance_mm: float, confidence: float
) -> Iterator[Cells]:
    """Yield the rates of exact sizes and of sizes within the tolerance, for every nodule size.

    A recording in which no nodule is detected has no size, so it is never within the tolerance. In
    the mean absolute error it counts as 0 mm. So does a recording without a verdict. ``one_sided``
    marks the sizes whose tolerance reaches past the largest or the smallest template.

    Parameters
    ----------
    rows : DataFrame
        From `of_each`.
    sizes_mm : sequence of float
        The nodule sizes that have templates.
    tolerance_mm : float
        Allowed error of the size in mm.
    confidence : float
        Level of the intervals.
    """
    for size_mm in sizes_mm:
        of_size = rows[rows["size_mm"] == size_mm]
        predicted = of_size["predicted_mm"].fillna(0.0).to_numpy(dtype=np.float64)
        error = np.abs(predicted - size_mm)
        row = {"size_mm": size_mm, "recordings": error.size}
        within = is_within(predicted, size_mm, tolerance_mm)
        for name, right in (("exact", error == 0), ("within", within)):
            row[name] = int(right.sum())
            row |= rate_columns(f"{name}_rate", of_size, right, confidence)
        row["one_sided"] = bool(
            size_mm + tolerance_mm > max(sizes_mm) or size_mm - tolerance_mm < min(sizes_mm)
        )
        row["mean_absolute_error_mm"] = float(error.mean()) if error.size else float("nan")
        yield row | {"clusters": cluster_count(of_size)}


def confusion_table(
    rows: pd.DataFrame, sizes_mm: Sequence[float], confidence: float
) -> Iterator[Cells]:
    """Yield count and share of each predicted size for each true size, including no nodule.

    If any recording has no verdict, each size has a row for these, whose predicted size is NaN.
    """
    unknown = rows["predicted_mm"].isna().any()
    for actual in sizes_mm:
        of_size = rows[rows["size_mm"] == actual]
        for predicted in [*sizes_mm, *([float("nan")] if unknown else [])]:
            given = of_size["predicted_mm"]
            taken = given.isna() if np.isnan(predicted) else given == predicted
            row: Cells = {"size_mm": actual, "predicted_mm": predicted, "count": int(taken.sum())}
            yield row | rate_columns("share", of_size, taken, confidence)


def rate_tables(
    predictions: pd.DataFrame,
    sizes_mm: Sequence[float],
    rules: Settings,
    index: Mapping[str, Mapping[str, str]] | None = None,
) -> dict[str, pd.DataFrame]:
    """Return every table of rates, with detector and scheme in each row.

    Parameters
    ----------
    predictions : DataFrame
        Rows with ``recording``, ``detector``, ``scheme``, ``size_mm`` and ``predicted_mm`` (NaN
        without a verdict).
    sizes_mm : sequence of float
        Sizes that have a template, including 0.
    rules : mapping
        ``tolerance_mm``, the allowed error of the size in mm, and ``confidence``, the level of the
        intervals.
    index : mapping of str to mapping, optional
        As in `with_clusters`.

    Returns
    -------
    dict of str to DataFrame
        ``detection``, ``specificity``, ``sizing`` and ``confusion``.
    """
    nodules, confidence = [size for size in sizes_mm if size > 0], rules["confidence"]
    result: dict[str, list[Cells]] = {name: [] for name in COLUMNS}
    for key, rows in of_each(predictions, index):
        made: dict[str, Iterable[Cells]] = {
            "detection": detection_table(rows, nodules, confidence),
            "specificity": [specificity_row(rows, confidence)],
            "sizing": sizing_table(rows, nodules, rules["tolerance_mm"], confidence),
            "confusion": confusion_table(rows, sizes_mm, confidence),
        }
        for name, table in made.items():
            result[name] += [key | row for row in table]
    return {name: pd.DataFrame(made, columns=COLUMNS[name]) for name, made in result.items()}
