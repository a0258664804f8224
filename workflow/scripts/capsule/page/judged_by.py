"""Collect the evidence that each detector used on a recording, small enough for the page."""

import numpy as np

from capsule.detectors.beats import WINDOWS_A_WAVE
from capsule.kinds import Cells, Settings
from capsule.page.along_gut import AlongGut
from capsule.page.packing import pack
from capsule.page.stretches import FIRST, STEP, Stretches


def beats_evidence(along: AlongGut, rate_hz: float) -> Cells:
    """Return the beats' depth, in multiples of the usual depth, and when each sensor passes."""
    passed = [None if np.isnan(at) else round(float(at) / rate_hz, 2) for at in along.passed]
    return {
        "first_s": along.first / rate_hz,
        "step_s": along.step / rate_hz,
        "passed_s": passed,
        **pack(along.depth, 8),
    }


def gut_evidence(along: AlongGut) -> Cells:
    """Return the evidence at each place along the gut."""
    return {"step_mm": along.step_mm, **pack(along.evidence[np.newaxis], 8)}


def stretches_evidence(
    stretches: Stretches, along: AlongGut, rate_hz: float, settings: Settings
) -> Cells:
    """Return what the taught score loses without each stretch.

    Parameters
    ----------
    stretches : Stretches
        The stretches of the recording.
    along : AlongGut
        The evidence along the gut, of the same recording.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Section ``diagonal`` of the configuration.
    """
    wave_s = settings["wavelength_mm"] / settings["wave_speed_mm_s"]
    beat_s = wave_s / WINDOWS_A_WAVE
    return {
        "score": round(stretches.score, 4),
        "first_s": round(along.first / rate_hz + FIRST * beat_s, 4),
        "step_s": round(STEP * beat_s, 4),
        **pack(stretches.loss[np.newaxis], 8),
    }
