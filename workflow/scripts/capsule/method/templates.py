"""Templates: the averaged particle of each nodule size (eq. barTheta, eq. averagingProcess)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from capsule.arrays import FloatArray
from capsule.kinds import Cells, Settings
from capsule.method.particle import Particle, render
from capsule.recordings.names import sizes_of


@dataclass(frozen=True)
class ParticleTotal:
    """The sum of the optimal particles of one size, from which averages are computed.

    Attributes
    ----------
    vector : (4 S - 1,) array
        Sum of what is averaged: the parameters A and Delta mu, and the variances sigma^2.
    count : int
        Q, the number of recordings in the sum.
    """

    vector: FloatArray
    count: int

    def mean(self) -> Particle:
        """Return the averaged particle (eq. barTheta, eq. averagingProcess).

        A and Sigma are averaged. Sigma holds variances, so a sigma is the root of the mean square.
        Delta mu is averaged; the columns of the peaks are its sums. If there is no recording,
        every parameter is NaN.
        """
        if self.count == 0:
            return Particle.from_vector(np.full_like(self.vector, np.nan))
        mean = Particle.from_vector(self.vector / self.count)
        return replace(
            mean,
            vertical_spread=np.sqrt(mean.vertical_spread),
            horizontal_spread=np.sqrt(mean.horizontal_spread),
        )

    def without(self, particle: Particle) -> "ParticleTotal":
        """Return the sum without the particle of one recording."""
        return ParticleTotal(self.vector - _averaged(particle), self.count - 1)


def _averaged(particle: Particle) -> FloatArray:
    """Return what is averaged of a particle: its parameters, with variances for the spreads."""
    squared = replace(
        particle,
        vertical_spread=particle.vertical_spread**2,
        horizontal_spread=particle.horizontal_spread**2,
    )
    return squared.to_vector()


def by_size(particles: Mapping[str, Particle]) -> dict[float, list[Particle]]:
    """Group particles by the true size of their recordings, in mm."""
    groups: dict[float, list[Particle]] = {}
    for name, size in sizes_of(particles).items():
        groups.setdefault(size, []).append(particles[name])
    return groups


def total(particles: Sequence[Particle], sensors: int) -> ParticleTotal:
    """Return the sum of the optimal particles of the recordings of one size.

    Parameters
    ----------
    particles : sequence of Particle
        Theta* of each recording.
    sensors : int
        S, needed if there is no particle.
    """
    vectors = [_averaged(particle) for particle in particles]
    vector = np.sum(vectors, axis=0) if vectors else np.zeros(4 * sensors - 1)
    return ParticleTotal(vector, len(vectors))


def no_nodule_template(sensors: int, length: int) -> FloatArray:
    """Return T^0, the zero matrix (eq. T0)."""
    return np.zeros((sensors, length))


@dataclass(frozen=True)
class TemplateSet:
    """The templates of all sizes, with the sums needed to leave a recording out.

    Attributes
    ----------
    sizes_mm : tuple of B floats
        The templates' sizes, ascending; the first is 0, no nodule.
    totals : tuple of B ParticleTotal
        Sums of the optimal particles; empty for size 0.
    matrices : tuple of B (S, L) arrays
        The rendered templates T^b; NaN for a size without a recording.
    first_peak : int
        u, the column of the first peak.
    """

    sizes_mm: tuple[float, ...]
    totals: tuple[ParticleTotal, ...]
    matrices: tuple[FloatArray, ...]
    first_peak: int

    def without(self, left_out: Iterable[tuple[float, Particle | None]]) -> tuple[FloatArray, ...]:
        """Return the templates without some recordings.

        Parameters
        ----------
        left_out : iterable of (float, Particle)
            Size and optimal particle of each. Entries of size 0 change nothing, because T^0 is not
            an average; nor do those without a particle.

        Returns
        -------
        tuple of B (S, L) arrays
            The same array objects for sizes that lose no recording; NaN for a size that loses all.
        """
        remaining = list(self.totals)
        for size_mm, particle in left_out:
            if size_mm > 0 and particle is not None:
                index = self.sizes_mm.index(size_mm)
                remaining[index] = remaining[index].without(particle)
        return tuple(
            matrix if now is before else render(now.mean(), self.first_peak, matrix.shape[1])
            for matrix, before, now in zip(self.matrices, self.totals, remaining, strict=True)
        )


def template_options(settings: Settings) -> Cells:
    """Return the arguments of `build_templates` except the particles, from a configuration."""
    return {
        "sensors": settings["recording"]["sensors"],
        "first_peak": settings["fit"]["first_peak"],
        "length": settings["preprocessing"]["length"],
    }


def build_templates(
    particles: Mapping[float, Sequence[Particle]], *, sensors: int, first_peak: int, length: int
) -> TemplateSet:
    """Average and render the templates of all sizes.

    Parameters
    ----------
    particles : mapping of float to sequence of Particle
        Theta* of the recordings of each nodule size in mm.
    sensors, length : int
        S and L.
    first_peak : int
        u, the column of the first peak.

    Returns
    -------
    TemplateSet
    """
    sizes_mm = (0.0, *sorted(particles))
    totals = tuple(total(particles.get(size, ()), sensors) for size in sizes_mm)
    rendered = [render(each.mean(), first_peak, length) for each in totals[1:]]
    matrices = (no_nodule_template(sensors, length), *rendered)
    return TemplateSet(sizes_mm, totals, matrices, first_peak)
