"""Particles, S Gaussian surfaces along the diagonal, and the fit of one to a recording.

The equations are eq. generateP to eq. sigma, and eq. initalParticleindex to eq. Theta*.

Five measures make a fit fast. (1) One cross-correlation by FFT, no longer than needed, gives all
lags. (2) Delta mu and sigma^hor are integers, so every profile along time is a slice of a small
table. (3) Random numbers are drawn at once, and large arrays are made once. (4) Gains are compared
instead of RMSEs. (5) Each call compares 16 candidates, or 8 proposals. If one of the proposals is
accepted, the program makes those after it again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.kinds import Cells, Settings
from capsule.method.sliding import SlidingComparison, rmse_at_lag
from capsule.seeding import fit_generator

# Particles compared at once. Larger groups save little time and need more cache. Proposals after
# an accepted one are compared in vain.
CANDIDATES_AT_ONCE = 16
PROPOSALS_AT_ONCE = 8

# In standard deviations: farther out, a profile is below the rounding error of its peak, 2^-53.
REACH = 8.6


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


def particles_of(fits: Mapping[str, Mapping[str, Any]]) -> dict[str, Particle]:
    """Return Theta* of each fit under results/fits/ that has parameters, by recording."""
    return {
        name: Particle(**{key: np.array(values) for key, values in fit["parameters"].items()})
        for name, fit in fits.items()
        if fit["parameters"]
    }


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
    row = np.arange(particle.amplitude.size)
    distance = row[np.newaxis, :] - row[:, np.newaxis]
    # A_s exp(-(i - s)^2 / 2 sigma_s^ver^2), the height of surface s in row i, (S, S).
    weights = particle.amplitude[:, np.newaxis] * np.exp(
        -0.5 * (distance / particle.vertical_spread[:, np.newaxis]) ** 2
    )
    offset = column - position[:, np.newaxis]
    profiles = time_profile(offset, particle.horizontal_spread[:, np.newaxis])
    surfaces = weights[:, :, np.newaxis] * profiles[:, np.newaxis, :]
    highest: FloatArray = surfaces.max(axis=0)
    return highest


@dataclass(frozen=True)
class Fit:
    """The optimal particle of one recording.

    Attributes
    ----------
    particle : Particle
        Theta*, the optimal parameter set.
    rmse_initial : float
        RMSE* of the best of the N random particles.
    rmse : float
        RMSE* of the optimal particle.
    lag : int
        tau of the smallest RMSE.
    accepted_moves : int
        Number of iterations, of the M, that lowered the RMSE.
    """

    particle: Particle
    rmse_initial: float
    rmse: float
    lag: int
    accepted_moves: int


class ParticleRenderer:
    """A fast renderer of particles with integer spacings and spreads.

    Its results differ from those of `render` by less than rounding. A profile is 0 where it is
    below 2^-53 of its peak.

    Parameters
    ----------
    sensors, length : int
        S and L.
    first_peak : int
        u, the column of the first peak, counted from 1.
    space : ParameterSpace
        The ranges that the table of profiles must cover.
    """

    def __init__(self, sensors: int, length: int, first_peak: int, space: ParameterSpace) -> None:
        self._sensors, self._length = sensors, length
        self._smallest_spread, largest_spread = map(int, space.horizontal_spread_range)
        self._last_peak = first_peak + (sensors - 1) * int(space.peak_spacing_range[1])
        self._first_peak = first_peak
        offsets = np.arange(1 - self._last_peak, length - first_peak + 1)
        spreads = range(self._smallest_spread, largest_spread + 1)
        self._table = np.zeros((len(spreads), offsets.size))
        for profile, spread in zip(self._table, spreads, strict=True):
            near = slice(*np.searchsorted(offsets, [-REACH * spread, REACH * spread]))
            profile[near] = time_profile(offsets[near], spread)
        row = np.arange(sensors)
        self._half_square_distance = -0.5 * (row[np.newaxis, :] - row[:, np.newaxis]) ** 2.0
        self._profiles = np.empty((sensors, 1, length))
        self._surfaces = np.empty((sensors, sensors, length))

    def draw_into(self, vectors: FloatArray, target: FloatArray) -> None:
        """Draw the particles of parameter vectors (B, 4 S - 1) into a (B, S, L) array."""
        sensors, length = self._sensors, self._length
        amplitude = vectors[:, :sensors, np.newaxis]
        spread = vectors[:, sensors : 2 * sensors, np.newaxis]
        weights = amplitude * np.exp(self._half_square_distance / (spread * spread))
        weights = weights[..., np.newaxis]
        integers = vectors[:, 2 * sensors :].astype(np.int64).tolist()
        for b, values in enumerate(integers):
            start = self._last_peak - self._first_peak
            for s in range(sensors):
                if s > 0:
                    start -= values[s - 1]
                spread_index = values[sensors - 1 + s] - self._smallest_spread
                self._profiles[s, 0] = self._table[spread_index, start : start + length]
            np.multiply(weights[b], self._profiles, out=self._surfaces)
            np.maximum.reduce(self._surfaces, axis=0, out=target[b])


def fit_particle(
    matrix: FloatArray,
    generator: np.random.Generator,
    *,
    particles: int,
    iterations: int,
    first_peak: int,
    space: ParameterSpace,
) -> Fit:
    """Fit a particle to a recording's matrix.

    The fit starts from the best of N random particles (eq. initalParticleindex) and improves it
    over M iterations. Each proposal adds a random step to every parameter (eq. Thetaupdate) and is
    limited to the bounds. It is kept only if its RMSE is smaller (eq. updateTheta).

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix F.
    generator : numpy.random.Generator
        Source of the random particles and steps.
    particles, iterations : int
        N and M.
    first_peak : int
        u, the column of the first peak, counted from 1.
    space : ParameterSpace
        Ranges and steps of the parameters.

    Returns
    -------
    Fit
        The optimal particle (eq. Theta*).
    """
    sensors, length = matrix.shape
    comparison = SlidingComparison(matrix, max(CANDIDATES_AT_ONCE, PROPOSALS_AT_ONCE))
    renderer = ParticleRenderer(sensors, length, first_peak, space)
    candidates = space.draw(particles, sensors, generator)
    groups = np.split(candidates, range(CANDIDATES_AT_ONCE, particles, CANDIDATES_AT_ONCE))
    compared = [compare_vectors(group, renderer, comparison) for group in groups]
    gains, lags = (np.concatenate(each) for each in zip(*compared, strict=True))
    best = gains.argmax()
    best_gain, lag, current = gains[best], lags[best], candidates[best]
    rmse_initial = _rmse(matrix, renderer, current, lag)

    low, high = space.bounds(sensors)
    steps = space.draw_steps(iterations, sensors, generator)
    accepted = done = 0
    while done < iterations:
        proposals = current + steps[done : done + PROPOSALS_AT_ONCE]
        np.minimum(np.maximum(proposals, low, out=proposals), high, out=proposals)
        gains, lags = compare_vectors(proposals, renderer, comparison)
        better = gains > best_gain
        if better.any():
            best = better.argmax()
            best_gain, lag, current = gains[best], lags[best], proposals[best]
            accepted += 1
            done += int(best) + 1
        else:
            done += len(proposals)
    rmse = _rmse(matrix, renderer, current, lag)
    return Fit(Particle.from_vector(current), rmse_initial, rmse, int(lag), accepted)


def fit_recording(matrix: FloatArray, values: FloatArray, settings: Settings) -> Fit:
    """Fit a particle to a recording with the configured settings.

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix V.
    values : (S, K) array
        The recording's readings on an even grid in time, which seed the fit.
    settings : mapping
        Section ``fit`` of the configuration.

    Returns
    -------
    Fit
    """
    return fit_particle(matrix, fit_generator(settings["seed"], values), **fit_options(settings))


def fit_options(settings: Settings) -> Cells:
    """Return the arguments of `fit_particle` except matrix and generator.

    Parameters
    ----------
    settings : mapping
        Section ``fit`` of the configuration.
    """
    ranges = {key: value for key, value in settings.items() if key != "seed"}
    counts = {key: ranges.pop(key) for key in ("particles", "iterations", "first_peak")}
    return {**counts, "space": ParameterSpace(**ranges)}


def compare_vectors(
    vectors: FloatArray, renderer: ParticleRenderer, comparison: SlidingComparison
) -> tuple[FloatArray, IntArray]:
    """Render some particles and compare them with a recording.

    Parameters
    ----------
    vectors : (B, 4 S - 1) array
        The parameters; B is at most the number of particles that `comparison` takes at once.
    renderer : ParticleRenderer
    comparison : SlidingComparison

    Returns
    -------
    gains, lags : (B,) array
        See `SlidingComparison.gains`.
    """
    renderer.draw_into(vectors, comparison.particles)
    return comparison.gains(len(vectors))


def _rmse(matrix: FloatArray, renderer: ParticleRenderer, vector: FloatArray, lag: int) -> float:
    drawn = np.empty_like(matrix)
    renderer.draw_into(vector[np.newaxis], drawn[np.newaxis])
    return rmse_at_lag(matrix, drawn, lag)
