"""Model a buried nodule as a bulge with a height, a width and a stiffness."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.geometry.origami import Origami
from capsule.phantom import contact as touch
from capsule.phantom.contact import Contact
from capsule.phantom.wall import Wall


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
    touched = touch.height_factor(contact, nodule_mm, height_offset_mm)
    return Bulge(
        at_mm,
        touch.pressed_bulge(contact, wall, nodule_mm) * touched,
        touch.bulge_width(contact, wall, origami, nodule_mm),
        touch.sphere_stiffness(wall, nodule_mm) * touched,
        coupling,
    )


def climbs(bulges: Sequence[Bulge], position_mm: FloatArray, stroke_mm: float) -> FloatArray:
    """Return the height that each awn would climb on each bulge in a stroke: shape (N S,), in mm.

    Parameters
    ----------
    position_mm
        Positions of the awns, shape (S,).
    """
    rises = [np.empty(0)]
    for bulge in bulges:
        distance = position_mm - bulge.at_mm
        ahead = touch.bulge_profile(bulge.height_mm, bulge.width_mm, distance + stroke_mm)
        rises.append(ahead - touch.bulge_profile(bulge.height_mm, bulge.width_mm, distance))
    return np.concatenate(rises)


def bulge_heights(bulges: Sequence[Bulge], position_mm: FloatArray) -> tuple[FloatArray, ...]:
    """Return height in mm and stiffness in N/mm of all bulges under the sensors.

    Parameters
    ----------
    position_mm
        Positions of the sensors, shape (S, K).

    Returns
    -------
    heights, spheres
        Each of shape (S, K).
    """
    heights, spheres = np.zeros_like(position_mm), np.zeros_like(position_mm)
    for bulge in bulges:
        profile = touch.bulge_profile(1.0, bulge.width_mm, position_mm - bulge.at_mm)
        heights += bulge.height_mm * bulge.coupling[:, np.newaxis] * profile
        spheres += bulge.sphere_n_mm * profile
    return heights, spheres
