"""The stages of pre-processing of one run, for figures that show each stage."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.preprocessing import normalize, rectify, rms_envelope


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

    Returns
    -------
    PreprocessedRun
    """
    envelope = rms_envelope(normalize(values), window)
    time_s = np.arange(values.shape[1]) / rate_hz
    matrix = rectify(envelope, threshold)
    return PreprocessedRun(recording, title, time_s, values, envelope, matrix)
