"""Convert readings to rows of one array, for estimators, and back."""

from collections.abc import Sequence

import numpy as np


def as_rows(readings: Sequence[np.ndarray], sensors: int, length: int) -> np.ndarray:
    """Return readings as rows of equal length.

    Parameters
    ----------
    readings : sequence of n (S, K) arrays
        Readings; K may differ, and is at most L.
    sensors, length : int
        S and L.

    Returns
    -------
    (n, L S) array
        Sample after sample, as the lines of a recording, with NaN after the last.
    """
    rows = np.full((len(readings), sensors * length), np.nan)
    for row, values in zip(rows, readings, strict=True):
        row[: values.size] = values.T.ravel()
    return rows


def as_readings(row: np.ndarray, sensors: int) -> np.ndarray:
    """Return the readings of a row.

    Parameters
    ----------
    row : (N,) array
        Sample after sample; an incomplete last sample lacks its other sensors.
    sensors : int
        S.

    Returns
    -------
    (S, K) array
        Without missing samples at the end.
    """
    samples = -(-row.size // sensors)
    padded = np.full(samples * sensors, np.nan)
    padded[: row.size] = row
    values = padded.reshape(samples, sensors).T
    known = np.flatnonzero(~np.isnan(values).all(axis=0))
    return np.ascontiguousarray(values[:, : known[-1] + 1 if known.size else 0])
