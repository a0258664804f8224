"""What each detector judged a recording by, small enough for the page to draw it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from capsule.detectors.along_gut import AlongGut
from capsule.detectors.beat_series import WINDOWS_A_WAVE
from capsule.detectors.matching import template_margin
from capsule.detectors.stretches import Stretches
from capsule.kinds import Cells, Settings
from capsule.page.packing import pack, rounded
from capsule.particles import Particle, peak_positions, render
from capsule.sliding import SlidingComparison
from capsule.templates import ParticleTotal


@dataclass(frozen=True)
class NearestTemplate:
    """The template of a nodule that lies best on a recording.

    Attributes
    ----------
    size_mm : float
        Its size.
    particle : Particle
        What it is rendered from.
    lag : int
        tau, its best lag.
    gain : float
        By how much it beats T^0 (`capsule.detectors.matching.template_margins`): the score.
    """

    size_mm: float
    particle: Particle
    lag: int
    gain: float


def fold_particles(
    totals: Mapping[float, ParticleTotal], left_out: Iterable[tuple[float, Particle]]
) -> dict[float, Particle]:
    """Return the averaged particles of a training fold, by size; of no recording there is none.

    Parameters
    ----------
    totals : mapping of float to ParticleTotal
        The sum of all recordings of each nodule size in mm.
    left_out : iterable of (float, Particle)
        Size and optimal particle of each recording that teaches nothing.
    """
    remaining = dict(totals)
    for size_mm, particle in left_out:
        remaining[size_mm] = remaining[size_mm].without(particle)
    return {size_mm: each.mean() for size_mm, each in remaining.items() if each.count}


def nearest_template(
    comparison: SlidingComparison, particles: Mapping[float, Particle], first_peak: float
) -> NearestTemplate | None:
    """Return the template with the largest gain; None where there is none.

    Parameters
    ----------
    comparison : SlidingComparison
        Of the recording's matrix V, (S, L).
    particles : mapping of float to Particle
        From `fold_particles`.
    first_peak : float
        u.
    """
    length = comparison.particle.shape[1]
    nearest = None
    for size_mm, particle in particles.items():
        gain, lag = template_margin(comparison, render(particle, first_peak, length))
        if nearest is None or gain > nearest.gain:
            nearest = NearestTemplate(size_mm, particle, int(lag), gain)
    return nearest


def surface(particle: Particle, first_peak: float, lag: int, length: int) -> Cells:
    """Return what the page draws a particle over a recording from (eq. G, eq. RMSE).

    Parameters
    ----------
    particle : Particle
        The parameters.
    first_peak : float
        u.
    lag : int
        tau in 1..2L; at L + 1 both matrices lie on each other.
    length : int
        L.

    Returns
    -------
    dict
        Of each surface ``amplitude``, ``vertical`` (sigma^ver), ``peak`` (in samples from the first
        reading) and ``horizontal`` (sigma^hor); and ``from`` and ``to``, between which samples the
        particle lies.
    """
    shift = lag - (length + 1)
    peaks = peak_positions(particle.peak_spacing, first_peak) - 1 + shift
    return {
        "amplitude": rounded(particle.amplitude),
        "vertical": rounded(particle.vertical_spread),
        "peak": rounded(peaks),
        "horizontal": rounded(particle.horizontal_spread),
        "from": shift,
        "to": shift + length,
    }


def beats_evidence(along: AlongGut, rate_hz: float) -> Cells:
    """Return the depth of the beats, in usual depths, and when each sensor passes the place."""
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
        Its centres are in beats from the first one, which is the first of `along`, too.
    along : AlongGut
        Of the same recording.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Section ``diagonal`` of the configuration.
    """
    wave_s = settings["wavelength_mm"] / settings["wave_speed_mm_s"]
    beat_s = wave_s / WINDOWS_A_WAVE
    return {
        "score": round(stretches.score, 4),
        "first_s": round(along.first / rate_hz + stretches.first * beat_s, 4),
        "step_s": round(stretches.step * beat_s, 4),
        **pack(stretches.loss[np.newaxis], 8),
    }
