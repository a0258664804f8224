"""The verdict on a recording, with the same fields for every detector."""

from dataclasses import dataclass

import numpy as np

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
