"""The verdict on a recording, with the same fields for every detector."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.matching import Comparison, nearest_size, place_of_largest

_UNKNOWN = float("nan")


@dataclass(frozen=True)
class Verdict:
    """A detector's verdict on one recording.

    Attributes
    ----------
    predicted_mm : float
        0 for no nodule, otherwise one of the archive's sizes in mm; NaN for no verdict.
    score : float
        Higher if a nodule is more likely.
    threshold : float
        A score above it means a nodule.
    probability : float
        Probability of a nodule at the configured prevalence; NaN for a detector that gives none.
    estimate_mm : float
        Size of the nodule in mm; NaN if none is detected.
    estimate_low_mm, estimate_high_mm : float
        Ends of the interval of the size in mm; NaN for a detector that gives none.
    location_samples, location_mm : float
        When the first sensor passes the nodule, in samples from the start; and how far the capsule
        has moved until then, in mm. NaN if none is detected, or if unknown.
    distances : tuple of float, or None
        Distance to every template, T^0 first; None for a detector that does not use them.
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
    """Return why a detector gives no verdict; empty if it gives one."""
    if not np.isnan(verdict.predicted_mm):
        return ""
    # If the score is known, only the recordings that teach the threshold are missing.
    return (
        "no score: a wave, a sensor or labelled recordings are missing"
        if np.isnan(verdict.score)
        else "no threshold: labelled recordings to learn it from are missing"
    )


def template_verdict(
    predicted_mm: float, comparison: Comparison, location_samples: float
) -> Verdict:
    """Return the paper's verdict as a `Verdict`: its margin is the score, its threshold is 0.

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
    """Return the verdict from the paper's margin and a threshold.

    The size of a nodule is that of the nearest nodule template.

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
    place = place_of_largest(gains)
    return _UNKNOWN if place is None else float(gains[place])
