"""Pre-processing of a run into the padded matrix V (eq. normalization to eq. extended).

Mean, standard deviation and windows leave out missing samples (NaN). They use what the paper calls
the "actual available data points". Figures show the stages, which `preprocess_run` returns.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray


def normalize(values: FloatArray) -> FloatArray:
    """Return each sensor's readings with mean 0 and standard deviation 1 (eq. normalization).

    The standard deviation is that of a sample (N - 1), as in MATLAB's ``zscore``.

    Parameters
    ----------
    values : (S, K) array
        Readings; the unit does not matter.

    Returns
    -------
    (S, K) array
        Readings in standard deviations.

    Raises
    ------
    ValueError
        A sensor is constant.
    """
    if np.any(np.nanmax(values, axis=1) == np.nanmin(values, axis=1)):
        raise ValueError("a constant sensor cannot be normalized")
    mean = np.nanmean(values, axis=1, keepdims=True)
    deviation = np.nanstd(values, axis=1, ddof=1, keepdims=True)
    normalized: FloatArray = (values - mean) / deviation
    return normalized


def rms_envelope(normalized: FloatArray, window: int) -> FloatArray:
    """Return the root mean square over a centred window (eq. RMS_envelope, eq. W').

    The window [k - W/2, k + W/2] is cut at both ends of the recording. The sum is divided by the
    number of samples that the window really holds.

    Parameters
    ----------
    normalized : (S, K) array
        Normalized readings.
    window : int
        Window size W in samples.

    Returns
    -------
    (S, K) array
        The envelope; NaN where a window holds no sample.
    """
    samples = normalized.shape[1]
    half = window // 2
    known = ~np.isnan(normalized)
    squares = np.where(known, normalized, 0.0) ** 2
    position = np.arange(samples)
    start = np.maximum(position - half, 0)
    end = np.minimum(position + half + 1, samples)
    count = _window_sum(known.astype(np.float64), start, end)
    total = _window_sum(squares, start, end)
    # Differences of a running sum can fall below zero by rounding.
    mean = np.divide(
        np.maximum(total, 0.0), count, out=np.full_like(total, np.nan), where=count > 0
    )
    return np.sqrt(mean)


def _window_sum(values: FloatArray, start: IntArray, end: IntArray) -> FloatArray:
    running = np.concatenate([np.zeros((values.shape[0], 1)), np.cumsum(values, axis=1)], axis=1)
    sums: FloatArray = running[:, end] - running[:, start]
    return sums


def rectify(envelope: FloatArray, threshold: float) -> FloatArray:
    """Return by how much the envelope exceeds the threshold c, 0 below it (eq. ReLU)."""
    return np.maximum(envelope - threshold, 0.0)


def extend(rectified: FloatArray, length: int) -> FloatArray:
    """Return the matrix padded with zeros on the right to L columns (eq. extended).

    Raises
    ------
    ValueError
        The recording is longer than L; it is never cut.
    """
    sensors, samples = rectified.shape
    if samples > length:
        raise ValueError(f"{samples} samples do not fit into {length} columns")
    matrix = np.zeros((sensors, length))
    matrix[:, :samples] = rectified
    return matrix


def preprocess(values: FloatArray, *, window: int, threshold: float, length: int) -> FloatArray:
    """Make the padded matrix V of a run (eq. normalization to eq. extended).

    Parameters
    ----------
    values : (S, K) array
        Readings; NaN where a sample is missing.
    window : int
        Window size W in samples.
    threshold : float
        Threshold c in standard deviations.
    length : int
        Number of columns L.

    Returns
    -------
    (S, L) array
        The matrix V, in standard deviations above the threshold.
    """
    envelope = rms_envelope(normalize(values), window)
    return extend(rectify(envelope, threshold), length)


@dataclass(frozen=True)
class PreprocessedRun:
    """One run after each stage of pre-processing, from readings to matrix.

    Attributes
    ----------
    recording : str
        Name of the recording, such as ``3mm/r07``.
    title : str
        Its condition, such as ``3 mm nodule``.
    time_s : (K,) array
        Time of each sample in seconds, from 0.
    values : (S, K) array
        The readings; NaN where a sample is missing.
    envelope : (S, K) array
        RMS envelope of the normalized readings, in standard deviations.
    matrix : (S, K) array
        The first K columns of the matrix V: those that stand for samples.
    """

    recording: str
    title: str
    time_s: FloatArray
    values: FloatArray
    envelope: FloatArray
    matrix: FloatArray


def preprocess_run(
    recording: str,
    title: str,
    values: FloatArray,
    *,
    rate_hz: float,
    window: int,
    threshold: float,
) -> PreprocessedRun:
    """Return a run after each stage of pre-processing.

    Parameters
    ----------
    recording, title : str
        Name and condition of the recording.
    values : (S, K) array
        The accepted readings on an even grid in time.
    rate_hz : float
        Sampling rate in Hz.
    window : int
        W, window of the envelope in samples.
    threshold : float
        c, in standard deviations.
    """
    envelope = rms_envelope(normalize(values), window)
    time_s = np.arange(values.shape[1]) / rate_hz
    matrix = rectify(envelope, threshold)
    return PreprocessedRun(recording, title, time_s, values, envelope, matrix)
