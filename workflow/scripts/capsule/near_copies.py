"""Search for near-copies: one run with a changed sample, rows cut off or another unit.

If one near-copy teaches a detector, the verdict on the other one is not independent. Comparing all
pairs of thousands of recordings reading by reading takes too long. Short fingerprints therefore
choose the pairs first.
"""

from collections.abc import Callable, Mapping, Sequence
from statistics import median

import numpy as np

from capsule.arrays import FloatArray, IntArray

# One mark of the fingerprint is the pattern of 2^5 = 32 successive rises and falls.
_DOUBLINGS = 5
# Only marks are kept whose hash is divisible by this.
_KEPT_OF = 8
# Two recordings of one run share at least this part of the marks of the shorter list.
_SHARED_MARKS = 0.25
# Two recordings hold the same run if the median correlation over this many sections is at least
# _SAME. Two runs over the same place stay far below it, because their noise differs.
_SECTIONS = 8
_SAME = 0.99
# Smallest part of the shorter recording that must overlap the other.
_LEAST_OVERLAP = 0.5
# In robust spreads. Clipping keeps one wild reading from hiding the rest.
_CLIPPED_AT = 4.0


def near_copies(
    marks: Mapping[str, Sequence[int] | IntArray], load: Callable[[str], FloatArray]
) -> dict[str, list[str]]:
    """Find recordings that hold the same readings over most of the run.

    Parameters
    ----------
    marks : mapping of str to sequence of int
        The recordings, with the `fingerprint` of each.
    load : callable
        ``load(name)`` returns the readings of one, (S, K), NaN where a sample is missing.

    Returns
    -------
    dict of str to list of str
        For each recording that has any: its near-copies, and theirs, in the order of `marks`.
    """
    names = list(marks)
    # Recordings of one group share one list of its members.
    members = [[place] for place in range(len(names))]
    for one, other in _candidates([np.array(each, dtype=np.uint64) for each in marks.values()]):
        smaller, larger = sorted((members[one], members[other]), key=len)
        if smaller is not larger and nearly_equal(load(names[one]), load(names[other])):
            larger += smaller
            for place in smaller:
                members[place] = larger
    return {
        name: [names[other] for other in sorted(members[place]) if other != place]
        for place, name in enumerate(names)
        if len(members[place]) > 1
    }


def fingerprint(values: FloatArray) -> IntArray:
    """Return marks of the readings that do not depend on unit, order of sensors or length.

    A mark encodes which of 32 successive changes of a sensor go up and which go down. A pattern
    and its inverse have the same mark.

    Parameters
    ----------
    values : (S, K) array
        Readings; NaN where a sample is missing.

    Returns
    -------
    (F,) array of uint64
        The distinct marks, ascending.
    """
    marks = [np.zeros(0, dtype=np.uint64)]
    for row in values:
        steps = np.diff(row[~np.isnan(row)])
        rising = (steps[steps != 0] > 0).astype(np.uint64)
        if rising.size < 2**_DOUBLINGS:
            continue
        for power in range(_DOUBLINGS):
            width = 2**power
            rising = (rising[:-width] << np.uint64(width)) | rising[width:]
        turned = rising ^ np.uint64(2 ** (2**_DOUBLINGS) - 1)
        marks.append(np.minimum(rising, turned))
    found = np.concatenate(marks)
    # The multiplication (golden ratio of 2^64) makes the high bits depend on all bits. Whether a
    # mark is kept depends on the mark alone, so all recordings keep the same ones.
    hashed = (found * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(32)
    kept: IntArray = np.unique(found[hashed % np.uint64(_KEPT_OF) == 0])
    return kept


def _candidates(fingerprints: Sequence[IntArray]) -> list[tuple[int, int]]:
    """Return the pairs that share enough marks; among many with one mark, only neighbours."""
    sizes = np.array([each.size for each in fingerprints], dtype=np.int64)
    if not sizes.sum():
        return []
    owner = np.repeat(np.arange(sizes.size), sizes)
    marks = np.concatenate(fingerprints)
    order = np.argsort(marks, kind="stable")
    marks, owner = marks[order], owner[order]
    same = marks[1:] == marks[:-1]
    pairs, shared = np.unique(owner[:-1][same] * sizes.size + owner[1:][same], return_counts=True)
    one, other = np.divmod(pairs, sizes.size)
    enough = shared >= np.maximum(_SHARED_MARKS * np.minimum(sizes[one], sizes[other]), 1.0)
    return list(zip(one[enough].tolist(), other[enough].tolist(), strict=True))


def nearly_equal(one: FloatArray, other: FloatArray) -> bool:
    """Return whether two recordings hold the same readings over most of the shorter one.

    Parameters
    ----------
    one, other : (S, K) and (S, M) array
        Readings; NaN where a sample is missing. Order of the sensors, unit and start may differ.
    """
    first, second = _standardized(one), _standardized(other)
    shift = _shift(first, second)
    first, second = first[:, max(shift, 0) :], second[:, max(-shift, 0) :]
    overlap = min(first.shape[1], second.shape[1])
    if overlap < _LEAST_OVERLAP * min(one.shape[1], other.shape[1]):
        return False
    # Two different runs already differ at the first sensor, so this rarely compares the others.
    return all(
        max(_usual_correlation(row[:overlap], each[:overlap]) for each in second) >= _SAME
        for row in first
    )


def _standardized(values: FloatArray) -> FloatArray:
    centred = values - _known_median(values)
    deviation = np.abs(centred)
    spread = _known_median(deviation)
    # If most readings are equal, that spread is 0, and the largest deviation replaces it.
    spread = np.where(spread > 0, spread, np.fmax.reduce(deviation, axis=1, keepdims=True))
    clipped = np.clip(centred / np.where(spread > 0, spread, 1.0), -_CLIPPED_AT, _CLIPPED_AT)
    return np.where(np.isnan(values), np.nan, clipped)


def _known_median(values: FloatArray) -> FloatArray:
    """Return the median of each row (S, K) without NaN, as (S, 1); fast for a few short rows."""
    ordered = np.sort(values, axis=1)  # NaN comes last.
    last = np.maximum(np.count_nonzero(~np.isnan(values), axis=1, keepdims=True) - 1, 0)
    middle = np.take_along_axis(ordered, np.hstack([last // 2, (last + 1) // 2]), axis=1)
    known: FloatArray = middle.mean(axis=1, keepdims=True)
    return known


def _shift(one: FloatArray, other: FloatArray) -> int:
    """Return by how many samples the same readings come later in the first than in the second."""
    length = one.shape[1] + other.shape[1]
    spectra = np.fft.rfft(np.nan_to_num(one[0]), length)
    others = np.fft.rfft(np.nan_to_num(other), length, axis=1)
    products = np.abs(np.fft.irfft(spectra * np.conj(others), length, axis=1)).max(axis=0)
    best = int(np.argmax(products))
    return best if best < one.shape[1] else best - length


def _usual_correlation(one: FloatArray, other: FloatArray) -> float:
    """Return the median over sections of the correlation, without its sign."""
    known = ~(np.isnan(one) | np.isnan(other))
    sections = zip(
        np.array_split(one[known], _SECTIONS), np.array_split(other[known], _SECTIONS), strict=True
    )
    correlations = []
    for a, b in sections:
        if a.size and np.ptp(a) > 0 and np.ptp(b) > 0:
            correlations.append(_correlation(a, b))
    return median(correlations) if correlations else 0.0


def _correlation(one: FloatArray, other: FloatArray) -> float:
    """Return the correlation without its sign."""
    one, other = one - one.mean(), other - other.mean()
    return float(abs(one @ other) / np.sqrt((one @ one) * (other @ other)))
