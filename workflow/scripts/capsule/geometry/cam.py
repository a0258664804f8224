"""The spiral cam: a circle off the shaft's axis that turns once in a wavelength."""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray


@dataclass(frozen=True)
class Cam:
    """One cam shaft.

    Attributes
    ----------
    radius_mm
        Radius of the circle.
    eccentricity_mm
        Distance of its centre from the shaft's axis: the wave's amplitude.
    lead_mm
        Length along the shaft in which the circle turns once: the wavelength.
    """

    radius_mm: float
    eccentricity_mm: float
    lead_mm: float


def follower_displacement(cam: Cam, along_mm: FloatArray, turn_rad: FloatArray) -> FloatArray:
    """Return how far the cam moves its followers, in mm.

    In a window as wide as the circle a follower stands where the circle's centre stands:
    ``e cos(turn - 2 pi x / lead)``, a sine that travels along the shaft as the shaft turns.

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

    The circle's centre moves sideways by ``2 pi e`` in a lead.
    """
    return float(np.degrees(np.arctan(2 * np.pi * cam.eccentricity_mm / cam.lead_mm)))


def relief(thickness_mm: float, bevel_deg: float) -> float:
    """Return by how much a window is wider at a follower's faces than at its middle, a side, in mm.

    The cam is inclined, so over a follower's thickness it moves sideways. A window whose edge is a
    ridge at the follower's middle touches the cam there alone, and the motion stays a sine.
    """
    return float(thickness_mm / 2 * np.tan(np.radians(bevel_deg)))
