"""The particle that is most similar to a recording (eq. initalParticleindex to eq. Theta*).

What makes a fit fast: (1) one cross-correlation by FFT gives all lags; (2) Delta mu and
sigma^hor are integers, so every profile along time is a slice of one small table; (3) the random
numbers of all iterations are drawn at once; (4) every work array is made once and reused; (5) the
comparison is by gain, and the RMSE itself is computed only at the start and the end.
"""

from dataclasses import dataclass

import numpy as np

from capsule.particles import ParameterSpace, Particle, time_profile
from capsule.sliding import SlidingComparison, rmse_at_lag


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
        tau where it is reached.
    accepted_moves : int
        How many of the M iterations lowered the RMSE.
    """

    particle: Particle
    rmse_initial: float
    rmse: float
    lag: int
    accepted_moves: int


class ParticleRenderer:
    """Renders particles with integer spacings and spreads, as `capsule.particles.render` does.

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
        self._sensors, self._length, self._first_peak = sensors, length, first_peak
        self._last_peak = first_peak + (sensors - 1) * int(space.peak_spacing_range[1])
        self._smallest_spread = int(space.horizontal_spread_range[0])
        spreads = np.arange(self._smallest_spread, int(space.horizontal_spread_range[1]) + 1)
        offsets = np.arange(1 - self._last_peak, length - first_peak + 1)
        self._table = time_profile(offsets, spreads[:, np.newaxis])
        row = np.arange(sensors)
        self._half_square_distance = -0.5 * (row[np.newaxis, :] - row[:, np.newaxis]) ** 2.0
        self._weights = np.empty((sensors, sensors))
        self._surface = np.empty((sensors, length))

    def draw_into(self, vector: np.ndarray, target: np.ndarray) -> None:
        """Draw the particle of a parameter vector (4 S - 1,) into a (S, L) array."""
        sensors, length = self._sensors, self._length
        spread = vector[sensors : 2 * sensors]
        np.divide(self._half_square_distance, (spread * spread)[:, np.newaxis], out=self._weights)
        np.exp(self._weights, out=self._weights)
        np.multiply(self._weights, vector[:sensors, np.newaxis], out=self._weights)
        integers = vector[2 * sensors :].astype(np.int64).tolist()
        start = self._last_peak - self._first_peak
        for s in range(sensors):
            if s > 0:
                start -= integers[s - 1]
            spread_index = integers[sensors - 1 + s] - self._smallest_spread
            profile = self._table[spread_index, start : start + length]
            column = self._weights[s, :, np.newaxis]
            if s == 0:
                np.multiply(column, profile, out=target)
            else:
                np.multiply(column, profile, out=self._surface)
                np.maximum(target, self._surface, out=target)


def fit_particle(
    matrix: np.ndarray,
    generator: np.random.Generator,
    *,
    particles: int,
    iterations: int,
    first_peak: int,
    space: ParameterSpace,
) -> Fit:
    """Fit a particle to a recording's matrix.

    The best of N random particles (eq. initalParticleindex) is improved over M iterations: a
    proposal adds a random step to every parameter (eq. Thetaupdate), is brought back to the
    bounds, and is kept only if its RMSE is smaller (eq. updateTheta).

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
    comparison = SlidingComparison(matrix)
    renderer = ParticleRenderer(sensors, length, first_peak, space)
    best_gain, lag = -np.inf, 1
    vector = np.empty(0)
    for candidate in space.draw(particles, sensors, generator):
        renderer.draw_into(candidate, comparison.particle)
        candidate_gain, candidate_lag = comparison.gain()
        if candidate_gain > best_gain:
            best_gain, lag, vector = candidate_gain, candidate_lag, candidate
    rmse_initial = _rmse(matrix, renderer, vector, lag)

    low, high = space.bounds(sensors)
    accepted = 0
    proposal, current = np.empty_like(vector), vector.copy()
    for step in space.draw_steps(iterations, sensors, generator):
        np.add(current, step, out=proposal)
        np.maximum(proposal, low, out=proposal)
        np.minimum(proposal, high, out=proposal)
        renderer.draw_into(proposal, comparison.particle)
        proposal_gain, proposal_lag = comparison.gain()
        if proposal_gain > best_gain:
            best_gain, lag = proposal_gain, proposal_lag
            current, proposal = proposal, current
            accepted += 1
    rmse = _rmse(matrix, renderer, current, lag)
    return Fit(Particle.from_vector(current), rmse_initial, rmse, lag, accepted)


def _rmse(matrix: np.ndarray, renderer: ParticleRenderer, vector: np.ndarray, lag: int) -> float:
    drawn = np.empty_like(matrix)
    renderer.draw_into(vector, drawn)
    return rmse_at_lag(matrix, drawn, lag)
