"""Compute pulleys of a toothed belt, and lengths of belts."""

import numpy as np

from capsule.arrays import FloatArray

# GT2, 2 mm: pitch; distance from the belt's pitch line to the pulley's outside; depth and radius of
# a groove; half the width of its mouth, where the belt's tooth is 1.3 mm wide with rounded flanks.
PITCH_MM = 2.0
_PITCH_LINE_MM = 0.254
_DEPTH_MM = 0.76
_GROOVE_MM = 0.6
_MOUTH_MM = 0.7


def pitch_radius(teeth: int) -> float:
    """Return the radius of the belt's pitch line, in mm."""
    return teeth * PITCH_MM / (2 * np.pi)


def outer_radius(teeth: int) -> float:
    """Return the radius of the pulley's outside, in mm."""
    return pitch_radius(teeth) - _PITCH_LINE_MM


def teeth_around(radius_mm: float) -> int:
    """Return the least number of teeth of a pulley whose grooves stay outside a radius."""
    return int(np.ceil((radius_mm + _DEPTH_MM + _PITCH_LINE_MM) * 2 * np.pi / PITCH_MM))


def pulley_outline(teeth: int) -> FloatArray:
    """Return a pulley's section, anticlockwise: shape (N, 2), in mm.

    Each groove is a half circle with a mouth that widens a little. It is close to the standard, and
    wide enough to print.
    """
    radius = outer_radius(teeth)
    angles = np.linspace(np.pi, 2 * np.pi, 13)
    across = np.concatenate([[-_MOUTH_MM], _GROOVE_MM * np.cos(angles), [_MOUTH_MM]])
    height = -(_DEPTH_MM - _GROOVE_MM) + _GROOVE_MM * np.sin(angles)
    height = np.concatenate([[0.0], height, [0.0]])
    turns = 2 * np.pi * np.arange(teeth) / teeth
    angle = turns[:, np.newaxis] + across / radius
    points = (radius + height)[..., np.newaxis] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    outline: FloatArray = points.reshape(-1, 2)
    return outline


def belt_length(first_teeth: int, second_teeth: int, distance_mm: float) -> float:
    """Return the length of an open belt around two pulleys, in mm."""
    large, small = pitch_radius(first_teeth), pitch_radius(second_teeth)
    lean = np.arcsin((large - small) / distance_mm)
    straight = 2 * distance_mm * np.cos(lean)
    return float(straight + np.pi * (large + small) + 2 * lean * (large - small))


def shaft_distance(first_teeth: int, second_teeth: int, belt_mm: float) -> float:
    """Return the distance of two shafts for a belt of a given length, in mm.

    Raises
    ------
    ValueError
        If the belt is too short for both pulleys.
    """
    low = pitch_radius(first_teeth) + pitch_radius(second_teeth)
    high = belt_mm / 2
    if high <= low or belt_length(first_teeth, second_teeth, low) > belt_mm:
        raise ValueError(f"a belt of {belt_mm:g} mm is too short")
    while high - low > 1e-9:
        middle = (low + high) / 2
        shorter = belt_length(first_teeth, second_teeth, middle) < belt_mm
        low, high = (middle, high) if shorter else (low, middle)
    return low
