"""Model the contact between capsule, wall and nodule: the compression of each substructure."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.geometry.origami import Origami
from capsule.phantom.seat import shaped_noise
from capsule.phantom.wall import Wall, cushion_stiffness


@dataclass(frozen=True)
class Contact:
    """Stiffness and reach of a substructure, and the variation of its seat against the wall.

    Attributes
    ----------
    unit_stiffness_n_mm
        Stiffness of half a substructure against being pressed flat.
    patch_mm2
        Area over which the tip of an awn presses on the wall.
    fold_limit_mm
        Compression at which the fold is closed and yields no further.
    reach_mm
        Standard deviation of a substructure's sensitivity along the capsule.
    bearing_height_mm
        Height of the strip by which the capsule bears on the wall, at most that of the print.
    series_offset_mm
        Spread of the nodule's height above the capsule's middle plane, from one series of runs to
        the next. Nodule and platform are set up once per series.
    height_offset_mm
        Spread of that height from run to run within a series.
    stray_probability
        Probability that a run has an additional height offset of ``stray_mm``.
    stray_mm
        Additional height offset of such a run.
    coupling_spread
        Spread of the logarithm of each sensor's coupling to the nodule, drawn for each run.
    wander_mm
        Standard deviation of a substructure's slow shift in its seat.
    wander_spread
        Spread of the logarithm of that deviation: how loosely the capsule sits in a run.
    wander_time_s
        Correlation time of that shift.
    """

    unit_stiffness_n_mm: float
    patch_mm2: float
    fold_limit_mm: float
    reach_mm: float
    bearing_height_mm: float
    series_offset_mm: float
    height_offset_mm: float
    stray_probability: float
    stray_mm: float
    coupling_spread: float
    wander_mm: float
    wander_spread: float
    wander_time_s: float


def sphere_stiffness(wall: Wall, nodule_mm: float) -> float:
    """Return the stiffness of the sheet under a sphere, in N/mm.

    A sphere that is pressed in to its equator acts as a punch of its diameter. The silicone around
    it adds support: ``E d / (1 - nu^2)`` on a deep sheet (I. N. Sneddon, Int. J. Eng. Sci. 3,
    1965, 47-57). A column below the sphere alone, ``E (pi d^2 / 4) / sheet``, would be five times
    too soft for a 1 mm sphere; at 5 mm both formulas agree.
    """
    return float(wall.modulus_kpa * 1e-3 * nodule_mm / (1 - wall.poisson_ratio**2))


def pressed_bulge(contact: Contact, wall: Wall, nodule_mm: float) -> float:
    """Return the height of the bulge that remains under the pressing capsule, in mm.

    A sphere of diameter d lifts the free wall by d, but only over the sphere. The capsule's tip
    rests on the sphere and on the wall around it, which are two parallel springs. The height is the
    mean of their heights, weighted by stiffness: ``d k_sphere / (k_sphere + k_wall)``. So the
    capsule presses a small sphere down more than a large one.
    """
    sphere = sphere_stiffness(wall, nodule_mm)
    return nodule_mm * sphere / (sphere + cushion_stiffness(wall, contact.patch_mm2))


def bulge_width(contact: Contact, wall: Wall, origami: Origami, nodule_mm: float) -> float:
    """Return the bulge's standard deviation along the gut, as a substructure feels it, in mm.

    A rounded tip touches the sphere through the wall, so half the width is about radius + wall +
    tip radius. This counts as two standard deviations. The substructure's own reach adds to it.
    """
    half_width_mm = nodule_mm / 2 + wall.wall_mm + origami.tip_radius_mm
    return float(np.hypot(half_width_mm / 2, contact.reach_mm))


def height_factor(contact: Contact, nodule_mm: float, offset_mm: float) -> float:
    """Return the fraction of a nodule's contact that remains with a height offset.

    Seen in the direction of pressing, the nodule is a disc, and the capsule bears on a strip. The
    fraction is the disc's area within the strip, divided by the area without offset. So a badly
    adjusted platform misses a small nodule but still touches a large one.

    Parameters
    ----------
    offset_mm
        Height of the nodule's centre above the strip's middle.
    """
    if nodule_mm == 0:
        return 0.0
    radius, half_strip = nodule_mm / 2, contact.bearing_height_mm / 2

    def below(edge_mm: float) -> float:
        # Fraction of the disc's area below a horizontal line at this height over the centre.
        line = np.clip(edge_mm / radius, -1.0, 1.0)
        return float(0.5 + (line * np.sqrt(1 - line**2) + np.arcsin(line)) / np.pi)

    within = below(half_strip - offset_mm) - below(-half_strip - offset_mm)
    return within / (below(half_strip) - below(-half_strip))


def stray_offset(contact: Contact, generator: np.random.Generator) -> float:
    """Return the additional height offset of one run, in mm; mostly 0.

    The capsule may ride up on the platform, or the sphere may roll aside under the wall. Such a run
    touches a large nodule in part, and does not touch a small one.
    """
    return float(contact.stray_mm * (generator.random() < contact.stray_probability))


def bulge_profile(height_mm: float, width_mm: float, distance_mm: FloatArray) -> FloatArray:
    """Return the bulge's height at a distance along the gut from its centre, in mm."""
    return height_mm * np.exp(-0.5 * (distance_mm / width_mm) ** 2)


def compression(
    contact: Contact, wall: Wall, overlap_mm: FloatArray, sphere_n_mm: FloatArray | float = 0.0
) -> FloatArray:
    """Return the compression of half a substructure by a wall that overlaps it, in mm.

    Wall and substructure are two springs in series that share the overlap. A sphere below the tip
    adds its stiffness to the wall's. The fold yields until it is closed.

    Parameters
    ----------
    overlap_mm
        Depth to which the wall would reach into the relaxed substructure.
    sphere_n_mm
        Stiffness of the sphere below the tip.
    """
    support = cushion_stiffness(wall, contact.patch_mm2) + sphere_n_mm
    share = support / (support + contact.unit_stiffness_n_mm)
    free = share * overlap_mm
    # Linear below the limit and constant above it, where the fold is closed; smooth in between.
    return free / (1 + (free / contact.fold_limit_mm) ** 4) ** 0.25


def seat_wander(
    contact: Contact, generator: np.random.Generator, sensors: int, samples: int, rate_hz: float
) -> FloatArray:
    """Return the slow shift of each substructure in its seat, with deviation 1: shape (S, K).

    The shift is white noise, smoothed by a Gaussian of the correlation time. Each run's `looseness`
    scales it to mm.
    """
    frequencies = np.fft.rfftfreq(2 * samples, 1 / rate_hz)
    gain = np.exp(-0.5 * (np.pi * frequencies * contact.wander_time_s) ** 2)
    return shaped_noise(generator, gain, sensors, samples)


def looseness(contact: Contact, generator: np.random.Generator) -> float:
    """Return the standard deviation of the shift of the seats in one run, in mm."""
    return float(contact.wander_mm * np.exp(generator.normal(0.0, contact.wander_spread)))
