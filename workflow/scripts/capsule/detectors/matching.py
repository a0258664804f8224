"""Comparison of a recording with templates: the paper's distance, and the gain over T^0."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.sliding import RepeatedParticle, SlidingComparison, rmse_at_lag


def template_distances(matrix: FloatArray, templates: Sequence[FloatArray]) -> FloatArray:
    """Compare a recording with every template (eq. F' to eq. RMSEmin).

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix V.
    templates : sequence of B (S, L) arrays
        The templates T^b; one that holds NaN has no distance.

    Returns
    -------
    (B,) array
        The smallest RMSE over all lags; NaN if the matrix or the template holds NaN.
    """
    distances = np.full(len(templates), np.nan)
    if np.isnan(matrix).any():
        return distances
    comparison = SlidingComparison(matrix)
    for index, template in enumerate(templates):
        if not np.isnan(template).any():
            distances[index], _ = comparison.compare(template)
    return distances


def nearest_size(distances: FloatArray, sizes_mm: Sequence[float]) -> float:
    """Return the size of the nearest template.

    Parameters
    ----------
    distances : (B,) array
        From `template_distances`.
    sizes_mm : sequence of B floats
        The templates' sizes in mm; 0 is no nodule. Of equal distances the smaller size wins.

    Returns
    -------
    float
        Size in mm, 0 for no nodule, NaN if no distance is known.
    """
    nearest = place_of_largest(-distances)
    return float("nan") if nearest is None else float(sizes_mm[nearest])


def place_of_largest(values: FloatArray) -> int | None:
    """Return the place of the largest value that is not NaN, of equal ones the first, or None.

    For the few values of a recording's templates, this is faster than functions on arrays.
    """
    listed = values.tolist()
    known = [place for place, value in enumerate(listed) if value == value]
    return max(known, key=listed.__getitem__, default=None)


@dataclass(frozen=True)
class Comparison:
    """The comparison of a recording with templates.

    The paper's rule compares RMSE^2 = (|V|^2 - gain) / (3 S L), with gain = 2 sum V T(shifted)
    - |T|^2 (eq. RMSE). The gain of T^0 is 0, so the verdict is a nodule if the largest gain is
    above 0. Any other threshold than 0 gives another operating point.

    Attributes
    ----------
    distances : (B,) array
        The smallest RMSE (eq. RMSEmin) over all lags, as from `template_distances`.
    gains : (B,) array
        Largest gain over all lags; that of T^0 is 0.
    lags : (B,) array
        tau in 1..2L of the largest gain. All three are NaN if the matrix or the template holds
        NaN.
    """

    distances: FloatArray
    gains: FloatArray
    lags: FloatArray

    def replaced(self, places: Sequence[int], others: "Comparison") -> "Comparison":
        """Return a copy in which the results of other templates replace those at some places."""
        arrays = []
        for own, other in zip(vars(self).values(), vars(others).values(), strict=True):
            array = own.copy()
            array[places] = other
            arrays.append(array)
        return Comparison(*arrays)


def compare_templates(
    comparison: SlidingComparison, templates: Sequence[RepeatedParticle]
) -> Comparison:
    """Return distance, gain and lag of every template on a recording.

    Parameters
    ----------
    comparison : SlidingComparison
        The sliding comparison with the recording's matrix V, (S, L).
    templates : sequence of B RepeatedParticle
        The templates T^b.
    """
    distances, gains, lags = np.full((3, len(templates)), np.nan)
    if not np.isnan(comparison.matrix).any():
        for index, template in enumerate(templates):
            if template.is_known:
                gains[index], lag = comparison.gain_of(template)
                lags[index] = lag
                distances[index] = rmse_at_lag(comparison.matrix, template.values, lag)
    return Comparison(distances, gains, lags)


def first_peak_sample(lag: float, first_peak: int, length: int) -> float:
    """Return when sensor 1 feels the template's first peak, in samples from the first reading.

    Parameters
    ----------
    lag : float
        tau; at L + 1 the template is not shifted relative to the recording.
    first_peak : int
        u, the column of the first peak, counted from 1.
    length : int
        Number of columns L.
    """
    return first_peak - 1 + lag - (length + 1)


def lag_of_first_peak(sample: float, first_peak: int, length: int) -> int:
    """Return the lag tau at which sensor 1 feels the first peak then; see `first_peak_sample`."""
    return round(sample - first_peak + 1) + length + 1
