"""Predictive values: the probability that a verdict is right, at a stated prevalence."""

from capsule.evaluation.rates import interval_columns
from capsule.evaluation.ratio import ratio_interval

_UNKNOWN = (float("nan"),) * 3


def predictive_values(
    hits: int, nodules: int, rejections: int, healthy: int, prevalence: float, confidence: float
) -> dict[str, float]:
    """Return the probability that a verdict is right, at a stated prevalence.

    The experimenter chooses the prevalence of an archive. The values therefore follow from
    sensitivity and specificity by Bayes' rule: the odds of the prevalence times the ratio of two
    rates. The intervals are those of this ratio, from `ratio_interval`.

    Parameters
    ----------
    hits, nodules : int
        Number of detected nodules, and of all nodules.
    rejections, healthy : int
        Number of healthy recordings without a detection, and of all healthy recordings.
    prevalence : float
        Share of nodules among those examined.
    confidence : float
        Level of the intervals.

    Returns
    -------
    dict
        ``ppv`` and ``npv``, each with ``_low`` and ``_high``; NaN if nodules, healthy recordings or
        verdicts of this kind are missing.
    """
    positive = negative = _UNKNOWN
    if nodules and healthy:
        odds = prevalence / (1 - prevalence)
        alarms, misses = healthy - rejections, nodules - hits
        positive = _share_right(hits, nodules, alarms, healthy, odds, confidence)
        negative = _share_right(rejections, healthy, misses, nodules, 1 / odds, confidence)
    return interval_columns("ppv", positive) | interval_columns("npv", negative)


def _share_right(
    right: int, of_right: int, wrong: int, of_wrong: int, odds: float, confidence: float
) -> tuple[float, float, float]:
    """Return the probability that a verdict is right, with its interval.

    Parameters
    ----------
    right, of_right : int
        How often the verdict was given, of how many recordings for which it is right.
    wrong, of_wrong : int
        How often the verdict was given, of how many recordings for which it is wrong.
    odds : float
        Odds, before the verdict, that it is right.
    confidence : float
        Level of the interval.
    """
    if right == wrong == 0:
        return _UNKNOWN
    ratio = right * of_wrong / (of_right * wrong) if wrong else float("inf")
    low, high = ratio_interval(right, of_right, wrong, of_wrong, confidence)
    value = _share(ratio * odds)
    # Rounding in the last digit must not move an end past the value.
    return value, min(_share(low * odds), value), max(_share(high * odds), value)


def _share(odds: float) -> float:
    return 1.0 if odds == float("inf") else odds / (1 + odds)
