"""Model how firmly each substructure sits between the walls during a run."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Seat:
    """Variation of the contact's strength; 1 is its typical strength.

    Attributes
    ----------
    strength_spread
        Spread of the logarithm of each substructure's strength, along the run.
    strength_run_spread
        Spread of the logarithm of that spread, from run to run.
    strength_time_s
        Correlation time of the strength.
    reseat_spread
        Spread of the logarithm of each substructure's new strength after the capsule slips back.
    """

    strength_spread: float
    strength_run_spread: float
    strength_time_s: float
    reseat_spread: float


def shaped_noise(
    generator: np.random.Generator, gain: FloatArray, sensors: int, samples: int
) -> FloatArray:
    """Return noise of standard deviation 1 with a given spectrum: shape (sensors, samples).

    Parameters
    ----------
    gain
        Gain at the frequencies of ``rfftfreq(2 * samples)``, shape (samples + 1,). The noise has
        twice the samples, so that the end of a run is independent of its beginning.
    """
    noise = generator.standard_normal((sensors, 2 * samples))
    smooth = np.fft.irfft(np.fft.rfft(noise) * gain, 2 * samples)[:, :samples]
    # The standard deviation of the smoothed noise follows from the gain (Parseval).
    deviation = np.sqrt(
        (gain[0] ** 2 + 2 * np.sum(gain[1:-1] ** 2) + gain[-1] ** 2) / (2 * samples)
    )
    shaped: FloatArray = smooth / deviation
    return shaped


def wandering_strength(
    seat: Seat, generator: np.random.Generator, sensors: int, samples: int, rate_hz: float
) -> FloatArray:
    """Return the strength of each substructure's contact over time: shape (S, K).

    Its logarithm is first-order (Ornstein-Uhlenbeck) noise, independent for each sensor. It stands
    for a capsule that tilts, turns and creeps between soft walls.
    """
    if seat.strength_spread == 0:
        return np.ones((sensors, samples))
    frequencies = np.fft.rfftfreq(2 * samples, 1 / rate_hz)
    gain = 1 / np.sqrt(1 + (2 * np.pi * frequencies * seat.strength_time_s) ** 2)
    wander = shaped_noise(generator, gain, sensors, samples)
    run_factor = np.exp(generator.normal(0.0, seat.strength_run_spread))
    strength: FloatArray = np.exp(seat.strength_spread * run_factor * wander)
    return strength


def reseated_strength(
    seat: Seat,
    generator: np.random.Generator,
    sensors: int,
    slips_mm: FloatArray,
    wave: IntArray,
) -> FloatArray:
    """Return the factor of slips on each substructure's contact strength: shape (S, K).

    A slip moves the awns to other places of the wall, where each awn finds a new seat.

    Parameters
    ----------
    slips_mm
        Slip back at the end of each wave, shape (waves,).
    wave
        Number of the wave at each sample, integers, shape (K,).
    """
    seats = np.concatenate([[0], np.cumsum(slips_mm > 0)])
    spreads = generator.normal(0.0, seat.reseat_spread, (seats[-1] + 1, sensors)).T
    return np.exp(spreads[:, seats[wave]])
