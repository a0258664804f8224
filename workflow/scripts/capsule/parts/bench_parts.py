"""Make the bench's parts: cam shafts, followers, slides, platform and end plates.

Coordinates: x runs along the gut, y across it, and z upwards. The axes of both cam shafts and the
middle of the capsule are at z = 0. The middle of the gut is at y = 0. A follower's own coordinates
begin at its shaft, at the middle of its stroke: u runs towards the gut, and z upwards.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.parts.cam import phase_step, relief, steepest_overhang
from capsule.parts.design import BENCH, Bench, Design, Part
from capsule.parts.outlines import (
    Prism,
    Solid,
    arc,
    circle,
    mirrored,
    polygon,
    rectangle,
    reverse,
    slot,
)
from capsule.parts.solids import united

# GT2, 2 mm: pitch; distance from the belt's pitch line to the pulley's outside; depth of a groove.
_PITCH_MM = 2.0
_PITCH_LINE_MM = 0.254
_DEPTH_MM = 0.76
# Depth of the platform's scale, width of a line, and the lengths of the lines at 1, 5 and 10 mm.
_ENGRAVED_MM = _LINE_MM = 0.4
_LENGTHS_MM = {10: 4.0, 5: 3.0, 1: 2.0}
_DIGIT_MM = (1.5, 3.0)
# The bars of each digit, of seven: top, upper left, upper right, middle, lower left, lower right,
# bottom.
_BARS = ("1110111", "0010010", "1011101", "1011011", "0111010", "1101011", "1101111", "1010010",
         "1111111", "1111011")  # fmt: skip


def bench_parts(design: Design) -> list[Part]:
    """Return all parts of the bench."""
    once = (follower, slide, platform, end_plate)
    return [*cam_sections(design), *(make(design) for make in once)]


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


def cam_solid(design: Design, turned: bool = False) -> Solid:
    """Return one section of a cam shaft, which is one turn, printed upright.

    A belt joins both shafts, so they turn in the same direction. For the mirrored wave, the second
    shaft has the same hand and is half a turn ahead: its key is turned, and its cam not mirrored.
    """
    keyed = Prism([bore(design.parts.bench, turned)], -1.0, design.cam.lead_mm + 1.0)
    return Solid(design.cam, [keyed])


def cam_sections(design: Design) -> list[Part]:
    """Return the sections of both cam shafts."""
    cam = design.cam
    return [
        Part(
            f"cam-{side}",
            cam_solid(design, turned),
            round(design.parts.bench.length_mm / cam.lead_mm),
            BENCH,
            f"A section of the {side} cam shaft, one wave long; the flat of the rod keys it.",
            "wall.wavelength_mm",
            sizes={
                "radius_mm": cam.radius_mm,
                "eccentricity_mm": cam.eccentricity_mm,
                "lead_mm": cam.lead_mm,
                "overhang_deg": steepest_overhang(cam),
                "key_deg": 180.0 if turned else 0.0,
            },
        )
        for side, turned in (("left", False), ("right", True))
    ]


def window(design: Design) -> Window:
    """Return the window with which a follower rides on the cam."""
    bench, cam = design.parts.bench, design.cam
    ridge = cam.radius_mm + bench.play_mm
    height = cam.radius_mm + cam.eccentricity_mm + bench.play_mm
    return Window(ridge, ridge + relief(bench.thickness_mm, bench.bevel_deg), height)


def window_cut(opening: Window, thickness_mm: float, centre_mm: float = 0.0) -> Prism:
    """Return the prism to cut for a window, which is narrowest at the middle of the plate.

    Parameters
    ----------
    thickness_mm
        Thickness of the plate, which lies on z = 0.
    centre_mm
        Position of the window's middle along x.
    """
    ridge, face = opening.ridge_mm, opening.face_mm
    heights = np.array([-1.0, 0.0, thickness_mm / 2, thickness_mm, thickness_mm + 1.0])
    right = np.column_stack([[face, face, ridge, face, face], heights])
    profile = mirrored(polygon(right), "y") + np.array([centre_mm, 0.0, 0.0])
    return Prism([profile], -opening.height_mm, opening.height_mm, "y")


def follower_outline(design: Design) -> tuple[FloatArray, FloatArray]:
    """Return a follower's outer boundary and its window at the faces, in (u, z)."""
    opening, frame = window(design), design.parts.bench.frame_mm
    height, back = opening.height_mm + frame, opening.face_mm + frame
    outer = rectangle(-back, -height, design.front_mm, height)
    inner = rectangle(-opening.face_mm, -opening.height_mm, opening.face_mm, opening.height_mm)
    return outer, reverse(inner)


def follower_solid(design: Design) -> Solid:
    """Return a follower that lies on its face, with u as x and z as y."""
    outer, _ = follower_outline(design)
    thickness = design.parts.bench.thickness_mm
    return Solid(Prism([outer], 0.0, thickness), [window_cut(window(design), thickness)])


def follower(design: Design) -> Part:
    """Return the follower; both rows consist of followers."""
    bench, opening = design.parts.bench, window(design)
    return Part(
        "follower",
        follower_solid(design),
        2 * round(bench.length_mm / bench.follower_mm),
        BENCH,
        "Pushes the silicone; the ridge in its window rides on the cam.",
        "bench.shaft_distance_mm",
        cuts=follower_outline(design),
        sizes={
            "thickness_mm": bench.thickness_mm,
            "pitch_mm": bench.follower_mm,
            "phase_step_deg": phase_step(design.cam, bench.follower_mm),
            "ridge_mm": 2 * opening.ridge_mm,
            "window_height_mm": 2 * opening.height_mm,
            "front_mm": design.front_mm,
        },
    )


def slide_levels(design: Design) -> tuple[float, float]:
    """Return the heights of an upper slide's lower and upper side above the shafts, in mm."""
    bench = design.parts.bench
    low = window(design).height_mm + bench.frame_mm + bench.play_mm
    return low, low + bench.slide_mm


def slide_span(design: Design) -> tuple[float, float]:
    """Return the ends of a slide in a follower's coordinate u, in mm."""
    stroke = design.cam.eccentricity_mm
    back = window(design).face_mm + design.parts.bench.frame_mm + stroke
    return -back, design.front_mm + stroke


def tab_places(design: Design) -> list[tuple[float, float]]:
    """Return the ends of the two tabs at a slide's end in a follower's coordinate u, in mm."""
    low, high = slide_span(design)
    width = (high - low) / 4
    return [(low + width / 2, low + 3 * width / 2), (high - 3 * width / 2, high - width / 2)]


def slide(design: Design) -> Part:
    """Return a slide with tabs for the end plates; each row has one above and one below it."""
    bench, (low, high) = design.parts.bench, slide_span(design)
    half = bench.row_mm / 2
    reach = half + bench.plate_mm
    right = [[half, low]]
    for start, end in tab_places(design):
        right += [[half, start], [reach, start], [reach, end], [half, end]]
    right.append([half, high])
    outline = mirrored(polygon(right), "y")
    return Part(
        "slide",
        Solid(Prism([outline], 0.0, bench.slide_mm)),
        4,
        BENCH,
        "Lies above or below a row, so that followers slide across the gut alone.",
        "bench.length_mm",
        cuts=[outline],
        sizes={"thickness_mm": bench.slide_mm, "between_plates_mm": bench.row_mm},
    )


def end_plate_outlines(design: Design) -> list[FloatArray]:
    """Return the outline of an end plate, followed by its holes, in (y, z).

    The holes hold the bearings, the slides' tabs, the platform and the motor. The motor's holes are
    slots, so that a user can tighten the belt.
    """
    bench, (low, high) = design.parts.bench, slide_levels(design)
    shaft, play, motor = bench.shaft_distance_mm / 2, bench.play_mm, motor_height(bench)
    edge = shaft - slide_span(design)[0] + bench.plate_mm
    outline = rectangle(-edge, -(high + 2 * bench.plate_mm), edge, motor + 24.0)
    holes = []
    for side in (-1.0, 1.0):
        holes.append(circle(bench.bearing_mm / 2 + bench.fit_mm, (side * shaft, 0.0)))
        for tab in tab_places(design):
            left, right = sorted(side * (shaft - end) for end in tab)
            for under, over in ((low, high), (-high, -low)):
                holes.append(rectangle(left - play, under - play, right + play, over + play))
    half = bench.platform_width_mm / 2 + play
    under = bench.platform_top_mm - bench.platform_mm - play
    holes.append(rectangle(-half, under, half, bench.platform_top_mm + play))
    # 28BYJ-48: the shaft is 8 mm beside the middle of the body; two screws of 4 mm, 35 mm apart.
    holes.append(slot((shaft, motor), 10.0, 6.0))
    holes += [slot((shaft + side * 17.5, motor + 8.0), 4.2, 6.0) for side in (-1.0, 1.0)]
    return [outline, *(reverse(hole) for hole in holes)]


def end_plate(design: Design) -> Part:
    """Return an end plate, which holds bearings, slides and platform; one also holds the motor."""
    bench, outlines = design.parts.bench, end_plate_outlines(design)
    return Part(
        "end-plate",
        Solid(Prism(outlines, 0.0, bench.plate_mm)),
        2,
        BENCH,
        "Holds both shafts, the slides, the platform and the motor.",
        "bench.drive_belt_mm",
        cuts=outlines,
        sizes={
            "thickness_mm": bench.plate_mm,
            "shaft_distance_mm": bench.shaft_distance_mm,
            "motor_height_mm": motor_height(bench),
        },
    )


def motor_height(bench: Bench) -> float:
    """Return the height of the motor's shaft above the cam shaft that it drives, in mm."""
    return shaft_distance(bench.motor_teeth, bench.cam_teeth, bench.drive_belt_mm)


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


def platform(design: Design) -> Part:
    """Return the platform with its scale, which begins at the row's left end."""
    bench = design.parts.bench
    # Its ends stand in the end plates.
    length, width = bench.row_mm + 2 * bench.plate_mm, bench.platform_width_mm
    outline = rectangle(-length / 2, -width / 2, length / 2, width / 2)
    marks, top = united(scale_marks(bench.length_mm, width)), bench.platform_mm
    engraved = Prism(marks, top - _ENGRAVED_MM, top + 1.0)
    return Part(
        "platform",
        Solid(Prism([outline], 0.0, top), [engraved]),
        1,
        BENCH,
        "Carries the capsule between the walls; the scale tells how far it has moved.",
        "bench.length_mm",
        cuts=[outline],
        marks=marks,
        sizes={
            "width_mm": width,
            "thickness_mm": top,
            "scale_mm": bench.length_mm,
        },
    )


def _digit(digit: int, left: float, low: float) -> list[FloatArray]:
    wide, high = _DIGIT_MM
    middle, line = high / 2, _LINE_MM
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
        marks.append(rectangle(at - _LINE_MM / 2, edge - 0.5, at + _LINE_MM / 2, edge + length))
        if position % 10 == 0:
            text = str(position)
            left = at - (len(text) * (_DIGIT_MM[0] + _LINE_MM) - _LINE_MM) / 2
            for place, digit in enumerate(text):
                offset = left + place * (_DIGIT_MM[0] + _LINE_MM)
                marks += _digit(int(digit), offset, edge + _LENGTHS_MM[10] + 0.6)
    return marks
