"""Templates, the averaged particle of each size, and the paper's rule: the nearest tells the size.

Averages are eq. barTheta and eq. averagingProcess, the comparison is eq. F' to eq. RMSEmin.
RMSE^2 = (|V|^2 - gain) / (3 S L), where gain = 2 sum V T(shifted) - |T|^2. The gain of T^0 is 0, so
the verdict is a nodule if the largest gain of another template, the margin, is above 0.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from capsule.arrays import FloatArray
from capsule.kinds import Cells, Settings
from capsule.method.particle import Particle, render
from capsule.method.sliding import RepeatedParticle, SlidingComparison, rmse_at_lag
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


def template_distances(matrix: FloatArray, templates: Iterable[FloatArray]) -> FloatArray:
    """Compare a recording with every template (eq. F' to eq. RMSEmin).

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix V.
    templates : iterable of B (S, L) arrays
        The templates T^b; one that holds NaN has no distance.

    Returns
    -------
    (B,) array
        The smallest RMSE over all lags; NaN if the matrix or the template holds NaN.
    """
    return compare_templates(matrix, list(map(RepeatedParticle, templates)))[0]


def nearest_size(distances: FloatArray, sizes_mm: Sequence[float]) -> float:
    """Return the size of the nearest template in mm, NaN if no distance is known.

    Parameters
    ----------
    distances : (B,) array
        From `template_distances`.
    sizes_mm : sequence of B floats
        The templates' sizes in mm; 0 is no nodule. Of equal distances the smaller size wins.
    """
    nearest = index_of_largest(-distances)
    return np.nan if nearest is None else float(sizes_mm[nearest])


def index_of_largest(values: FloatArray) -> int | None:
    """Return the index of the largest value that is not NaN, of equal ones the first, or None.

    For the few values of a recording's templates, this is faster than functions on arrays.
    """
    listed = values.tolist()
    known = [index for index, value in enumerate(listed) if value == value]
    return max(known, key=listed.__getitem__, default=None)


def compare_templates(
    matrix: FloatArray, templates: Sequence[RepeatedParticle]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distances, gains and lags of B templates on a recording's matrix (S, L), each (B,).

    A distance is the smallest RMSE over all lags (eq. RMSEmin). A gain is the largest over all
    lags, 0 for T^0, at the lag tau in 1..2L. All three are NaN if matrix or template holds NaN.
    """
    compared = np.full((3, len(templates)), np.nan)
    if not np.isnan(matrix).any():
        gain_of = SlidingComparison(matrix).gain_of
        for index, template in enumerate(templates):
            if template.is_known:
                gain, lag = gain_of(template)
                compared[:, index] = rmse_at_lag(matrix, template.values, lag), gain, lag
    distances, gains, lags = compared
    return distances, gains, lags


def first_peak_sample(lag: float, first_peak: int, length: int) -> float:
    """Return when sensor 1 feels the template's first peak, in samples from the first reading.

    `first_peak` is u, counted from 1. At a `lag` (tau) of L + 1, the template is not shifted.
    """
    return first_peak - 1 + lag - (length + 1)
