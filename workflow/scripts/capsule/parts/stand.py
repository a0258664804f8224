"""Compute the outlines of the bench's plates, its belts, and the platform's scale.

Coordinates: x runs along the gut, y across it, and z upwards. The axes of both cam shafts and the
middle of the capsule are at z = 0. The middle of the gut is at y = 0. A follower's own coordinates
begin at its shaft, at the middle of its stroke: u runs towards the gut, and z upwards.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.parts.cam import Cam, relief
from capsule.parts.outlines import arc, circle, polygon, rectangle, reverse, slot

# GT2, 2 mm: pitch; distance from the belt's pitch line to the pulley's outside; depth of a groove.
_PITCH_MM = 2.0
_PITCH_LINE_MM = 0.254
_DEPTH_MM = 0.76
# Width of a line, and the lengths of the lines at 1, 5 and 10 mm.
LINE_MM = 0.4
_LENGTHS_MM = {10: 4.0, 5: 3.0, 1: 2.0}
_DIGIT_MM = (1.5, 3.0)
# The bars of each digit, of seven: top, upper left, upper right, middle, lower left, lower right,
# bottom.
_BARS = ("1110111", "0010010", "1011101", "1011011", "0111010", "1101011", "1101111", "1010010",
         "1111111", "1111011")  # fmt: skip


@dataclass(frozen=True)
class Bench:
    """Dimensions of the bench that the paper leaves open, as in config/parts.yaml."""

    length_mm: float
    follower_mm: float
    follower_gap_mm: float
    cam_radius_mm: float
    play_mm: float
    fit_mm: float
    bevel_deg: float
    frame_mm: float
    shaft_distance_mm: float
    rod_mm: float
    rod_flat_mm: float
    bearing_mm: float
    plate_mm: float
    slide_mm: float
    row_play_mm: float
    platform_width_mm: float
    platform_mm: float
    platform_top_mm: float
    cam_teeth: int
    motor_teeth: int
    drive_belt_mm: float


@dataclass(frozen=True)
class Window:
    """Half sizes of a follower's window, in mm.

    The half width is least at the follower's middle, where the ridge touches the cam, and greatest
    at its faces.
    """

    ridge_mm: float
    face_mm: float
    height_mm: float


def bore(bench: Bench, turned: bool = False) -> FloatArray:
    """Return the bore for the rod: a circle with a flat, which sets the cam's phase.

    Parameters
    ----------
    turned
        Whether the flat is on the side away from the cam's circle, instead of next to it.
    """
    radius = bench.rod_mm / 2 + bench.fit_mm
    edge = np.arccos((bench.rod_mm / 2 - bench.rod_flat_mm + bench.fit_mm) / radius)
    around = arc(np.zeros(2), radius, edge, 2 * np.pi - edge)
    return around * [-1.0, -1.0, 1.0] if turned else around


def window(bench: Bench, cam: Cam) -> Window:
    """Return the window with which a follower rides on the cam."""
    ridge = cam.radius_mm + bench.play_mm
    thickness = bench.follower_mm - bench.follower_gap_mm
    height = cam.radius_mm + cam.eccentricity_mm + bench.play_mm
    return Window(ridge, ridge + relief(thickness, bench.bevel_deg), height)


def follower_outline(bench: Bench, cam: Cam, front_mm: float) -> tuple[FloatArray, FloatArray]:
    """Return a follower's outer boundary and its window at the faces, in (u, z)."""
    opening = window(bench, cam)
    height = opening.height_mm + bench.frame_mm
    back = opening.face_mm + bench.frame_mm
    outer = rectangle(-back, -height, front_mm, height)
    inner = rectangle(-opening.face_mm, -opening.height_mm, opening.face_mm, opening.height_mm)
    return outer, reverse(inner)


def row_length(bench: Bench) -> float:
    """Return the distance between the end plates, in mm."""
    return bench.length_mm + bench.row_play_mm


def slide_levels(bench: Bench, cam: Cam) -> tuple[float, float]:
    """Return the heights of an upper slide's lower and upper side above the shafts, in mm."""
    low = window(bench, cam).height_mm + bench.frame_mm + bench.play_mm
    return low, low + bench.slide_mm


def slide_span(bench: Bench, cam: Cam, front_mm: float) -> tuple[float, float]:
    """Return the ends of a slide in a follower's coordinate u, in mm."""
    back = window(bench, cam).face_mm + bench.frame_mm + cam.eccentricity_mm
    return -back, front_mm + cam.eccentricity_mm


def tab_places(bench: Bench, cam: Cam, front_mm: float) -> list[tuple[float, float]]:
    """Return the ends of the two tabs at a slide's end in a follower's coordinate u, in mm."""
    low, high = slide_span(bench, cam, front_mm)
    width = (high - low) / 4
    return [(low + width / 2, low + 3 * width / 2), (high - 3 * width / 2, high - width / 2)]


def slide_outline(bench: Bench, cam: Cam, front_mm: float) -> FloatArray:
    """Return a slide with its tabs for the end plates, in (x, u), anticlockwise."""
    low, high = slide_span(bench, cam, front_mm)
    half = row_length(bench) / 2
    reach = half + bench.plate_mm
    right = [[half, low]]
    for start, end in tab_places(bench, cam, front_mm):
        right += [[half, start], [reach, start], [reach, end], [half, end]]
    right.append([half, high])
    edge = np.array(right)
    return polygon(np.vstack([edge, edge[::-1] * [-1.0, 1.0]]))


def motor_height(bench: Bench) -> float:
    """Return the height of the motor's shaft above the cam shaft that it drives, in mm."""
    return shaft_distance(bench.motor_teeth, bench.cam_teeth, bench.drive_belt_mm)


def end_plate(bench: Bench, cam: Cam, front_mm: float) -> tuple[FloatArray, list[FloatArray]]:
    """Return the outline of an end plate and its holes, in (y, z).

    The holes hold the bearings, the slides' tabs, the platform and the motor. The motor's holes are
    slots, so that a user can tighten the belt.
    """
    shaft = bench.shaft_distance_mm / 2
    low, high = slide_levels(bench, cam)
    play = bench.play_mm
    motor = motor_height(bench)
    back = -slide_span(bench, cam, front_mm)[0]
    edge = shaft + back + bench.plate_mm
    outline = rectangle(-edge, -(high + 2 * bench.plate_mm), edge, motor + 24.0)
    holes = []
    for side in (-1.0, 1.0):
        holes.append(circle(bench.bearing_mm / 2 + bench.fit_mm, (side * shaft, 0.0)))
        for start, end in tab_places(bench, cam, front_mm):
            ends = sorted([side * (shaft - start), side * (shaft - end)])
            for levels in ((low, high), (-high, -low)):
                holes.append(
                    rectangle(ends[0] - play, levels[0] - play, ends[1] + play, levels[1] + play)
                )
    half = bench.platform_width_mm / 2 + play
    under = bench.platform_top_mm - bench.platform_mm - play
    holes.append(rectangle(-half, under, half, bench.platform_top_mm + play))
    # 28BYJ-48: the shaft is 8 mm beside the middle of the body; two screws of 4 mm, 35 mm apart.
    holes.append(slot((shaft, motor), 10.0, 6.0))
    holes += [slot((shaft + side * 17.5, motor + 8.0), 4.2, 6.0) for side in (-1.0, 1.0)]
    return outline, [reverse(hole) for hole in holes]


def pitch_radius(teeth: int) -> float:
    """Return the radius of the belt's pitch line, in mm."""
    return teeth * _PITCH_MM / (2 * np.pi)


def outer_radius(teeth: int) -> float:
    """Return the radius of the pulley's outside, in mm."""
    return pitch_radius(teeth) - _PITCH_LINE_MM


def teeth_around(radius_mm: float) -> int:
    """Return the least number of teeth of a pulley whose grooves stay outside a radius."""
    return int(np.ceil((radius_mm + _DEPTH_MM + _PITCH_LINE_MM) * 2 * np.pi / _PITCH_MM))


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
    nearest = pitch_radius(first_teeth) + pitch_radius(second_teeth)
    distance = belt_mm / 2
    if distance <= nearest or belt_length(first_teeth, second_teeth, nearest) > belt_mm:
        raise ValueError(f"a belt of {belt_mm:g} mm is too short")
    apart = pitch_radius(first_teeth) - pitch_radius(second_teeth)
    # Newton's steps: from above, they come ever closer, because the length is convex.
    while (more := belt_length(first_teeth, second_teeth, distance) - belt_mm) > 1e-12 * belt_mm:
        distance -= more / (2 * np.sqrt(1 - (apart / distance) ** 2))
    return float(distance)


def _digit(digit: int, left: float, low: float) -> list[FloatArray]:
    wide, high = _DIGIT_MM
    middle, line = high / 2, LINE_MM
    bars = [
        (0.0, high - line, wide, high),
        (0.0, middle, line, high),
        (wide - line, middle, wide, high),
        (0.0, middle - line / 2, wide, middle + line / 2),
        (0.0, 0.0, line, middle),
        (wide - line, 0.0, wide, middle),
        (0.0, 0.0, wide, line),
    ]
    drawn = [bar for bar, on in zip(bars, _BARS[digit], strict=True) if on == "1"]
    return [rectangle(left + a, low + b, left + c, low + d) for a, b, c, d in drawn]


def scale_marks(length_mm: float, width_mm: float) -> list[FloatArray]:
    """Return the lines and digits of a scale, each a rectangle, in (x, y).

    Parameters
    ----------
    length_mm
        Length of the scale; it begins at ``-length_mm / 2``.
    width_mm
        Width of the platform; the lines begin at its edge.
    """
    marks = []
    edge = -width_mm / 2
    for position in range(round(length_mm) + 1):
        at = position - length_mm / 2
        length = next(size for step, size in _LENGTHS_MM.items() if position % step == 0)
        # A line begins beyond the edge, so that its end is open there.
        marks.append(rectangle(at - LINE_MM / 2, edge - 0.5, at + LINE_MM / 2, edge + length))
        if position % 10 == 0:
            text = str(position)
            left = at - (len(text) * (_DIGIT_MM[0] + LINE_MM) - LINE_MM) / 2
            for place, digit in enumerate(text):
                offset = left + place * (_DIGIT_MM[0] + LINE_MM)
                marks += _digit(int(digit), offset, edge + _LENGTHS_MM[10] + 0.6)
    return marks
