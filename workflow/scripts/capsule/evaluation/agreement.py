"""Statistical tests of whether one detector is better than another one, or than chance."""

from math import comb

import numpy as np

from capsule.arrays import BoolArray, FloatArray


def paired_difference(
    first_right: BoolArray, second_right: BoolArray, confidence: float
) -> dict[str, float]:
    """Compare two detectors on the same recordings.

    Parameters
    ----------
    first_right, second_right : (n,) array of bool
        True for each recording that the detector judges correctly.
    confidence : float
        Level of the interval.

    Returns
    -------
    dict
        ``only_first``, ``only_second``: numbers of recordings that only this detector judges
        correctly. ``difference`` of the rates, second minus first, with ``_low`` and ``_high``
        (Wald interval with one recording added to both counts, Bonett and Price 2012; widened if
        it does not contain the difference). ``mcnemar_p``: exact two-sided probability of counts
        at least this unequal if neither detector is better.
    """
    count = first_right.size
    only_first = int(np.sum(first_right & ~second_right))
    only_second = int(np.sum(second_right & ~first_right))
    result: dict[str, float] = {"only_first": only_first, "only_second": only_second}
    if count == 0:
        unknown = ("difference", "difference_low", "difference_high", "mcnemar_p")
        return result | dict.fromkeys(unknown, float("nan"))
    # Imported late: it takes longer than most jobs, and not every user of this module needs it.
    from scipy.special import ndtri

    first, second = (only_first + 1) / (count + 2), (only_second + 1) / (count + 2)
    z = ndtri(0.5 + confidence / 2)
    reach = z * np.sqrt((first + second - (second - first) ** 2) / (count + 2))
    difference = (only_second - only_first) / count
    result["difference"] = difference
    result["difference_low"] = min(float(max(second - first - reach, -1.0)), difference)
    result["difference_high"] = max(float(min(second - first + reach, 1.0)), difference)
    result["mcnemar_p"] = _sign_test(only_first, only_second)
    return result


def _sign_test(first: int, second: int) -> float:
    """Return the two-sided probability of counts this unequal if both cases are equally likely."""
    if first == second:
        return 1.0
    count, fewer = first + second, min(first, second)
    chance: float = 2 * sum(comb(count, k) for k in range(fewer + 1)) / 2**count
    return chance


def _ranks(scores: FloatArray) -> FloatArray:
    """Return the ranks of scores, from 1; equal scores share the mean of their ranks."""
    _, value_of, count = np.unique(scores, return_inverse=True, return_counts=True)
    last = np.cumsum(count)
    return (last - (count - 1) / 2)[value_of]


def permuted_areas(
    scores: FloatArray, nodule: BoolArray, generator: np.random.Generator, repeats: int
) -> FloatArray:
    """Return the areas under the curve for randomly permuted labels, (n,)."""
    # The area follows from the sum of the nodules' ranks (Mann and Whitney), so one sort of the
    # scores is enough.
    ranks = _ranks(scores)
    count = int(np.count_nonzero(nodule))
    sums = np.array([generator.permutation(ranks)[:count].sum() for _ in range(repeats)])
    return (sums - count * (count + 1) / 2) / (count * (nodule.size - count))


def exceedance(observed: float, by_chance: FloatArray) -> float:
    """Return the share of chance results that reach the observed one, which is included."""
    return float((1 + np.sum(by_chance >= observed)) / (1 + by_chance.size))
