"""Particles: matrices of S Gaussian surfaces along the diagonal (eq. generateP to eq. sigma)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Particle:
    """The free parameters Theta of a particle (eq. particleparameters).

    Attributes
    ----------
    amplitude : (S,) array
        A_s, height of each Gaussian surface in standard deviations.
    vertical_spread : (S,) array
        sigma_s^ver, standard deviation across the sensors, in rows.
    peak_spacing : (S - 1,) array
        Delta mu_s^hor for s = 2..S, samples from one sensor's peak to the next one's.
    horizontal_spread : (S,) array
        sigma_s^hor, standard deviation along time, in samples.
    """

    amplitude: FloatArray
    vertical_spread: FloatArray
    peak_spacing: FloatArray
    horizontal_spread: FloatArray

    def to_vector(self) -> FloatArray:
        """Return the parameters one after the other in a (4 S - 1,) array."""
        return np.concatenate(
            [self.amplitude, self.vertical_spread, self.peak_spacing, self.horizontal_spread]
        )

    @classmethod
    def from_vector(cls, vector: FloatArray) -> "Particle":
        """Return the particle whose parameters `to_vector` has put into a vector."""
        sensors = (len(vector) + 1) // 4
        cuts = [sensors, 2 * sensors, 3 * sensors - 1]
        return cls(*np.split(np.asarray(vector, dtype=np.float64), cuts))


@dataclass(frozen=True)
class ParameterSpace:
    """The ranges of a particle's parameters, and the steps of the improvement.

    Attributes
    ----------
    amplitude_range, vertical_spread_range : pair of float
        Ranges of the continuous parameters; the paper's ranges are open at 0, so the lower
        bound is the smallest value allowed.
    peak_spacing_range, horizontal_spread_range : pair of int
        Ranges of the integer parameters, both ends included.
    continuous_step, integer_step : float
        sigma_ite of the continuous and of the integer parameters (eq. sigmaIte).
    """

    amplitude_range: Sequence[float]
    vertical_spread_range: Sequence[float]
    peak_spacing_range: Sequence[int]
    horizontal_spread_range: Sequence[int]
    continuous_step: float
    integer_step: float

    def bounds(self, sensors: int) -> tuple[FloatArray, FloatArray]:
        """Return the lowest and the highest parameter vector, each (4 S - 1,)."""
        ranges = (
            [self.amplitude_range] * sensors
            + [self.vertical_spread_range] * sensors
            + [self.peak_spacing_range] * (sensors - 1)
            + [self.horizontal_spread_range] * sensors
        )
        low, high = np.array(ranges, dtype=np.float64).T
        return low, high

    def draw(self, count: int, sensors: int, generator: np.random.Generator) -> FloatArray:
        """Draw random parameter vectors, uniform in the ranges (eq. particleSet).

        Returns
        -------
        (count, 4 S - 1) array
        """
        low, high = self.bounds(sensors)
        continuous = 2 * sensors
        drawn = np.empty((count, low.size))
        # high - (high - low) u with u in [0, 1) reaches the closed upper end of (0, 1.5].
        uniform = generator.random((count, continuous))
        drawn[:, :continuous] = high[:continuous] - (high - low)[:continuous] * uniform
        drawn[:, continuous:] = generator.integers(
            low[continuous:].astype(np.int64),
            high[continuous:].astype(np.int64),
            size=(count, low.size - continuous),
            endpoint=True,
        )
        return drawn

    def draw_steps(self, count: int, sensors: int, generator: np.random.Generator) -> FloatArray:
        """Draw the steps of the improvement (eq. Thetaupdate, eq. sigmaIte).

        Integer parameters take rounded steps, so they stay integers.

        Returns
        -------
        (count, 4 S - 1) array
        """
        steps = generator.standard_normal((count, 4 * sensors - 1))
        steps[:, : 2 * sensors] *= self.continuous_step
        steps[:, 2 * sensors :] = np.rint(steps[:, 2 * sensors :] * self.integer_step)
        return steps


def peak_positions(peak_spacing: FloatArray, first_peak: float) -> FloatArray:
    """Return the columns mu_s^hor of the peaks, the sums of their spacings (eq. deltaMu).

    Parameters
    ----------
    peak_spacing : (S - 1,) array
        Delta mu_s^hor in samples.
    first_peak : float
        u, the column of the first peak, counted from 1.

    Returns
    -------
    (S,) array
    """
    return first_peak + np.concatenate([[0.0], np.cumsum(peak_spacing)])


def sensor_weights(amplitude: FloatArray, vertical_spread: FloatArray) -> FloatArray:
    """Return the height of surface s in row i, A_s exp(-(i - s)^2 / 2 sigma_s^ver^2).

    Returns
    -------
    (S, S) array
        Row s holds the heights of Gaussian surface s in the matrix rows i.
    """
    row = np.arange(amplitude.size)
    distance = row[np.newaxis, :] - row[:, np.newaxis]
    return amplitude[:, np.newaxis] * np.exp(
        -0.5 * (distance / vertical_spread[:, np.newaxis]) ** 2
    )


def time_profile(
    offset: FloatArray | IntArray, horizontal_spread: FloatArray | float
) -> FloatArray:
    """Return exp(-(j - mu)^2 / 2 sigma^hor^2) at the offsets j - mu."""
    return np.exp(-0.5 * (offset / horizontal_spread) ** 2)


def render(particle: Particle, first_peak: float, length: int) -> FloatArray:
    """Render the matrix P of a particle (eq. generateP, eq. G, eq. mu, eq. sigma).

    The Gaussian surfaces are not normalized: A_s is the height of the peak. If surfaces overlap,
    the higher one counts.

    Parameters
    ----------
    particle : Particle
        The parameters; averaged spacings and spreads need not be integers.
    first_peak : float
        u, the column of the first peak, counted from 1.
    length : int
        Number of columns L.

    Returns
    -------
    (S, L) array
    """
    column = np.arange(1, length + 1)
    position = peak_positions(particle.peak_spacing, first_peak)
    weights = sensor_weights(particle.amplitude, particle.vertical_spread)
    offset = column - position[:, np.newaxis]
    profiles = time_profile(offset, particle.horizontal_spread[:, np.newaxis])
    surfaces = weights[:, :, np.newaxis] * profiles[:, np.newaxis, :]
    highest: FloatArray = surfaces.max(axis=0)
    return highest
