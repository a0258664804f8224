"""Compute the geometry of the origami, from a substructure's dimensions to the sensors' pitch.

Coordinates: x runs along the capsule to its head (to the right), y away from the symmetry axis.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from capsule.arrays import FloatArray


@dataclass(frozen=True)
class Origami:
    """Dimensions of the four substructures; lengths in mm, angles in degrees."""

    axis_to_fold_mm: float
    fold_to_shoulder_mm: float
    shoulder_to_tip_mm: float
    awn_tilt_deg: float
    fold_angle_deg: float
    tip_radius_mm: float
    wall_thickness_mm: float
    adhesive_mm: float
    height_mm: float
    fold_side: Literal["head", "tail"]
    lower_corner_mm: float
    corners: Literal["middle", "outside"]
    tip: Literal["bulb", "round", "curl"]


def half_width(origami: Origami) -> float:
    """Return the distance from the axis to the tip of an awn, in mm (half the paper's w)."""
    return origami.axis_to_fold_mm + origami.fold_to_shoulder_mm + origami.shoulder_to_tip_mm


def end_radius(origami: Origami) -> float:
    """Return the radius of an awn's end, in mm."""
    return origami.wall_thickness_mm / 2 if origami.tip == "round" else origami.tip_radius_mm


def vertices(origami: Origami) -> dict[str, FloatArray]:
    """Return the corners A, B, C and the awn's tip D of one half of a substructure.

    B, C and D are on one line, which leans to the tail by alpha. CA leans from it by beta, to the
    fold's side. At B, neighbours are glued.

    Returns
    -------
    dict of str to array of shape (2,)
        Positions (x, y) in mm, with C at x = 0.
    """
    alpha, beta = origami.awn_tilt_deg, origami.fold_angle_deg
    tilt = np.radians(alpha)
    run = np.tan(np.radians(alpha + beta if origami.fold_side == "head" else alpha - beta))
    rise = origami.fold_to_shoulder_mm + (origami.axis_to_fold_mm - origami.lower_corner_mm)
    return {
        "A": np.array([origami.fold_to_shoulder_mm * run, origami.axis_to_fold_mm]),
        "B": np.array([rise * np.tan(tilt), origami.lower_corner_mm]),
        "C": np.array([0.0, origami.axis_to_fold_mm + origami.fold_to_shoulder_mm]),
        "D": np.array([-origami.shoulder_to_tip_mm * np.tan(tilt), half_width(origami)]),
    }


def pitch(origami: Origami) -> float:
    """Return the distance along the axis from one substructure to the next, in mm.

    A substructure ends at A and B, or half a wall beyond if they are on the middle of the wall. A
    film of adhesive joins it to its neighbour.
    """
    corners = vertices(origami)
    hexagon = abs(float(corners["A"][0] - corners["B"][0]))
    beyond = origami.wall_thickness_mm if origami.corners == "middle" else 0.0
    return hexagon + beyond + origami.adhesive_mm


def sensor_offsets(origami: Origami, sensors: int) -> FloatArray:
    """Return the distance of each sensor behind sensor 1 (at the head), in mm: shape (S,)."""
    return pitch(origami) * np.arange(sensors, dtype=float)
