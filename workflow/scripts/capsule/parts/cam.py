"""Compute the spiral cam: an eccentric circle that turns once per wavelength."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray


@dataclass(frozen=True)
class Cam:
    """One cam shaft.

    The circle's centre is the eccentricity, the wave's amplitude, away from the shaft's axis. The
    lead, a wavelength, is the length along the shaft in which it turns once.
    """

    radius_mm: float
    eccentricity_mm: float
    lead_mm: float


def follower_displacement(cam: Cam, along_mm: FloatArray, turn_rad: FloatArray) -> FloatArray:
    """Return the displacement of the followers by the cam, in mm.

    A follower's window is as wide as the circle, so the follower moves with the circle's centre:
    ``e cos(turn - 2 pi x / lead)``. This sine travels along the shaft as the shaft turns.

    Parameters
    ----------
    along_mm
        Positions of the followers' middle planes along the shaft.
    turn_rad
        Angle of the shaft.
    """
    return cam.eccentricity_mm * np.cos(turn_rad - 2 * np.pi * along_mm / cam.lead_mm)


def phase_step(cam: Cam, pitch_mm: float) -> float:
    """Return the angle between neighbouring followers, in degrees."""
    return 360.0 * pitch_mm / cam.lead_mm


def steepest_overhang(cam: Cam) -> float:
    """Return the overhang of the cam's flank when the shaft is printed upright, in degrees.

    The circle's centre moves sideways by ``2 pi e`` per lead.
    """
    return float(np.degrees(np.arctan(2 * np.pi * cam.eccentricity_mm / cam.lead_mm)))


def relief(thickness_mm: float, bevel_deg: float) -> float:
    """Return the additional half width of a window at a follower's faces, in mm.

    The cam is inclined, so it moves sideways over a follower's thickness. The window's edge is a
    ridge at the follower's middle. So the cam touches only the ridge, and the motion stays a sine.
    """
    return float(thickness_mm / 2 * np.tan(np.radians(bevel_deg)))
