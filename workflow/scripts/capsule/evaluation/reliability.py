"""Calibration: the agreement of stated probabilities with observed frequencies."""

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.evaluation.prevalence import predictive_values
from capsule.kinds import Cells


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


def calibration_table(
    probability: FloatArray, nodule: BoolArray, prevalence: float, bins: int, confidence: float
) -> list[Cells]:
    """Return the stated probability and the observed frequency of nodules in each bin.

    A probability in a bin is treated as a verdict. The frequency of nodules in the bin is then a
    predictive value with its interval: five nodules and no healthy recording do not prove 100 %.

    Parameters
    ----------
    probability : (n,) array
        Stated probability of a nodule, at the prevalence.
    nodule : (n,) array of bool
        True for recordings with a nodule.
    prevalence : float
        Prevalence to which the recordings are weighted.
    bins : int
        Number of equal intervals of the probability.
    confidence : float
        Level of the intervals.

    Returns
    -------
    list of dict
        One row for each bin: ``stated_low``, ``stated_high``, ``recordings``, ``stated`` (mean)
        and ``observed`` with ``_low`` and ``_high``; NaN if the bin is empty.
    """
    bin_of = np.minimum((probability * bins).astype(int), bins - 1)
    weights = prevalence_weights(nodule, prevalence)
    nodules, healthy = int(np.count_nonzero(nodule)), int(np.count_nonzero(~nodule))
    rows = []
    for index in range(bins):
        inside = bin_of == index
        hits, alarms = int(np.sum(inside & nodule)), int(np.sum(inside & ~nodule))
        values = predictive_values(hits, nodules, healthy - alarms, healthy, prevalence, confidence)
        total = weights[inside].sum()
        stated = (weights * probability)[inside].sum() / total if total > 0 else np.nan
        rows.append(
            {
                "stated_low": index / bins,
                "stated_high": (index + 1) / bins,
                "recordings": int(inside.sum()),
                "stated": float(stated),
                "observed": values["ppv"],
                "observed_low": values["ppv_low"],
                "observed_high": values["ppv_high"],
            }
        )
    return rows
