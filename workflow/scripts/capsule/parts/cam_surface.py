"""Compute the cam's flank as a smooth surface: a circle that moves along a helix."""

import numpy as np
from scipy.interpolate import make_interp_spline

from capsule.arrays import FloatArray, IntArray
from capsule.geometry.cam import Cam

# Number of cubic pieces around the circle and along the helix. A cubic deviates from a circle of
# radius R by R (2 pi / pieces)^4 / 384: less than 1e-4 mm for all allowed radii.
_PIECES = 32
DEGREE = 3


def cam_surface(cam: Cam) -> tuple[FloatArray, IntArray]:
    """Return the flank of one turn of the cam, upright on z = 0, as a B-spline of degree 3.

    The circle moves without turning. So a point of the flank is a point of the circle plus a point
    of the helix, and the poles are such sums, too. From 0 to 1, u runs around the circle and v
    upwards.

    Returns
    -------
    knots, poles
        The knots of both u and v, shape (K,), with repeated end knots; the poles, shape (N, N, 3),
        in mm, with u along the first axis.
    """
    turn = np.linspace(0.0, 1.0, _PIECES + 1)
    angle = 2 * np.pi * turn
    still = np.zeros_like(turn)
    circle = cam.radius_mm * np.column_stack([np.cos(angle), np.sin(angle), still])
    # The circle's angle lags upwards, because the wave travels along the shaft.
    helix = cam.eccentricity_mm * np.column_stack([np.cos(angle), -np.sin(angle), still])
    helix[:, 2] = cam.lead_mm * turn
    ahead = np.array([0.0, 2 * np.pi * cam.radius_mm, 0.0])
    upwards = np.array([0.0, -2 * np.pi * cam.eccentricity_mm, cam.lead_mm])
    # Set the exact slope at both ends, so that the seam is as smooth as the rest.
    around = make_interp_spline(turn, circle, DEGREE, bc_type=([(1, ahead)], [(1, ahead)]))
    along = make_interp_spline(turn, helix, DEGREE, bc_type=([(1, upwards)], [(1, upwards)]))
    return around.t, around.c[:, np.newaxis] + along.c[np.newaxis]
