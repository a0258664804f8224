"""The verdicts of each detector under each scheme, and the rates that the paper defines.

A rate is that of a new place: each of m passes over a place weighs 1 / m in it, as in the threshold
(`capsule.detectors.calibrate`), while counts are of recordings. Passes over one place with another
label are another place.

A recording without a verdict counts as a failure: it stays in the denominators of sensitivity,
specificity and the rates of sizes. A precision is a share of given verdicts (Schuetz et al., BMJ
345, 2012). A detector that gives no verdict at all under a scheme has no rows.
"""

from collections.abc import Iterable, Iterator
from itertools import product

import numpy as np
import pandas as pd

from capsule.arrays import BoolArray, FloatArray, RecordArray
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT, RESUBSTITUTION, Rows
from capsule.evaluation.intervals import (
    FEWEST_CLUSTERS,
    Interval,
    Units,
    lower_bound,
    mean_interval,
    median_interval,
    rate_of,
)
from capsule.kinds import Cells, Settings
from capsule.recordings.origin import places_of

ANY = None  # In place of a size, this stands for any nodule.
# What was held out comes first, what was learned last.
_TURN = {HELD_OUT: 0, LEAVE_ONE_OUT: 1, RESUBSTITUTION: 3}
# Under these, the place is left out, or nothing; under any other one, whole set-ups may be.
_OVER_PLACES = (LEAVE_ONE_OUT, RESUBSTITUTION)


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


def of_each(
    predictions: pd.DataFrame, tolerance_mm: float, index: Rows | None = None
) -> Iterator[tuple[Cells, RecordArray]]:
    """Yield the verdicts of each detector under each scheme, if it gave any.

    Parameters
    ----------
    predictions : DataFrame
        results/evaluation/predictions.csv. For the paper's rates, the columns ``detector``,
        ``scheme``, ``size_mm`` and ``predicted_mm`` are enough.
    tolerance_mm : float
        Largest error of a size within the tolerance.
    index : mapping of str to mapping, optional
        Rows of results/recordings.csv. If not given, each recording is a place of its own, and
        need not have a name.

    Yields
    ------
    key : dict of str to str
        ``detector`` and ``scheme``.
    rows : structured array
        The predictions in the index's order, without texts, with the columns of `with_clusters`
        and:

        - ``found``, ``quiet``: whether a nodule was detected, or none; ``right``: whether the one
          or the other is true. All are False without a verdict.
        - ``exact``, ``within``: whether the size of a detected nodule is right, or within the
          tolerance.
    """
    if predictions.empty:
        return
    if index is None:
        number = predictions.groupby(["detector", "scheme"], sort=False).cumcount()
        predictions, index = predictions.assign(recording=number), {name: {} for name in number}
    true_mm, predicted_mm = (predictions[f"{name}_mm"].to_numpy() for name in ("size", "predicted"))
    unknown = {name: np.nan for name in ("estimate_mm", "location_mm") if name not in predictions}
    marked = predictions.assign(
        **unknown,
        found=predicted_mm > 0,
        quiet=predicted_mm == 0,
        right=is_right(predicted_mm, true_mm),
        exact=is_within(predicted_mm, true_mm, 0.0),
        within=is_within(predicted_mm, true_mm, tolerance_mm),
    )
    marked = with_clusters(marked, index)
    places_in = marked.groupby(["detector", "scheme"]).indices
    records = np.asarray(marked.select_dtypes(["number", "bool"]).to_records(index=False))
    schemes = sorted(predictions["scheme"].unique(), key=lambda scheme: _TURN.get(scheme, 2))
    for detector, scheme in product(predictions["detector"].unique(), schemes):
        rows = records[places_in.get((detector, scheme), np.arange(0))]
        if not np.isnan(rows["predicted_mm"]).all():
            yield {"detector": detector, "scheme": scheme}, rows


def with_clusters(predictions: pd.DataFrame, index: Rows) -> pd.DataFrame:
    """Return predictions in the index's order, with what the header says of each recording.

    ``turn`` is the number in this order, and ``weight`` is 1 / m if the detector judged m passes of
    the same size at the place. ``place``, ``setup`` and ``site`` are whole numbers, too.
    The set-up is -1 if the header names none, or if the scheme leaves out places at most. A
    recording without a site is a site of its own. ``nodule_at_mm`` is the true location, NaN if it
    is unknown.
    """
    known = pd.DataFrame({"turn": range(len(index))}, index=list(index))
    known["place"] = pd.factorize(known.index.map(places_of(index)))[0]
    for name in ("setup", "site", "nodule_at_mm"):
        cells = (row.get(name) for row in index.values())
        known[name] = [None if cell == "" else cell for cell in cells]
    known["setup"] = pd.factorize(known["setup"])[0]
    known["site"] = pd.factorize(known["site"].fillna(known.index.to_series()))[0]
    known["nodule_at_mm"] = pd.to_numeric(known["nodule_at_mm"], errors="coerce")
    joined = predictions.join(known, on="recording").sort_values("turn", kind="stable")
    passes = joined.groupby(["detector", "scheme", "place", "size_mm"], dropna=False)["place"]
    over_places = joined["scheme"].isin(_OVER_PLACES)
    return joined.assign(
        weight=1.0 / passes.transform("size"), setup=joined["setup"].mask(over_places, -1)
    )


def cluster_unit(*kinds: RecordArray) -> str:
    """Return the column with the clusters of a measure: what the next archive draws anew.

    It is the set-up, if every recording has one and each kind has at least three. It is the place
    otherwise. A measure may be made of the rates of several kinds of recordings.
    """
    for rows in kinds:
        setups = rows["setup"]
        if (setups < 0).any() or np.unique(setups).size < FEWEST_CLUSTERS:
            return "place"
    return "setup"


def units_of(rows: RecordArray, unit: str = "") -> Units:
    """Return the units of the recordings of a rate; the clusters are those of `cluster_unit`."""
    return Units(rows["weight"], rows[unit or cluster_unit(rows)])


def clusters_of(rows: RecordArray) -> int:
    """Return the number of clusters of the recordings of a measure."""
    return units_of(rows).cluster_count


def rate_over(rows: RecordArray, confidence: float, mark: str = "right") -> Interval:
    """Return the share of marked recordings at a new place, and its Wilson interval.

    The recordings are rows of `of_each`. Those that are not marked are failures.
    """
    return rate_of(rows[mark], units_of(rows), confidence)


def with_ends(**values: object) -> Cells:
    """Return a row of a table; an interval becomes the columns ``name``, ``_low`` and ``_high``."""
    row: Cells = {}
    for name, value in values.items():
        if isinstance(value, tuple):
            row |= zip((name, f"{name}_low", f"{name}_high"), value, strict=True)
        else:
            row[name] = value
    return row


def cells_over(rows: RecordArray, **values: object) -> Cells:
    """Return a row of a table and the number of clusters on which its intervals rest."""
    return with_ends(**values, clusters=clusters_of(rows))


def by_size(
    rows: RecordArray, sizes_mm: Iterable[float] = ()
) -> Iterator[tuple[float | None, RecordArray]]:
    """Yield `ANY` with all recordings over nodules, and each size with its recordings.

    The sizes are those of the recordings, and the given ones.
    """
    nodules = rows[rows["size_mm"] > 0]
    yield ANY, nodules
    for size_mm in filter(None, np.union1d(list(sizes_mm), nodules["size_mm"]).tolist()):
        yield size_mm, nodules[nodules["size_mm"] == size_mm]


def of_any(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of a table that hold for any nodule, whose size is empty."""
    return table[pd.to_numeric(table["size_mm"]).isna()]


def with_value(rows: RecordArray, column: str) -> RecordArray:
    """Return the recordings that have a verdict, and a value in a column."""
    known: RecordArray = rows[~np.isnan(rows[column]) & ~np.isnan(rows["predicted_mm"])]
    return known


def detection(rows: RecordArray, rules: Settings) -> Iterator[Cells]:
    """Yield precision and recall of every size b, and of 0 mm, with intervals.

    Only these definitions give the paper's numbers. TP: recordings of size b in which any nodule is
    detected. FN: recordings of size b in which none is detected. FP: recordings without a nodule
    whose predicted size is exactly b.

    Of 0 mm, TP are the recordings without a nodule in which none is detected, and FN the others, so
    that the recall is the specificity. FP are the missed nodules.
    """
    for size_mm in rules["sizes_mm"]:
        of_size, right = rows["size_mm"] == size_mm, rows["right"]
        hit, alarm = of_size & right, (rows["predicted_mm"] == size_mm) & ~right
        named, all_of_size = rows[hit | alarm], rows[of_size]
        yield cells_over(
            all_of_size,
            size_mm=size_mm,
            tp=int(hit.sum()),
            fp=int(alarm.sum()),
            fn=int((of_size & ~right).sum()),
            precision=rate_over(named, rules["confidence"]),
            precision_at_least=lower_bound(named["right"], units_of(named)),
            recall=rate_over(all_of_size, rules["confidence"]),
            recall_at_least=lower_bound(all_of_size["right"], units_of(all_of_size)),
        )


def sizing(rows: RecordArray, rules: Settings) -> Iterator[Cells]:
    """Yield how right sizes and locations are, for any nodule and for each size.

    Of all recordings, ``exact`` and ``within`` are those of a right size. A recording in which no
    nodule is detected has no size, so it is never within the tolerance. In
    ``mean_absolute_error_mm`` it counts as 0 mm. So does a recording without a verdict.
    ``one_sided`` marks the sizes whose tolerance reaches past the largest or the smallest template.

    Bias and absolute error are those of the estimated sizes of the ``detected`` nodules. Those of
    the location, of which the median error is taken, are of the ``located`` ones: detected nodules
    whose position the header has.
    """
    level, tolerance_mm = rules["confidence"], rules["tolerance_mm"]
    templates_mm = [*filter(None, rules["sizes_mm"])]
    smallest_mm, largest_mm = min(templates_mm, default=np.nan), max(templates_mm, default=np.nan)
    for size_mm, nodules in by_size(rows, templates_mm):
        row: Cells = {"size_mm": size_mm, "recordings": len(nodules)}
        for mark in ("exact", "within"):
            row[mark] = int(nodules[mark].sum())
            row[f"{mark}_rate"] = rate_over(nodules, level, mark)
        row["one_sided"] = size_mm is not ANY and bool(
            size_mm - tolerance_mm < smallest_mm or size_mm + tolerance_mm > largest_mm
        )
        error = np.nan_to_num(nodules["predicted_mm"]) - nodules["size_mm"]
        row["mean_absolute_error_mm"] = _absolute_error(error, nodules, level)
        detected = with_value(nodules, "estimate_mm")
        error = detected["estimate_mm"] - detected["size_mm"]
        row |= {"detected": len(detected), "detected_clusters": clusters_of(detected)}
        row["bias_mm"] = mean_interval(error, units_of(detected), level)
        row["absolute_error_mm"] = _absolute_error(error, detected, level)
        error = nodules["location_mm"] - nodules["nodule_at_mm"]
        of_located = nodules["found"] & ~np.isnan(error)
        located, error = nodules[of_located], error[of_located]
        row |= {"located": len(located), "located_clusters": clusters_of(located)}
        row["location_error_mm"] = median_interval(np.abs(error), units_of(located), level)
        row["location_bias_mm"] = mean_interval(error, units_of(located), level)
        yield cells_over(nodules, **row)


def _absolute_error(error: FloatArray, rows: RecordArray, confidence: float) -> Interval:
    """Return the mean absolute error with its interval, which does not reach below 0."""
    value, low, high = mean_interval(np.abs(error), units_of(rows), confidence)
    # NaN stays NaN as the first argument.
    return value, max(low, 0.0), high


def confusion(rows: RecordArray, rules: Settings) -> Iterator[Cells]:
    """Yield count and share of each predicted size for each true size, including no nodule.

    If any recording has no verdict, each size has a row for these, whose predicted size is NaN.
    """
    unknown = [np.nan] if np.isnan(rows["predicted_mm"]).any() else []
    for size_mm in rules["sizes_mm"]:
        of_size = rows[rows["size_mm"] == size_mm]
        units, predicted = units_of(of_size), of_size["predicted_mm"]
        for predicted_mm in [*rules["sizes_mm"], *unknown]:
            taken = np.isnan(predicted) if np.isnan(predicted_mm) else predicted == predicted_mm
            counts = {"predicted_mm": predicted_mm, "count": int(taken.sum())}
            share = rate_of(taken, units, rules["confidence"])
            yield with_ends(size_mm=size_mm, **counts, share=share)
