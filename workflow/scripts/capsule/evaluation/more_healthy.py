"""Foresee how many nodules a detector finds once further healthy places also set its threshold.

A learned threshold is the score of a rank among the healthy places
(`capsule.detectors.calibrate.rank_threshold`). Among few places, this is the largest score or
nearly so, and much of it is luck. A nodule is found if enough of the healthy places score below it.
How many of the further places will do so is binomial, with the chance that one of them does. This
chance follows from a normal distribution. Its mean and deviation are those of the present scores,
with the uncertainty that their number leaves. docs/intervals.md tells how far this holds.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.detectors.calibrate import place_weights, rank_threshold

# Probability of the range of thresholds behind `MoreHealthy.low` and `MoreHealthy.high`.
RANGE = 0.9
# Equally likely values that stand for the deviation, and as many for the mean.
_VALUES = 20
# As in `capsule.detectors.calibrate.upper_quantile`, for products such as 20 x 0.95.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class MoreHealthy:
    """The share of nodules that a detector finds.

    Attributes
    ----------
    now : float
        With its present threshold.
    expected : float
        The mean with a threshold from the present and the further places.
    low, high : float
        Its range over the thresholds that the further places may give, with a probability of
        `RANGE`; and one nodule fewer or more, since the further places also teach the detector.
    """

    now: float
    expected: float
    low: float
    high: float


def with_more_healthy(
    scores: FloatArray, places: IntArray, margins: FloatArray, more: int, specificity: float
) -> MoreHealthy | None:
    """Foresee the share of nodules found with a threshold from more healthy places.

    The further places have one pass each, and are like the present ones. What they teach the
    detector besides the threshold is not foreseen.

    Parameters
    ----------
    scores : (n,) array
        Cross-validated scores of the healthy recordings.
    places : (n,) array of int
        The place of each.
    margins : (N,) array
        Cross-validated score of each nodule minus its threshold. NaN is never found.
    more : int
        Number of further healthy places.
    specificity : float
        The wanted specificity, such as 0.95.

    Returns
    -------
    MoreHealthy or None
        None without a nodule, if the healthy scores do not vary, or if there are too few healthy
        places for any of their scores to promise the specificity: fewer than 19 for 95 %.
    """
    weights = place_weights(places)
    count = round(float(weights.sum()))
    if margins.size == 0 or count < (count + 1) * specificity - _ROUNDING or np.ptp(scores) == 0:
        return None
    nodules = margins + rank_threshold(scores, places, specificity)
    below = np.array([weights[scores < nodule].sum() for nodule in nodules])
    needed = (count + more + 1) * specificity - below - _ROUNDING
    found = np.zeros(margins.size)
    known = ~np.isnan(margins)
    found[known] = _chances(nodules[known], scores, weights, needed[known], more)
    tail, one = (1 - RANGE) / 2, 1 / margins.size
    return MoreHealthy(
        float(np.mean(margins > 0)),
        float(found.mean()),
        max(float(np.mean(found >= 1 - tail)) - one, 0.0),
        min(float(np.mean(found > tail)) + one, 1.0),
    )


def _chances(
    nodules: FloatArray, scores: FloatArray, weights: FloatArray, needed: FloatArray, more: int
) -> FloatArray:
    """Return the chance of each nodule that at least as many further places as needed lie below."""
    # Imported late: it takes longer than most jobs.
    from scipy.special import bdtrc, chdtri, ndtr, ndtri

    count = weights.sum()
    centre = np.average(scores, weights=weights)
    deviation = np.sqrt(weights @ (scores - centre) ** 2 / (count - 1))
    middles = (np.arange(_VALUES) + 0.5) / _VALUES
    # The posterior distribution of a normal one's deviation and mean, without prior knowledge.
    deviations = deviation * np.sqrt((count - 1) / chdtri(count - 1, middles))[:, None]
    centres = centre + deviations * ndtri(middles) / count**0.5
    lies_below = ndtr((nodules[:, None, None] - centres) / deviations)
    # The binomial distribution function, above a number of places; all numbers are above -1.
    others = np.ceil(needed)[:, None, None] - 1
    chances: FloatArray = np.where(
        others < 0, 1.0, bdtrc(np.clip(others, 0, more), more, lies_below)
    ).mean(axis=(1, 2))
    return chances
