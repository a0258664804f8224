"""Templates: the averaged particle of each nodule size (eq. barTheta, eq. averagingProcess)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.particles import Particle


@dataclass(frozen=True)
class ParticleTotal:
    """The sum of the optimal particles of one size, from which any average follows.

    Attributes
    ----------
    vector : (4 S - 1,) array
        Sum of the parameter vectors.
    count : int
        Q, the number of recordings in the sum.
    """

    vector: np.ndarray
    count: int

    def mean(self) -> Particle:
        """Average every parameter over the recordings (eq. averagingProcess).

        Delta mu is averaged; the peaks' columns follow by summation. Without any recording
        every parameter is NaN.
        """
        if self.count == 0:
            return Particle.from_vector(np.full_like(self.vector, np.nan))
        return Particle.from_vector(self.vector / self.count)

    def without(self, particle: Particle) -> "ParticleTotal":
        """Leave one recording out."""
        return ParticleTotal(self.vector - particle.to_vector(), self.count - 1)


def total(particles: Sequence[Particle], sensors: int) -> ParticleTotal:
    """Sum the optimal particles of the recordings of one size.

    Parameters
    ----------
    particles : sequence of Particle
        Theta* of each recording.
    sensors : int
        S, needed where there is no particle.

    Returns
    -------
    ParticleTotal
    """
    vectors = [particle.to_vector() for particle in particles]
    vector = np.sum(vectors, axis=0) if vectors else np.zeros(4 * sensors - 1)
    return ParticleTotal(vector, len(vectors))


def no_nodule_template(sensors: int, length: int) -> np.ndarray:
    """Give T^0, the zero matrix (eq. T0)."""
    return np.zeros((sensors, length))
