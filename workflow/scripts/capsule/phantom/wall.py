"""Model the phantom's two walls, and the wave that the cams drive through them."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from capsule.arrays import FloatArray
from capsule.phantom.quantities import Limits, Positive, Share


@dataclass(frozen=True)
class Wall:
    """The silicone walls and the wave that the cams drive through them."""

    lumen_mm: Positive
    amplitude_mm: float
    wavelength_mm: Positive
    speed_mm_s: Positive
    modulus_kpa: Positive
    poisson_ratio: Annotated[float, Limits(high=0.5)]
    wall_mm: float
    sheet_mm: float
    unevenness_mm: float
    unevenness_length_mm: Positive
    unevenness_spread: float


def wave_period(wall: Wall) -> float:
    """Return the time between two waves at a fixed place, in seconds."""
    return wall.wavelength_mm / wall.speed_mm_s


def overlap(wall: Wall, half_width_mm: FloatArray | float, height_mm: FloatArray) -> FloatArray:
    """Return the depth to which a wall would reach into a relaxed capsule, in mm; 0 if apart."""
    return np.maximum(height_mm + half_width_mm - wall.lumen_mm / 2, 0.0)


@dataclass(frozen=True)
class Unevenness:
    """One uneven wall, as a sum of sinusoids along the gut.

    Attributes
    ----------
    wave_numbers
        Wave numbers in rad/mm, shape (waves,).
    phases
        Phases in rad, shape (waves,).
    rough
        Factor on the usual unevenness.
    """

    wave_numbers: FloatArray
    phases: FloatArray
    rough: float = 1.0


def draw_unevenness(
    wall: Wall, generator: np.random.Generator, rough: float = 1.0, waves: int = 24
) -> Unevenness:
    """Draw one uneven wall, `rough` times as uneven as usual.

    The wall is a sum of sinusoids of random phase whose wave numbers are normally distributed. This
    is a Gaussian random field with a Gaussian correlation of length ``unevenness_length_mm``. The
    wall belongs to the place: a second pass with a generator in the same state has the same wall.
    """
    wave_numbers = generator.normal(0.0, 1.0 / wall.unevenness_length_mm, waves)
    return Unevenness(wave_numbers, generator.uniform(0.0, 2 * np.pi, waves), rough)


def uneven_height(wall: Wall, uneven: Unevenness, position_mm: FloatArray) -> FloatArray:
    """Return the unevenness of one wall at the given places, in mm."""
    angles = position_mm[..., np.newaxis] * uneven.wave_numbers + uneven.phases
    scale = wall.unevenness_mm * np.sqrt(2.0 / uneven.phases.size)
    height_mm: FloatArray = uneven.rough * (scale * np.cos(angles).sum(axis=-1))
    return height_mm


def roughness(wall: Wall, generator: np.random.Generator) -> float:
    """Return the factor of one place on the usual unevenness of its walls."""
    return float(np.exp(generator.normal(0.0, wall.unevenness_spread)))


def cushion_stiffness(wall: Wall, contact_area_mm2: float) -> float:
    """Return the stiffness of wall and sheet under a flat contact, in N/mm (E A / thickness)."""
    modulus_n_mm2 = wall.modulus_kpa * 1e-3
    return modulus_n_mm2 * contact_area_mm2 / (wall.wall_mm + wall.sheet_mm)


@dataclass(frozen=True)
class Wave:
    """The shape of the wave and its irregularities, compared with a regular sine."""

    skew: Annotated[float, Limits(-0.95, 0.95)]
    sharpness: float
    period_spread: float
    amplitude_spread: float
    missing_probability: Share
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
    """Draw the waves of one run; with all spreads 0, the waves are regular."""
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
    return np.sign(shape) * np.abs(shape) ** wave.sharpness


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
