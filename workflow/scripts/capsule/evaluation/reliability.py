"""Whether a stated probability comes true."""

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.evaluation.prevalence import predictive_values
from capsule.kinds import Cells


def prevalence_weights(nodule: BoolArray, prevalence: float) -> FloatArray:
    """Weigh recordings so that nodules have the stated prevalence; the weights sum to 1."""
    count = np.count_nonzero(nodule)
    if count in (0, nodule.size):
        return np.full(nodule.size, np.nan)
    return np.where(nodule, prevalence / count, (1 - prevalence) / (nodule.size - count))


def brier_score(probability: FloatArray, nodule: BoolArray, prevalence: float) -> float:
    """Give the mean squared error of the probability at the stated prevalence; 0 is best."""
    weights = prevalence_weights(nodule, prevalence)
    return float(np.sum(weights * (probability - nodule) ** 2))


def calibration_table(
    probability: FloatArray, nodule: BoolArray, prevalence: float, bins: int, confidence: float
) -> list[Cells]:
    """Compare the stated probability with the frequency observed, bin by bin.

    A probability in a bin is a verdict, so the frequency of nodules behind it is a predictive
    value, with that one's interval: five nodules and no healthy recording do not prove 100 %.

    Parameters
    ----------
    probability : (n,) array
        Of a nodule, stated for the prevalence.
    nodule : (n,) array of bool
        The truth.
    prevalence : float
        To which the archive's recordings are weighted.
    bins : int
        Number of equal intervals of the probability.
    confidence : float
        Level of the intervals.

    Returns
    -------
    list of dict
        One row a bin: ``stated_low``, ``stated_high``, ``recordings``, ``stated`` (mean) and
        ``observed`` with ``_low`` and ``_high``; NaN where the bin is empty.
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
