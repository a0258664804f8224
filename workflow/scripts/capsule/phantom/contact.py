"""Model the contact of capsule, walls and nodules: how each substructure is compressed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.phantom.origami import Origami, end_radius
from capsule.phantom.quantities import Positive, Share, Signed
from capsule.phantom.wall import Wall, cushion_stiffness


@dataclass(frozen=True)
class Contact:
    """Stiffness and reach of a substructure, and the variation of its seat against the wall."""

    unit_stiffness_n_mm: float
    patch_mm2: float
    fold_limit_mm: Positive
    reach_mm: float
    bearing_height_mm: Positive
    series_offset_mm: float
    height_offset_mm: float
    stray_probability: Share
    stray_mm: Signed
    coupling_spread: float
    wander_mm: float
    wander_spread: float
    wander_time_s: Positive


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
    half_width_mm = nodule_mm / 2 + wall.wall_mm + end_radius(origami)
    return float(np.hypot(half_width_mm / 2, contact.reach_mm))


def height_factor(contact: Contact, nodule_mm: float, offset_mm: float) -> float:
    """Return the fraction of a nodule's contact that remains with a height offset.

    Seen in the direction of pressing, the nodule is a disc, and the capsule bears on a strip. The
    fraction is the disc's area within the strip, divided by the area without offset. So a badly
    adjusted platform misses a small nodule but still touches a large one.
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


def compression(
    contact: Contact, wall: Wall, overlap_mm: FloatArray, sphere_n_mm: FloatArray | float = 0.0
) -> FloatArray:
    """Return the compression of half a substructure by a wall that overlaps it, in mm.

    Wall and substructure are two springs in series that share the overlap. A sphere below the tip
    adds its stiffness to the wall's. The fold yields until it is closed.
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


@dataclass(frozen=True)
class Seat:
    """Variation of the contact's strength; 1 is its typical strength."""

    strength_spread: float
    strength_run_spread: float
    strength_time_s: Positive
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


@dataclass(frozen=True)
class Bulge:
    """One nodule as a capsule meets it in one pass.

    Attributes
    ----------
    at_mm
        Place along the gut.
    height_mm
        Height that remains under the pressing capsule.
    width_mm
        Standard deviation along the gut.
    sphere_n_mm
        Stiffness that the nodule adds to the wall.
    coupling
        Factor on the bulge's height under each sensor, shape (S,).
    """

    at_mm: float
    height_mm: float
    width_mm: float
    sphere_n_mm: float
    coupling: FloatArray

    def profile(self, position_mm: FloatArray) -> FloatArray:
        """Return the share of the bulge's height at some places, 0..1, any shape."""
        return np.exp(-0.5 * ((position_mm - self.at_mm) / self.width_mm) ** 2)


def bulge_of(
    contact: Contact,
    wall: Wall,
    origami: Origami,
    *,
    nodule_mm: float,
    at_mm: float,
    height_offset_mm: float,
    coupling: FloatArray,
) -> Bulge:
    """Return the bulge of a nodule.

    Parameters
    ----------
    nodule_mm
        Diameter of the nodule; 0 for none.
    at_mm, coupling
        As in `Bulge`.
    height_offset_mm
        Height of the nodule above the capsule's middle plane; negative below it.
    """
    # A part above or below the capsule neither lifts nor supports the tips of the awns.
    touched = height_factor(contact, nodule_mm, height_offset_mm)
    return Bulge(
        at_mm,
        pressed_bulge(contact, wall, nodule_mm) * touched,
        bulge_width(contact, wall, origami, nodule_mm),
        sphere_stiffness(wall, nodule_mm) * touched,
        coupling,
    )


def climbs(bulges: Sequence[Bulge], position_mm: FloatArray, stroke_mm: float) -> FloatArray:
    """Return the height that each awn would climb on each bulge in a stroke: shape (N S,), in mm.

    Parameters
    ----------
    position_mm
        Positions of the awns, shape (S,).
    """
    rises = [
        bulge.height_mm * (bulge.profile(position_mm + stroke_mm) - bulge.profile(position_mm))
        for bulge in bulges
    ]
    return np.concatenate([np.empty(0), *rises])
