"""Compute the geometry of the origami, from a substructure's dimensions to the sensors' pitch.

Coordinates: x runs along the capsule to its head (to the right), y away from the symmetry axis.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray


@dataclass(frozen=True)
class Origami:
    """Dimensions of the four substructures; lengths in mm, angles in degrees.

    ``config/phantom.yaml`` explains each parameter.
    """

    axis_to_fold_mm: float
    fold_to_shoulder_mm: float
    shoulder_to_tip_mm: float
    awn_tilt_deg: float
    fold_angle_deg: float
    tip_radius_mm: float
    wall_thickness_mm: float
    adhesive_mm: float
    height_mm: float


def half_width(origami: Origami) -> float:
    """Return the distance from the axis to the tip of an awn, in mm (half the paper's w)."""
    return origami.axis_to_fold_mm + origami.fold_to_shoulder_mm + origami.shoulder_to_tip_mm


def vertices(
    origami: Origami, fold_side: str = "head", lower_corner_mm: float | None = None
) -> dict[str, FloatArray]:
    """Return the corners A, B, C and the awn's tip D of one half of a substructure.

    B, C and D are on one line, which leans to the tail by alpha. CA leans from it by beta.

    Parameters
    ----------
    fold_side
        The side of that line, ``head`` or ``tail``, on which A lies.
    lower_corner_mm
        Distance of B from the axis; by default that of A, h_1. There, neighbours are glued.

    Returns
    -------
    dict of str to array of shape (2,)
        Positions (x, y) in mm, with C at x = 0.
    """
    alpha, beta = origami.awn_tilt_deg, origami.fold_angle_deg
    tilt = np.radians(alpha)
    run = np.tan(np.radians(alpha + beta if fold_side == "head" else alpha - beta))
    lower = origami.axis_to_fold_mm if lower_corner_mm is None else lower_corner_mm
    rise = origami.fold_to_shoulder_mm + (origami.axis_to_fold_mm - lower)
    return {
        "A": np.array([origami.fold_to_shoulder_mm * run, origami.axis_to_fold_mm]),
        "B": np.array([rise * np.tan(tilt), lower]),
        "C": np.array([0.0, origami.axis_to_fold_mm + origami.fold_to_shoulder_mm]),
        "D": np.array([-origami.shoulder_to_tip_mm * np.tan(tilt), half_width(origami)]),
    }


def pitch(origami: Origami) -> float:
    """Return the distance along the axis from one substructure to the next, in mm.

    The corners are on the middle line of the printed wall, so a substructure ends half a wall
    beyond A and B. A film of adhesive joins it to its neighbour. So the pitch is
    ``h_2 (tan(alpha + beta) - tan(alpha)) + wall + adhesive``.
    """
    corners = vertices(origami)
    hexagon = float(corners["A"][0] - corners["B"][0])
    return hexagon + origami.wall_thickness_mm + origami.adhesive_mm


def sensor_offsets(origami: Origami, sensors: int) -> FloatArray:
    """Return the distance of each sensor behind sensor 1 (at the head), in mm: shape (S,)."""
    return pitch(origami) * np.arange(sensors, dtype=float)
