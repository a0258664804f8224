"""What every detector says of a recording, in the same words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.matching import Comparison, nearest_size

_UNKNOWN = float("nan")


@dataclass(frozen=True)
class Verdict:
    """A detector's verdict on one recording.

    Attributes
    ----------
    predicted_mm : float
        0 for no nodule, otherwise one of the archive's sizes; NaN where nothing can be said.
    score : float
        The higher, the more it looks like a nodule.
    threshold : float
        A score above it means a nodule.
    probability : float
        Of a nodule, at the configured prevalence; NaN for a detector that gives none.
    estimate_mm : float
        The size of the nodule; NaN where none is detected.
    estimate_low_mm, estimate_high_mm : float
        Ends of the interval of the size; NaN for a detector that gives none.
    location_samples, location_mm : float
        Where along the run the nodule lies: when the first sensor passes it, in samples from the
        start, and how far the capsule has then come; NaN where none is detected, or unknown.
    distances : tuple of float, or None
        To every template, T^0 first; None for a detector that does not judge by them.
    """

    predicted_mm: float
    score: float
    threshold: float
    probability: float = _UNKNOWN
    estimate_mm: float = _UNKNOWN
    location_samples: float = _UNKNOWN
    location_mm: float = _UNKNOWN
    estimate_low_mm: float = _UNKNOWN
    estimate_high_mm: float = _UNKNOWN
    distances: tuple[float, ...] | None = None


NO_VERDICT = Verdict(_UNKNOWN, _UNKNOWN, _UNKNOWN)


def why_unknown(verdict: Verdict) -> str:
    """Say why a detector says neither yes nor no; empty where it does."""
    if not np.isnan(verdict.predicted_mm):
        return ""
    # Its own score is known where only the recordings that teach a threshold are missing.
    return (
        "no score: a wave, a sensor or labelled recordings are missing"
        if np.isnan(verdict.score)
        else "no threshold: labelled recordings to learn it from are missing"
    )


def template_verdict(
    predicted_mm: float, comparison: Comparison, location_samples: float
) -> Verdict:
    """Put the paper's verdict into these words: its margin is the score, its threshold is 0.

    Parameters
    ----------
    predicted_mm : float
        The paper's verdict.
    comparison : Comparison
        With every template, T^0 first.
    location_samples : float
        When the first sensor meets the best template's first peak.
    """
    score, distances = _largest(comparison.gains[1:]), tuple(comparison.distances.tolist())
    if not predicted_mm > 0:
        return Verdict(predicted_mm, score, 0.0, distances=distances)
    return Verdict(
        predicted_mm,
        score,
        0.0,
        estimate_mm=predicted_mm,
        location_samples=location_samples,
        distances=distances,
    )


def threshold_verdict(
    comparison: Comparison, sizes_mm: Sequence[float], threshold: float, location_samples: float
) -> Verdict:
    """Judge by the paper's margin against a threshold; the size is the nearest nodule template's.

    Parameters
    ----------
    comparison : Comparison
        With every template, T^0 first.
    sizes_mm : sequence of 1 + B floats
        The templates' sizes, 0 first.
    threshold : float
        From `threshold_at` on the margins of healthy recordings.
    location_samples : float
        When the first sensor meets the best template's first peak.
    """
    score, distances = _largest(comparison.gains[1:]), tuple(comparison.distances.tolist())
    if np.isnan(score) or np.isnan(threshold):
        return Verdict(_UNKNOWN, score, threshold, distances=distances)
    if score <= threshold:
        return Verdict(0.0, score, threshold, distances=distances)
    size_mm = nearest_size(comparison.distances[1:], sizes_mm[1:])
    return Verdict(
        size_mm,
        score,
        threshold,
        estimate_mm=size_mm,
        location_samples=location_samples,
        distances=distances,
    )


def _largest(gains: FloatArray) -> float:
    return float(np.nanmax(gains)) if np.any(~np.isnan(gains)) else _UNKNOWN
