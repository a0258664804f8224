"""Compute how both walls compress each substructure: wave, uneven walls, nodules, seats."""

from collections.abc import Sequence
from dataclasses import dataclass

from capsule.arrays import FloatArray
from capsule.phantom import contact as touch
from capsule.phantom.bulge import Bulge, bulge_heights
from capsule.phantom.contact import Contact
from capsule.phantom.wall import Unevenness, Wall, overlap, uneven_height
from capsule.phantom.wave import Wave, WaveTrain, wave_height


@dataclass(frozen=True)
class UnevenWalls:
    """Both walls of a gut.

    Attributes
    ----------
    rough
        Factor on the usual unevenness.
    nodule_side, other_side
        The wall with the nodules, and the wall opposite.
    """

    rough: float
    nodule_side: Unevenness
    other_side: Unevenness


@dataclass(frozen=True)
class Pressing:
    """All that presses a capsule at any position and time.

    Attributes
    ----------
    wall, wave, contact
        Parts of the phantom.
    walls
        The walls of this gut.
    train
        The waves of this journey.
    phase
        Phase of the wave at place 0 and time 0, in radians.
    """

    wall: Wall
    wave: Wave
    contact: Contact
    walls: UnevenWalls
    train: WaveTrain
    phase: float

    def compression(
        self,
        bulges: Sequence[Bulge],
        position_mm: FloatArray,
        time_s: FloatArray,
        half_width_mm: FloatArray | float,
        wander_mm: FloatArray,
        strength: FloatArray,
    ) -> FloatArray:
        """Return the compression of each substructure, both halves together, in mm: shape (S, K).

        Parameters
        ----------
        bulges
            The nodules.
        position_mm
            Positions of the sensors, shape (S, K).
        time_s
            Times of the samples, shape (K,).
        half_width_mm
            Distance from the capsule's axis to the tips of its awns, shape (K,) or a number.
        wander_mm, strength
            Shift of each substructure in its seat, and the strength of its contact, shape (S, K).
        """
        wall, walls = self.wall, self.walls
        wave_mm = wave_height(wall, self.wave, self.train, position_mm, time_s, self.phase)
        nodule_side = walls.rough * uneven_height(wall, walls.nodule_side, position_mm)
        other_side = walls.rough * uneven_height(wall, walls.other_side, position_mm)
        heights, spheres = bulge_heights(bulges, position_mm)
        # A substructure that shifts towards one wall moves away from the other wall.
        near_mm = wave_mm + nodule_side + heights + wander_mm
        near = strength * overlap(wall, half_width_mm, near_mm)
        far = strength * overlap(wall, half_width_mm, wave_mm + other_side - wander_mm)
        pressed = touch.compression(self.contact, wall, near, spheres)
        return pressed + touch.compression(self.contact, wall, far)
