"""Fit of the particle that is most similar to a recording (eq. initalParticleindex to eq. Theta*).

Five measures make a fit fast. (1) One cross-correlation by FFT, no longer than needed, gives all
lags. (2) Delta mu and sigma^hor are integers, so every profile along time is a slice of a small
table. (3) Random numbers are drawn at once, and large arrays are made once. (4) Gains are compared
instead of RMSEs. (5) Each call compares 16 candidates, or 8 proposals. If one of the proposals is
accepted, the program makes those after it again.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.kinds import Cells, Settings
from capsule.particles import ParameterSpace, Particle, time_profile
from capsule.seeding import fit_generator
from capsule.sliding import SlidingComparison, rmse_at_lag

# Particles compared at once. Larger groups save little time and need more cache. Proposals after
# an accepted one are compared in vain.
CANDIDATES_AT_ONCE = 16
PROPOSALS_AT_ONCE = 8

# In standard deviations: farther out, a profile is below the rounding error of its peak, 2^-53.
REACH = 8.6


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

    Its results differ from those of `capsule.particles.render` by less than rounding. A profile is
    0 where it is below 2^-53 of its peak.

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
    best_gain, lag = -np.inf, 1
    current = np.empty(0)
    candidates = space.draw(particles, sensors, generator)
    for start in range(0, particles, CANDIDATES_AT_ONCE):
        group = candidates[start : start + CANDIDATES_AT_ONCE]
        gains, lags = compare_vectors(group, renderer, comparison)
        best = gains.argmax()
        if gains[best] > best_gain:
            best_gain, lag, current = gains[best], lags[best], group[best]
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
