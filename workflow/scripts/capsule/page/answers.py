"""The answer on the first screen: what the system can do on these recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from capsule.evaluation.rates import rate


@dataclass(frozen=True)
class Estimate:
    """A value with its interval; NaN where there is nothing to count.

    Attributes
    ----------
    value, low, high : float
        The value and the bounds of its interval.
    hits, of : int
        The counts behind a rate; of a mean, ``of`` is how many values were averaged.
    """

    value: float
    low: float
    high: float
    hits: int
    of: int


def smallest_reliable_size(detection: pd.DataFrame, level: float) -> float | None:
    """Find the smallest size from which on every size is reliably found.

    Parameters
    ----------
    detection : DataFrame
        Precision and recall per size, of one detector and scheme.
    level : float
        What precision and recall must both reach, there and at every larger size.

    Returns
    -------
    float or None
        Size in mm; None where not even the largest size is reliably found, or where a size has
        no recording.
    """
    smallest = None
    for _, row in detection.sort_values("size_mm", ascending=False).iterrows():
        # A comparison with NaN is false: an unknown rate is not reliable.
        if not min(row["precision"], row["recall"]) >= level - 1e-9:
            break
        if np.isnan(row["precision"]) or np.isnan(row["recall"]):
            break
        smallest = float(row["size_mm"])
    return smallest


def within_tolerance(
    sizing: pd.DataFrame, confidence: float, sizes_mm: Sequence[float] | None = None
) -> Estimate:
    """Pool the within-tolerance rates of several sizes.

    Parameters
    ----------
    sizing : DataFrame
        The rates per size, of one detector and scheme.
    confidence : float
        Level of the Wilson interval.
    sizes_mm : sequence of float, optional
        The sizes to pool; all of them if not given.

    Returns
    -------
    Estimate
    """
    rows = sizing if sizes_mm is None else sizing[sizing["size_mm"].isin(sizes_mm)]
    hits, of = int(rows["within"].sum()), int(rows["recordings"].sum())
    return Estimate(*rate(hits, of, confidence), hits, of)


def mean_size_error(predictions: pd.DataFrame, confidence: float) -> Estimate:
    """Average the absolute error of the size over all recordings of nodules.

    A recording in which no nodule is detected counts as 0 mm.

    Parameters
    ----------
    predictions : DataFrame
        True and predicted sizes, of one detector and scheme.
    confidence : float
        Level of Student's interval of the mean.

    Returns
    -------
    Estimate
        In mm; the lower bound is never below 0.
    """
    nodules = predictions[predictions["size_mm"] > 0]
    errors = (nodules["predicted_mm"] - nodules["size_mm"]).abs().dropna().to_numpy()
    count = errors.size
    if count == 0:
        return Estimate(*[float("nan")] * 3, 0, 0)
    mean = float(errors.mean())
    if count == 1:
        return Estimate(mean, float("nan"), float("nan"), 0, 1)
    reach = stdtrit(count - 1, 0.5 + confidence / 2) * errors.std(ddof=1) / np.sqrt(count)
    return Estimate(mean, max(0.0, mean - float(reach)), mean + float(reach), 0, count)


def specificity(table: pd.DataFrame) -> Estimate:
    """Take the specificity out of its table's one row of a detector and scheme, if there is one."""
    if table.empty:
        return Estimate(*[float("nan")] * 3, 0, 0)
    row = table.iloc[0]
    bounds = (row["specificity"], row["specificity_low"], row["specificity_high"])
    counts = int(row["true_negatives"]), int(row["healthy"])
    return Estimate(*map(float, bounds), *counts)
