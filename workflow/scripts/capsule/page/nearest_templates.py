"""Find the nodule's template that is most similar to a recording, and the lag where it is so.

The paper's detector has compared each template with each recording. Its verdicts tell the nearest
template and, if it found a nodule, the lag. What they leave open is computed again.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from capsule.arrays import FloatArray
from capsule.detectors.registry import PAPER
from capsule.detectors.template import lag_of_first_peak
from capsule.kinds import Row, Settings
from capsule.particle import Particle, render
from capsule.sliding import RepeatedParticle, SlidingComparison
from capsule.templates import ParticleTotal


@dataclass(frozen=True)
class NearestTemplate:
    """The nodule's template that is most similar to a recording.

    Attributes
    ----------
    size_mm : float
        The nodule's size.
    particle : Particle
        The parameters from which it is rendered.
    lag : int
        tau, its best lag.
    """

    size_mm: float
    particle: Particle
    lag: int


class FoldParticles:
    """The averaged particles of any training fold.

    Parameters
    ----------
    totals : mapping of float to ParticleTotal
        The sum over all recordings of each nodule size, by size in mm.
    """

    def __init__(self, totals: Mapping[float, ParticleTotal]) -> None:
        self._totals = totals
        self._of_all = {size_mm: each.mean() for size_mm, each in totals.items() if each.count}

    def without(self, left_out: Iterable[tuple[float, Particle]]) -> dict[float, Particle]:
        """Return the averaged particles of a fold, for each size that has recordings in it.

        Parameters
        ----------
        left_out : iterable of (float, Particle)
            Size and optimal particle of each recording that is left out of the training.
        """
        remaining: dict[float, ParticleTotal] = {}
        for size_mm, particle in left_out:
            total = remaining.get(size_mm, self._totals[size_mm])
            remaining[size_mm] = total.without(particle)
        averaged = dict(self._of_all)
        for size_mm, each in remaining.items():
            if each.count:
                averaged[size_mm] = each.mean()
            else:
                del averaged[size_mm]
        return averaged


def nearest_templates(
    particles: Mapping[str, Mapping[float, Particle]],
    verdicts: Sequence[Row],
    sizes_mm: Sequence[float],
    matrix: Callable[[], FloatArray],
    settings: Settings,
) -> dict[str, NearestTemplate]:
    """Return the nearest template under each scheme that has a template.

    Parameters
    ----------
    particles : mapping of str to mapping of float to Particle
        For each scheme, from `FoldParticles`.
    verdicts : sequence of mapping
        The recording's verdicts, from `capsule.page.recordings.in_words`.
    sizes_mm : sequence of float
        Sizes of the templates whose distances the verdicts hold, 0 first.
    matrix : callable
        Returns the recording's matrix V, (S, L). It is called only if the verdicts leave a lag
        open.
    settings : mapping
        The configuration.

    Returns
    -------
    dict of str to NearestTemplate
    """
    first_peak, length = settings["fit"]["first_peak"], settings["preprocessing"]["length"]
    compared = cache(lambda: SlidingComparison(matrix()))
    papers = {row["scheme"]: row for row in verdicts if row["detector"] == PAPER}
    found = {}
    for scheme, of_fold in particles.items():
        size_mm, location_s = _told(papers.get(scheme), sizes_mm)
        candidates = of_fold
        if size_mm is not None and size_mm in of_fold:
            candidates = {size_mm: of_fold[size_mm]}
            if location_s is not None:
                sample = location_s * settings["recording"]["rate_hz"]
                lag = lag_of_first_peak(sample, first_peak, length)
                found[scheme] = NearestTemplate(size_mm, of_fold[size_mm], lag)
                continue
        nearest = nearest_template(compared(), candidates, first_peak) if candidates else None
        if nearest is not None:
            found[scheme] = nearest
    return found


def nearest_template(
    comparison: SlidingComparison, particles: Mapping[float, Particle], first_peak: float
) -> NearestTemplate | None:
    """Return the template with the largest gain; None if there is no template.

    Parameters
    ----------
    comparison : SlidingComparison
        The comparison with the recording's matrix V, (S, L).
    particles : mapping of float to Particle
        From `FoldParticles`.
    first_peak : float
        u.
    """
    length = comparison.particles.shape[-1]
    nearest, largest = None, -float("inf")
    for size_mm, particle in particles.items():
        template = RepeatedParticle(render(particle, first_peak, length))
        if not template.is_known:
            continue
        gain, lag = comparison.gain_of(template)
        if gain > largest:
            nearest, largest = NearestTemplate(size_mm, particle, lag), gain
    return nearest


def _told(verdict: Row | None, sizes_mm: Sequence[float]) -> tuple[float | None, float | None]:
    """Return the nodule's size at the smallest distance, of equal ones the first; and the place."""
    if verdict is None:
        return None, None
    # T^0 comes first and stands for no nodule.
    pairs = zip(verdict["distances"][1:], sizes_mm[1:], strict=True)
    known = [(distance, size_mm) for distance, size_mm in pairs if distance is not None]
    return (min(known)[1] if known else None), verdict["location_s"]
