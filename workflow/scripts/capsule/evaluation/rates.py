"""The rates of correct verdicts, as the paper defines them, with intervals.

A recording without a verdict counts as a failure: it stays in the denominators of sensitivity,
specificity and the rates of sizes. A precision is a share of given verdicts (Schuetz et al., BMJ
345, 2012). A detector that gives no verdict at all under a scheme has no rows.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pandas as pd

from capsule.arrays import BoolArray, FloatArray, IntArray
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT, RESUBSTITUTION, Rows
from capsule.evaluation.intervals import FEWEST_CLUSTERS, Interval, lower_bound, rate_of
from capsule.held_out import places_of
from capsule.kinds import Cells, Settings

_KEY = ("detector", "scheme")


def _with_ends(name: str, *further: str) -> list[str]:
    return [name, f"{name}_low", f"{name}_high", *further]


# The columns of every table; a table without rows has them too.
COLUMNS = {
    "detection": [
        *(*_KEY, "size_mm", "tp", "fp", "fn"),
        *_with_ends("precision", "precision_at_least"),
        *_with_ends("recall", "recall_at_least", "clusters"),
    ],
    "specificity": [
        *(*_KEY, "healthy", "true_negatives"),
        *_with_ends("specificity", "specificity_at_least", "clusters"),
    ],
    "sizing": [
        *(*_KEY, "size_mm", "recordings", "exact", *_with_ends("exact_rate"), "within"),
        *_with_ends("within_rate", "one_sided", "mean_absolute_error_mm", "clusters"),
    ],
    "confusion": [*_KEY, "size_mm", "predicted_mm", "count", *_with_ends("share")],
}
# Under these, the place is left out, or nothing; under any other one, whole set-ups may be.
_OVER_PLACES = (LEAVE_ONE_OUT, RESUBSTITUTION)


def interval_columns(**values: Interval) -> dict[str, float]:
    """Return each value and its interval's ends as ``name``, ``name_low`` and ``name_high``."""
    return {
        column: end
        for name, interval in values.items()
        for column, end in zip(_with_ends(name), interval, strict=True)
    }


def rate_over(rows: pd.DataFrame, right: pd.Series | BoolArray, confidence: float) -> Interval:
    """Return the share of right verdicts and its Wilson interval over clusters.

    The recordings are rows of `of_each`. Right ones are marked; the others are failures.
    """
    return rate_of(np.asarray(right), clusters_of(rows), confidence)


def _bounded(
    name: str, rows: pd.DataFrame, right: pd.Series, confidence: float
) -> dict[str, float]:
    """Return the columns of `rate_over`, and `lower_bound` as ``name_at_least``."""
    columns = interval_columns(**{name: rate_over(rows, right, confidence)})
    return columns | {f"{name}_at_least": lower_bound(right.to_numpy(), clusters_of(rows))}


def is_right(predicted_mm: FloatArray, true_mm: FloatArray) -> BoolArray:
    """Return which verdicts (nodule or none) are right; never true without a verdict."""
    right: BoolArray = np.where(true_mm > 0, predicted_mm > 0, predicted_mm == 0)
    return right


def is_within(
    predicted_mm: FloatArray | float, true_mm: FloatArray | float, tolerance_mm: float
) -> BoolArray:
    """Return whether a predicted size is within the tolerance; never true for a missed nodule."""
    # A little more, for rounding: 2.3 mm must lie within 0.2 mm of 2.5 mm.
    near = np.abs(predicted_mm - true_mm) <= tolerance_mm + 1e-9
    return (np.asarray(predicted_mm) > 0) & near


def cluster_unit(*kinds: pd.DataFrame) -> str:
    """Return the column with the clusters of a measure: what the next archive draws anew.

    It is the set-up, if every recording has one and each kind has at least three. It is the place
    otherwise. A measure may be made of the rates of several kinds of recordings.
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
    predictions: pd.DataFrame, index: Rows | None = None
) -> Iterator[tuple[Cells, pd.DataFrame]]:
    """Yield the verdicts of each detector under each scheme, if it gave any.

    Parameters
    ----------
    predictions : DataFrame
        results/evaluation/predictions.csv.
    index : mapping of str to mapping, optional
        Rows of results/recordings.csv. If not given, each recording is a place of its own, and
        need not have a name.

    Yields
    ------
    key : dict of str to str
        ``detector`` and ``scheme``.
    rows : DataFrame
        The columns of numbers by recording, in the index's order, and:

        - ``found``, ``quiet``: whether a nodule was detected, or none; ``right``: whether the one
          or the other is true. All are False without a verdict.
        - ``place``, ``setup``: from `with_clusters`.
    """
    if predictions.empty:
        return
    true_mm, predicted_mm = (predictions[f"{name}_mm"].to_numpy() for name in ("size", "predicted"))
    found, quiet, right = predicted_mm > 0, predicted_mm == 0, is_right(predicted_mm, true_mm)
    marked = with_clusters(predictions.assign(found=found, quiet=quiet, right=right), index)
    if index is not None:
        marked = marked.set_index("recording")
    # What was held out comes first, what was learned last.
    turn = {HELD_OUT: 0, LEAVE_ONE_OUT: 1, RESUBSTITUTION: 3}
    schemes = sorted(predictions["scheme"].unique(), key=lambda scheme: turn.get(scheme, 2))
    for detector in predictions["detector"].unique():
        for scheme in schemes:
            rows = marked[(marked["detector"] == detector) & (marked["scheme"] == scheme)]
            if rows["predicted_mm"].notna().any():
                key = {"detector": detector, "scheme": scheme}
                yield key, rows.select_dtypes(["number", "bool"])


def with_clusters(predictions: pd.DataFrame, index: Rows | None) -> pd.DataFrame:
    """Return predictions with the place and the set-up of each recording, in the index's order.

    Both are whole numbers. The set-up is -1 if the header names none, or if the scheme leaves out
    places at most. For the parameters see `of_each`.
    """
    if index is None:
        number = predictions.groupby([*_KEY], sort=False).cumcount()
        return predictions.assign(place=number, setup=-1)
    turn = {name: number for number, name in enumerate(index)}
    setups = pd.factorize(np.array([row.get("setup") or None for row in index.values()], object))[0]
    named, over_places = predictions["recording"], predictions["scheme"].isin(_OVER_PLACES)
    joined = predictions.assign(
        turn=named.map(turn),
        place=named.map(places_of(index)).map(turn),
        setup=named.map(dict(zip(index, setups, strict=True))).mask(over_places, -1),
    )
    return joined.sort_values("turn", kind="stable")


def detection_table(
    rows: pd.DataFrame, sizes_mm: Sequence[float], confidence: float
) -> Iterator[Cells]:
    """Yield precision and recall of every nodule size b, with intervals.

    Only these definitions give the paper's numbers. TP: recordings of size b in which any nodule is
    detected. FN: recordings of size b in which none is detected. FP: recordings without a nodule
    whose predicted size is exactly b.
    """
    for size_mm in sizes_mm:
        of_size = rows["size_mm"] == size_mm
        hit = of_size & rows["found"]
        alarm = (rows["size_mm"] == 0) & (rows["predicted_mm"] == size_mm)
        row: Cells = {"size_mm": size_mm, "tp": int(hit.sum()), "fp": int(alarm.sum())}
        row["fn"] = int((of_size & ~hit).sum())
        for name, counted in (("precision", hit | alarm), ("recall", of_size)):
            row |= _bounded(name, rows[counted], hit[counted], confidence)
        yield row | {"clusters": cluster_count(rows[of_size])}


def specificity_row(rows: pd.DataFrame, confidence: float) -> Cells:
    """Return the share of recordings without a nodule in which none is detected."""
    healthy = rows[rows["size_mm"] == 0]
    row: Cells = {"healthy": len(healthy), "true_negatives": int(healthy["quiet"].sum())}
    row |= _bounded("specificity", healthy, healthy["quiet"], confidence)
    return row | {"clusters": cluster_count(healthy)}


def sizing_table(
    rows: pd.DataFrame, sizes_mm: Sequence[float], tolerance_mm: float, confidence: float
) -> Iterator[Cells]:
    """Yield the rates of exact sizes and of sizes within the tolerance, for every nodule size.

    A recording in which no nodule is detected has no size, so it is never within the tolerance. In
    the mean absolute error it counts as 0 mm. So does a recording without a verdict. ``one_sided``
    marks the sizes whose tolerance reaches past the largest or the smallest template.
    """
    for size_mm in sizes_mm:
        of_size = rows[rows["size_mm"] == size_mm]
        predicted = of_size["predicted_mm"].fillna(0.0).to_numpy(dtype=np.float64)
        error = np.abs(predicted - size_mm)
        row: Cells = {"size_mm": size_mm, "recordings": error.size}
        within = is_within(predicted, size_mm, tolerance_mm)
        for name, right in (("exact", error == 0), ("within", within)):
            rate = rate_over(of_size, right, confidence)
            row |= {name: int(right.sum()), **interval_columns(**{f"{name}_rate": rate})}
        ends = size_mm - tolerance_mm, size_mm + tolerance_mm
        row["one_sided"] = bool(ends[0] < min(sizes_mm) or ends[1] > max(sizes_mm))
        row["mean_absolute_error_mm"] = float(error.mean()) if error.size else float("nan")
        yield row | {"clusters": cluster_count(of_size)}


def confusion_table(
    rows: pd.DataFrame, sizes_mm: Sequence[float], confidence: float
) -> Iterator[Cells]:
    """Yield count and share of each predicted size for each true size, including no nodule.

    If any recording has no verdict, each size has a row for these, whose predicted size is NaN.
    """
    unknown = [float("nan")] if rows["predicted_mm"].isna().any() else []
    for actual in sizes_mm:
        of_size = rows[rows["size_mm"] == actual]
        for predicted in [*sizes_mm, *unknown]:
            given = of_size["predicted_mm"]
            taken = given.isna() if np.isnan(predicted) else given == predicted
            row: Cells = {"size_mm": actual, "predicted_mm": predicted, "count": int(taken.sum())}
            yield row | interval_columns(share=rate_over(of_size, taken, confidence))


def rate_tables(
    predictions: pd.DataFrame,
    sizes_mm: Sequence[float],
    rules: Settings,
    index: Rows | None = None,
) -> dict[str, pd.DataFrame]:
    """Return the tables named in `COLUMNS`, with detector and scheme in each row.

    Parameters
    ----------
    predictions, index
        As in `of_each`. Of the verdict, ``predicted_mm`` is enough.
    sizes_mm : sequence of float
        Sizes that have a template, including 0.
    rules : mapping
        ``tolerance_mm``, the allowed error of the size, and ``confidence``, the intervals' level.
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
