"""The paper's detector with a threshold: by how much the best template beats no template."""

from collections.abc import Sequence

import numpy as np

from capsule.sliding import SlidingComparison


def template_margins(
    matrix: np.ndarray, templates: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Give the gain of every template at its best lag.

    The paper's rule compares RMSE^2 = (|V|^2 - gain) / (3 S L), with gain = 2 sum V T(shifted)
    - |T|^2 (eq. RMSE) and a gain of 0 for T^0: "nodule" is a largest gain above 0. Any other
    offset in place of the 0 gives another operating point.

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix V.
    templates : sequence of B (S, L) arrays
        The templates T^b of nodules, without T^0; one that holds NaN has no gain.

    Returns
    -------
    gains : (B,) array
        Largest gain over all lags; NaN where the matrix or the template is NaN.
    lags : (B,) array
        tau in 1..2L where it is reached; NaN likewise.
    """
    gains, lags = np.full((2, len(templates)), np.nan)
    if np.isnan(matrix).any():
        return gains, lags
    comparison = SlidingComparison(matrix)
    for index, template in enumerate(templates):
        if not np.isnan(template).any():
            comparison.particle[...] = template
            gains[index], lags[index] = comparison.gain()
    return gains, lags


def first_peak_sample(lag: float, first_peak: int, length: int) -> float:
    """Give when sensor 1 feels the template's first peak, in samples from the first reading.

    Parameters
    ----------
    lag : float
        tau; at L + 1 the template lies unshifted on the recording.
    first_peak : int
        u, the column of the first peak, counted from 1.
    length : int
        Number of columns L.
    """
    return first_peak - 1 + lag - (length + 1)
