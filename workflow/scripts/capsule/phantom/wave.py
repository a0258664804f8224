"""Model the wave that the cams drive through both walls: a sine, or a less regular wave."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.phantom.wall import Wall


@dataclass(frozen=True)
class Wave:
    """The shape of the wave and its irregularities, compared with a regular sine.

    Attributes
    ----------
    skew
        How much longer the wall moves inwards than outwards, -1 to 1: it moves inwards for
        (1 + skew) / 2 of a period. 0 is a sine.
    sharpness
        Power to which the sine is raised, its sign kept: above 1 the wave becomes a pulse. 1 is a
        sine.
    period_spread
        Spread of the logarithm of the period, from wave to wave.
    amplitude_spread
        Spread of the logarithm of the crests' height, from wave to wave.
    missing_probability
        Probability that a wave's crest is missing, and its stroke with it.
    run_spread
        Spread of the logarithm of a factor that scales both spreads and that probability. It
        differs from run to run, so that some runs are more regular than others.
    """

    skew: float
    sharpness: float
    period_spread: float
    amplitude_spread: float
    missing_probability: float
    run_spread: float


@dataclass(frozen=True)
class WaveTrain:
    """The waves of one run.

    Attributes
    ----------
    starts_s
        Time at which each wave starts, shape (waves + 1,).
    delays_s
        Delay of each start against a constant period, shape (waves + 1,).
    crests
        Height of each crest in parts of the amplitude, 0 where it is missing, shape (waves,).
    """

    starts_s: FloatArray
    delays_s: FloatArray
    crests: FloatArray


def wave_train(
    wave: Wave, generator: np.random.Generator, period_s: float, waves: int
) -> WaveTrain:
    """Draw the waves of one run; with all spreads 0, the waves are regular.

    Parameters
    ----------
    period_s
        Mean time from wave to wave.
    waves
        Number of waves.
    """
    periods = generator.normal(0.0, wave.period_spread, waves)
    crests = generator.normal(0.0, wave.amplitude_spread, waves)
    chances = generator.random(waves)
    irregular = np.exp(generator.normal(0.0, wave.run_spread))
    # The motor keeps its mean speed, so all waves together take the configured time.
    periods = np.exp(irregular * periods) / np.exp(irregular * periods).mean()
    crests = np.exp(irregular * crests)
    missing = chances < irregular * wave.missing_probability
    delays_s = np.concatenate([[0.0], np.cumsum(period_s * (periods - 1))])
    starts_s = period_s * np.arange(waves + 1) + delays_s
    return WaveTrain(starts_s, delays_s, np.where(missing, 0.0, crests))


def cam_time(train: WaveTrain, time_s: FloatArray) -> FloatArray:
    """Return the time at which evenly turning cams would reach the same angle, in seconds.

    One motor turns all cams, so a late wave is late along the whole gut.
    """
    return time_s - np.interp(time_s, train.starts_s, train.delays_s)


def crest_shape(wave: Wave, angle: FloatArray) -> FloatArray:
    """Return the wave's height, -1 to 1, with the crest at angle 0.

    The angle of a place decreases with time.

    Parameters
    ----------
    angle
        Phase in radians, any shape.
    """
    if wave.skew != 0:
        # `ahead` is the time to the next crest in periods. The wall moves inwards for `share` of a
        # period, and outwards for the rest.
        ahead, share = np.mod(angle / (2 * np.pi), 1.0), (1 + wave.skew) / 2
        outwards = 1 + (ahead - share) / (1 - share)
        angle = np.pi * np.where(ahead < share, ahead / share, outwards)
    shape = np.cos(angle)
    if wave.sharpness != 1:
        shape = np.sign(shape) * np.abs(shape) ** wave.sharpness
    return shape


def wave_height(
    wall: Wall,
    wave: Wave,
    train: WaveTrain,
    position_mm: FloatArray,
    time_s: FloatArray,
    phase: float,
) -> FloatArray:
    """Return how far the wave pushes a wall inwards from its baseline, in mm.

    Parameters
    ----------
    wall, wave, train
        The walls, the shape of the wave, and the waves of this run.
    position_mm, time_s
        Places along the gut, and times; their shapes broadcast.
    phase
        Phase of the wave at place 0 and time 0, in radians.
    """
    travelled = position_mm - wall.speed_mm_s * cam_time(train, time_s)
    angle = 2 * np.pi * travelled / wall.wavelength_mm + phase
    height = wall.amplitude_mm * crest_shape(wave, angle)
    # Crest n passes where the angle is -2 pi n. A crest before the first has the first's height.
    crest = np.clip(-np.rint(angle / (2 * np.pi)).astype(int), 0, train.crests.size - 1)
    # Only crests differ in height, because between crests the wall is away from the capsule. The
    # walls meet in the middle, so neither moves further than half the lumen.
    pressed = np.minimum(height * train.crests[crest], wall.lumen_mm / 2)
    return np.where(height > 0, pressed, height)
