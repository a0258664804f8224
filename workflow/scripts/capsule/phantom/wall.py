"""Model the phantom's two walls: position, unevenness and stiffness."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray


@dataclass(frozen=True)
class Wall:
    """The silicone walls and the wave that the cams drive through them.

    Attributes
    ----------
    lumen_mm
        Distance between the baselines of the two walls.
    amplitude_mm, wavelength_mm, speed_mm_s
        The travelling sinusoidal wave.
    modulus_kpa, poisson_ratio
        Young's modulus and Poisson's ratio of the silicone.
    wall_mm
        Thickness of the intestinal wall.
    sheet_mm
        Thickness of the sheet between cams and wall.
    unevenness_mm
        Standard deviation of the wall's height along the gut (casting, 2 mm cam followers).
    unevenness_length_mm
        Correlation length of that height.
    unevenness_spread
        Spread of the logarithm of that deviation, from place to place.
    """

    lumen_mm: float
    amplitude_mm: float
    wavelength_mm: float
    speed_mm_s: float
    modulus_kpa: float
    poisson_ratio: float
    wall_mm: float
    sheet_mm: float
    unevenness_mm: float
    unevenness_length_mm: float
    unevenness_spread: float


def wave_period(wall: Wall) -> float:
    """Return the time between two waves at a fixed place, in seconds."""
    return wall.wavelength_mm / wall.speed_mm_s


def overlap(wall: Wall, half_width_mm: FloatArray | float, height_mm: FloatArray) -> FloatArray:
    """Return the depth to which a wall would reach into a relaxed capsule, in mm; 0 if apart.

    Parameters
    ----------
    half_width_mm
        Distance from the capsule's axis to the tips of its awns.
    height_mm
        Total inward displacement of the wall from its baseline.
    """
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
    """

    wave_numbers: FloatArray
    phases: FloatArray


def draw_unevenness(wall: Wall, generator: np.random.Generator, waves: int = 24) -> Unevenness:
    """Draw one uneven wall.

    The wall is a sum of sinusoids of random phase whose wave numbers are normally distributed. This
    is a Gaussian random field with a Gaussian correlation of length ``unevenness_length_mm``. The
    wall belongs to the place: a second pass with a generator in the same state has the same wall.
    """
    wave_numbers = generator.normal(0.0, 1.0 / wall.unevenness_length_mm, waves)
    return Unevenness(wave_numbers, generator.uniform(0.0, 2 * np.pi, waves))


def uneven_height(wall: Wall, uneven: Unevenness, position_mm: FloatArray) -> FloatArray:
    """Return the unevenness of one wall at the given places, in mm."""
    angles = position_mm[..., np.newaxis] * uneven.wave_numbers + uneven.phases
    scale = wall.unevenness_mm * np.sqrt(2.0 / uneven.phases.size)
    height_mm: FloatArray = scale * np.cos(angles).sum(axis=-1)
    return height_mm


def roughness(wall: Wall, generator: np.random.Generator) -> float:
    """Return the factor of one place on the usual unevenness of its walls."""
    return float(np.exp(generator.normal(0.0, wall.unevenness_spread)))


def cushion_stiffness(wall: Wall, contact_area_mm2: float) -> float:
    """Return the stiffness of wall and sheet under a flat contact, in N/mm (E A / thickness)."""
    modulus_n_mm2 = wall.modulus_kpa * 1e-3
    return modulus_n_mm2 * contact_area_mm2 / (wall.wall_mm + wall.sheet_mm)
