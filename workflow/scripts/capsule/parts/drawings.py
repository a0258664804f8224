"""Draw capsule and bench with dimensions, for the report and for workshop drawings."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from capsule.arrays import FloatArray
from capsule.figures.style import BLUE, GREEN, INK, MUTED, ORANGE
from capsule.kinds import Look
from capsule.parts.bench_parts import (
    bore,
    end_plate_outlines,
    follower_outline,
    motor_height,
    slide_levels,
    slide_span,
    window,
)
from capsule.parts.cam import follower_displacement
from capsule.parts.design import Design
from capsule.parts.outlines import circle, points, polygon, rectangle
from capsule.parts.substructure import (
    EYELET_AT_MM,
    Choices,
    Shape,
    cut_lines,
    glue_faces,
    outline,
    top_mm,
    wire_positions,
)
from capsule.phantom.origami import Origami, pitch, sensor_offsets, vertices

_CAPSULE_COLOUR, _EMPTY = "#c9d6e4", "#ffffff"
_FOLLOWER, _CAM = "#e9e4d8", "#cdd3da"
_STEEL, _SLIDE, _WALL, _SHEET = "#8a8a8a", "#f4f1ea", "#f3c6b8", "#f9e3da"
_AXIS: Look = {"color": MUTED, "linewidth": 0.5, "linestyle": (0, (8, 2, 1.5, 2))}
_CUT: Look = {"color": ORANGE, "linewidth": 1.4, "linestyle": (0, (2, 1))}
_GLUE: Look = {"color": GREEN, "linewidth": 1.8, "solid_capstyle": "butt"}
_END = {"mutation_scale": 5.0, "linewidth": 0.5, "color": INK, "shrinkA": 0, "shrinkB": 0}
_ARROW = {"arrowstyle": "<|-|>"} | _END
# A point in mm: x and y.
Point = Sequence[float] | FloatArray
_THIN: Look = {"color": MUTED, "linewidth": 0.4, "solid_capstyle": "butt"}


def length_text(value_mm: float) -> str:
    """Return a length as drawings print it: to 0.01 mm, without trailing zeros."""
    return f"{value_mm:.2f}".rstrip("0").rstrip(".").replace("-", "\u2212")


def draw_length(
    axes: Axes,
    start: Point,
    end: Point,
    at: float,
    name: str = "",
    *,
    upright: bool = False,
    outside: bool = False,
    part: float = 1.0,
) -> None:
    """Draw the dimension of the distance between two points along one axis.

    The dimension's line lies at ``at``, along y if ``upright``. A number along x without room
    stands ``outside``. ``part`` is the magnification of this part of the drawing.
    """
    along, across = (1, 0) if upright else (0, 1)
    low, high = sorted((float(start[along]), float(end[along])))

    def point(value: float, beside: float) -> tuple[float, float]:
        return (beside, value) if upright else (value, beside)

    for corner in (start, end):
        line = np.array([point(float(corner[along]), each) for each in (float(corner[across]), at)])
        axes.plot(*line.T, **_THIN)
    length = length_text((high - low) / part)
    text = f"{name} = {length}" if name else length
    if outside:
        # Arrows point inwards from both sides; the number follows the second arrow.
        reach = 0.9
        for tip, tail in ((low, low - reach), (high, high + reach)):
            arrow = {"arrowstyle": "-|>"} | _END
            axes.annotate("", point(tip, at), point(tail, at), arrowprops=arrow)
        axes.text(high + reach, at, f" {text}", ha="left", va="center")
        return
    axes.annotate("", point(low, at), point(high, at), arrowprops=_ARROW)
    axes.text(
        *point((low + high) / 2, at),
        text,
        ha="center",
        va="center",
        rotation=90 if upright else 0,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
    )


def draw_label(
    axes: Axes,
    point: Point,
    where: tuple[float, float],
    text: str,
    **look: Any,  # noqa: ANN401
) -> None:
    """Draw a label with a leader line to its point."""
    leader = {"arrowstyle": "-", "linewidth": 0.5, "color": MUTED, "shrinkA": 0, "shrinkB": 0}
    tip = float(point[0]), float(point[1])
    axes.annotate(text, tip, where, arrowprops=leader, va="center", **look)


def draw_area(axes: Axes, area: FloatArray, colour: str, **look: Any) -> None:  # noqa: ANN401
    """Fill an outline."""
    style = {"facecolor": colour, "edgecolor": INK, "linewidth": 0.6} | look
    axes.add_patch(Polygon(points(area), closed=True, **style))


def true_scale(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    """Limit the axes to the ranges x and y, with equal scales and without axis lines."""
    axes.set(xlim=x, ylim=y, aspect="equal")
    axes.set_axis_off()


def draw_section(axes: Axes, boundaries: Sequence[FloatArray], colour: str) -> None:
    """Fill an outline, the first of the boundaries, and leave its holes empty."""
    outer, *holes = boundaries
    draw_area(axes, outer, colour)
    for hole in holes:
        draw_area(axes, hole, _EMPTY)


def draw_substructure(axes: Axes, design: Design) -> None:
    """Draw the dimensioned substructure with cut, wires and glue faces."""
    origami, choices = design.phantom.origami, design.parts.choice
    shape, corner = design.shape, vertices(origami)
    draw_section(axes, outline(shape), _CAPSULE_COLOUR)
    faces, side = glue_faces(shape), shape.side
    right = max(float(faces["head"][0, 0]), float(corner["C"][0])) + 1.0
    left = float(min(shape.cap[0] - shape.cap_radius_mm, faces["tail"][0, 0])) - 1.0
    axes.plot([left - 2.6, right + 6.0], [0, 0], **_AXIS)
    for face in faces.values():
        axes.plot(*face.T, **_GLUE)
    for line in cut_lines(shape, choices):
        beyond = np.array([[0.55, 0.0], [-0.55, 0.0]]) * np.sign(line[0, 0] - line[1, 0])
        axes.plot(*(line + beyond).T, **_CUT)
    axes.plot(*wire_positions(shape, choices).T, "o", color=BLUE, markersize=3.2, zorder=5)
    _draw_names(axes, corner, side)
    _draw_legend(axes, shape, choices)
    # The dimension of the flat at the head is on the right, beyond the heights.
    at_head, at_tail = ("A", "B") if side > 0 else ("B", "A")
    for name, at in ((at_head, right + 4.2), (at_tail, left - 0.2)):
        ends = corner[name], corner[name] * [1.0, -1.0]
        draw_length(axes, *ends, at, upright=True, name=f"{name}{name}\u2032")
    _draw_heights(axes, corner, right)
    draw_length(axes, corner["D"], corner["D"] * [1.0, -1.0], left - 1.8, upright=True, name="w")
    below = -float(corner["D"][1]) - 1.2
    draw_length(axes, corner["A"] * [1.0, -1.0], corner["B"] * [1.0, -1.0], below)
    _draw_angles(axes, origami, corner, side)
    middle = (shape.fold + shape.shoulder) / 2 * [1.0, -1.0]
    beside, wall = "left" if side > 0 else "right", length_text(origami.wall_thickness_mm)
    where = (middle[0] + side * 2.6, middle[1] - 1.5)
    draw_label(axes, middle, where, f"wall {wall}", ha=beside)
    tip = shape.cap * [1.0, -1.0]
    radius = f"r = {length_text(shape.cap_radius_mm)}"
    draw_label(axes, tip, (tip[0] + 2.2, tip[1] - 0.3), radius, ha="left")
    tall = float(corner["D"][1]) + 3.0
    true_scale(axes, (left - 3.2, right + 6.4), (-tall, tall))


def _draw_legend(axes: Axes, shape: Shape, choices: Choices) -> None:
    """Label the cut, the wires and the glue faces."""
    beside = (shape.fold[0] + shape.lower[0]) / 2 - 0.6
    look: Look = {"ha": "left", "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 0.6}}
    for wire, height in zip(wire_positions(shape, choices), (1.2, -1.2), strict=True):
        draw_label(axes, wire, (beside, height), "wire", color=BLUE, **look)
    for cut in cut_lines(shape, choices)[:1]:
        draw_label(axes, cut.mean(axis=0), (beside, 0.0), "cut", color=ORANGE, **look)
    point = glue_faces(shape)["head"][0] * [1.0, 0.6]
    draw_label(axes, point, (point[0] + 1.0, point[1] - 2.6), "glue", ha="left", color=GREEN)


def _draw_names(axes: Axes, corner: dict[str, FloatArray], side: float) -> None:
    beside = {"A": (-0.9 * side, 0.0), "B": (0.9 * side, 0.0), "C": (side, 0.5), "D": (1.5, 0.1)}
    look: Look = {"ha": "center", "va": "center", "weight": "bold"}
    for name, point in corner.items():
        x, y = point + np.array(beside[name])
        axes.text(x, y, name, **look)
        if name != "D":
            axes.text(x, -y, f"{name}\u2032", **look)


def _draw_heights(axes: Axes, corner: dict[str, FloatArray], right: float) -> None:
    at = right + 1.2
    levels = [np.array([right, 0.0]), corner["A"], corner["C"], corner["D"]]
    for name, (low, high) in zip("\u2081\u2082\u2083", pairwise(levels), strict=True):
        draw_length(axes, low, high, at, upright=True)
        axes.text(at + 0.7, (low[1] + high[1]) / 2, f"h{name}", ha="left", va="center")


def _draw_angles(axes: Axes, origami: Origami, corner: dict[str, FloatArray], side: float) -> None:
    to_a, to_b = (np.arctan2(*(corner[name] - corner["C"])[::-1]) for name in "AB")
    angles = np.linspace(to_b, to_a, 40)
    around = np.column_stack([np.cos(angles), np.sin(angles)])
    axes.plot(*(corner["C"] + 2.4 * around).T, color=INK, linewidth=0.5)
    middle = (to_a + to_b) / 2
    x, y = corner["C"] + 3.3 * np.array([np.cos(middle), np.sin(middle)]) + [0.6 * side, -0.8]
    beta = f"\u03b2 = {length_text(origami.fold_angle_deg)}\u00b0"
    axes.text(x, y, beta, ha="center", va="center")
    # The dashed line across the axis is the reference for the awn's tilt.
    tilt = origami.awn_tilt_deg
    top = corner["D"][1] + 2.4
    axes.plot([corner["B"][0]] * 2, [corner["B"][1], top], **_AXIS)
    lean = corner["B"][0] - (top - corner["B"][1]) * np.tan(np.radians(tilt))
    axes.plot([corner["D"][0], lean], [corner["D"][1], top], **_AXIS)
    alpha = f"\u03b1 = {length_text(tilt)}\u00b0"
    axes.text(corner["B"][0] + 0.3, top, alpha, ha="left", va="top")


def draw_row(axes: Axes, design: Design) -> None:
    """Draw the row of substructures with their sensors' numbers and wires."""
    origami, choices, shape = design.phantom.origami, design.parts.choice, design.shape
    faces, half = glue_faces(shape), top_mm(shape)
    places = -sensor_offsets(origami, design.sensors)
    middle = (shape.fold[0] + shape.lower[0]) / 2
    for number, place in enumerate(places.tolist(), start=1):
        moved = [boundary + np.array([place, 0.0, 0.0]) for boundary in outline(shape)]
        draw_section(axes, moved, _CAPSULE_COLOUR)
        look: Look = {"ha": "center", "va": "center", "weight": "bold", "fontsize": 9}
        axes.text(place + middle, 0.0, str(number), **look)
        for x, y in wire_positions(shape, choices) + np.array([place, 0.0]):
            out = np.copysign(half + 2.2, y)
            axes.plot([x, x], [y, out], color=BLUE, linewidth=0.5, zorder=4)
            axes.plot(x, y, "o", color=BLUE, markersize=2.4, zorder=5)
        if number < design.sensors:
            glued = faces["tail"][:, 0] + place - origami.adhesive_mm / 2
            axes.plot(glued, faces["tail"][:, 1], **_GLUE)
    tail = faces["tail"][0, 0] + places[-1]
    if choices.folding == "eyelets":
        start = faces["head"][0, 0] + 2.5
        for side in (-1.0, 1.0):
            cable = [side * EYELET_AT_MM] * 2
            axes.plot([start, tail], cable, color=ORANGE, linewidth=0.7, zorder=6)
        axes.text(start, 2.2, "cables\n(ours)", ha="center", va="bottom", color=ORANGE)
    axes.text(faces["head"][0, 0] + 0.8, 0.0, "head", ha="left", va="center", color=MUTED)
    axes.text(tail - 0.8, 0.0, "tail", ha="right", va="center", color=MUTED)
    low, high = faces["head"]
    draw_length(axes, low, (tail, faces["tail"][0, 1]), -half - 4.2)
    draw_length(axes, high, (high[0] - pitch(origami), high[1]), half + 3.8, "pitch")
    true_scale(axes, (tail - 5.0, low[0] + 5.0), (-half - 5.2, half + 5.2))


def draw_bench(axes: Axes, design: Design) -> None:
    """Draw the bench in section across the gut, with the walls at their baselines."""
    bench, cam, wall = design.parts.bench, design.cam, design.phantom.wall
    opening, (outer, _) = window(design), follower_outline(design)
    (low, high), (back, front) = slide_levels(design), slide_span(design)
    ridge, height, tall = opening.ridge_mm, opening.height_mm, outer[:, 1].max() - 1.0
    shaft, inner = bench.shaft_distance_mm / 2, wall.lumen_mm / 2
    baseline = shaft - inner
    behind = baseline - wall.wall_mm
    # In a follower's coordinates.
    areas = (
        (outer, _FOLLOWER),
        (rectangle(-ridge, -height, ridge, height), _EMPTY),
        (circle(cam.radius_mm, (0.0, cam.eccentricity_mm)), _CAM),
        (circle(bench.rod_mm / 2), _STEEL),
        (rectangle(back, low, front, high), _SLIDE),
        (rectangle(back, -high, front, -low), _SLIDE),
        (rectangle(baseline, -tall, behind, tall), _WALL),
        (rectangle(behind, -tall, behind - wall.sheet_mm, tall), _SHEET),
    )
    for side in (-1.0, 1.0):
        # A follower's coordinate u increases towards the gut; a mirrored arc turns the other way.
        at, flip = np.array([side * shaft, 0.0, 0.0]), np.array([-side, 1.0, -side])
        for area, colour in areas:
            draw_area(axes, at + flip * area, colour)
    half, top = bench.platform_width_mm / 2, bench.platform_top_mm
    draw_area(axes, rectangle(-half, top - bench.platform_mm, half, top), _FOLLOWER)
    pressed, over = min(top_mm(design.shape), inner), top + design.phantom.origami.height_mm
    draw_area(axes, rectangle(-pressed, top, pressed, over), _CAPSULE_COLOUR)
    _label_bench(axes, design)
    wide = shaft - back + 44.0
    true_scale(axes, (-wide, wide), (-high - 8.0, high + 7.0))


def _label_bench(axes: Axes, design: Design) -> None:
    bench, cam, wall = design.parts.bench, design.cam, design.phantom.wall
    (low, high), shaft = slide_levels(design), bench.shaft_distance_mm / 2
    edge, inner = shaft - slide_span(design)[0], wall.lumen_mm / 2
    silicone = wall.wall_mm + wall.sheet_mm
    draw_length(axes, (-shaft, 0.0), (shaft, 0.0), -high - 4.5)
    draw_length(axes, (-inner, high), (inner, high), high + 3.5)
    names = (
        (1, (shaft + 6.0, 4.0), f"cam, radius {length_text(cam.radius_mm)}"),
        (1, (shaft, 0.0), f"rod, {length_text(cam.eccentricity_mm)} off"),
        (1, (edge - 6.5, -14.0), f"follower {length_text(bench.follower_mm)}"),
        (1, (edge - 3.0, -(low + high) / 2), "slide"),
        (-1, (-inner - wall.wall_mm / 2, 11.0), f"wall {length_text(wall.wall_mm)}"),
        (-1, (-inner - silicone / 2, 6.0), f"sheet {length_text(wall.sheet_mm)}"),
        (-1, (-inner + 4.0, 0.0), "capsule"),
        (-1, (1.0 - bench.platform_width_mm / 2, bench.platform_top_mm - 4.0), "platform"),
    )
    for number, (side, point, text) in enumerate(names):
        where = (side * (edge + 3.0), 13.0 - 9.0 * (number % 4))
        draw_label(axes, point, where, text, ha="left" if side > 0 else "right")


def draw_follower(axes: Axes, design: Design) -> None:
    """Draw a follower from the front and from the side, with the ridge of its window."""
    cam, opening = design.cam, window(design)
    outer, inner = follower_outline(design)
    draw_section(axes, (outer, inner), _FOLLOWER)
    for u in (-opening.ridge_mm, opening.ridge_mm):
        axes.plot([u, u], [-opening.height_mm, opening.height_mm], color=INK, linewidth=0.4)
    outer, inner = outer[:, :2], inner[:, :2]
    low, high = outer.min(axis=0), outer.max(axis=0)
    draw_area(axes, circle(cam.radius_mm), _EMPTY, facecolor="none", linestyle=(0, (4, 2)))
    axes.plot([low[0] - 2, high[0] + 2], [0, 0], **_AXIS)
    axes.plot([0, 0], [low[1] - 2, high[1] + 2], **_AXIS)
    ridge = opening.ridge_mm
    draw_length(axes, (-ridge, 0.0), (ridge, 0.0), low[1] - 3.5, "ridge")
    draw_length(axes, inner.min(axis=0), inner.max(axis=0), low[1] - 7.0)
    draw_length(axes, low, high, low[1] - 10.5)
    draw_length(axes, (0.0, 0.0), (high[0], 0.0), high[1] + 3.5, "front")
    draw_length(axes, inner.min(axis=0), inner.max(axis=0), low[0] - 3.5, upright=True)
    draw_length(axes, low, high, low[0] - 7.0, upright=True)
    _draw_follower_section(axes, design, float(high[0]) + 16.0)
    true_scale(axes, (low[0] - 9.0, high[0] + 28.0), (low[1] - 12.5, high[1] + 6.0))


def _draw_follower_section(axes: Axes, design: Design, left: float) -> None:
    """Draw the frame in section along the shaft, with the ridge in the middle of its thickness."""
    bench, opening = design.parts.bench, window(design)
    # Draw it five times as large, because the ridge is too small to see otherwise.
    large, depth = 5.0, -2 * bench.frame_mm
    half, bevel = bench.thickness_mm / 2 * large, (opening.face_mm - opening.ridge_mm) * large
    profile = np.array([[-half, depth], [half, depth], [half, 0.0], [0.0, bevel], [-half, 0.0]])
    profile[:, 0] += left
    draw_area(axes, polygon(profile), _FOLLOWER)
    axes.text(left, depth - 8.0, "window\u2019s edge, 5 times", ha="center", va="center")
    draw_length(axes, profile[0], profile[1], depth - 4.0, part=large)
    text = f"ridge, bevel {length_text(bench.bevel_deg)}\u00b0"
    draw_label(axes, profile[3], (left, profile[3, 1] + 5.0), text, ha="center")


def draw_cam(axes: Axes, design: Design) -> None:
    """Draw the cam shaft in section, seen from its end, and one lead of it from the side."""
    bench, cam = design.parts.bench, design.cam
    centre = (cam.eccentricity_mm, 0.0)
    draw_section(axes, (circle(cam.radius_mm, centre), bore(bench)), _CAM)
    reach = cam.radius_mm + cam.eccentricity_mm
    axes.plot([-reach, reach + 2], [0, 0], **_AXIS)
    axes.plot([0, 0], [-reach, reach], **_AXIS)
    draw_length(axes, (0.0, 0.0), centre, reach + 2.5, outside=True)
    draw_length(axes, centre, (centre[0] + cam.radius_mm, 0.0), -reach - 2.5, "R")
    flat, bored = bench.rod_mm / 2 - bench.rod_flat_mm, bench.rod_mm + 2 * bench.fit_mm
    text = f"bore {length_text(bored)}, flat keys the phase"
    draw_label(axes, (flat, 1.0), (-reach + 1.0, reach + 4.0), text, ha="center")
    start = reach + 12.0
    end, along = start + cam.lead_mm, np.linspace(0.0, cam.lead_mm, 241)
    middle = follower_displacement(cam, along, np.zeros(1))
    above, below = (
        np.column_stack([start + along, middle + side]) for side in (cam.radius_mm, -cam.radius_mm)
    )
    draw_area(axes, polygon(np.vstack([above, below[::-1]])), _CAM)
    axes.plot([start - 3, end + 3], [0, 0], **_AXIS)
    axes.plot(start + along, middle, color=INK, linewidth=0.5, linestyle=(0, (4, 2)))
    draw_length(axes, (start, -cam.radius_mm), (end, -cam.radius_mm), -reach - 2.5)
    true_scale(axes, (-reach - 18.0, end + 5.0), (-reach - 5.0, reach + 7.0))


def draw_end_plate(axes: Axes, design: Design) -> None:
    """Draw an end plate with its openings, seen along the gut."""
    bench, outlines = design.parts.bench, end_plate_outlines(design)
    draw_section(axes, outlines, _FOLLOWER)
    low, high = outlines[0][:, :2].min(axis=0), outlines[0][:, :2].max(axis=0)
    shaft, motor = bench.shaft_distance_mm / 2, motor_height(bench)
    axes.plot([low[0] - 2, high[0] + 2], [0, 0], **_AXIS)
    for side in (-shaft, shaft):
        axes.plot([side, side], [low[1] - 2, high[1] + 2], **_AXIS)
    draw_length(axes, (-shaft, 0.0), (shaft, 0.0), low[1] - 4.0)
    draw_length(axes, low, high, low[1] - 8.0)
    draw_length(axes, low, high, low[0] - 10.0, upright=True)
    draw_length(axes, (shaft, 0.0), (shaft, motor), high[0] + 5.0, "motor", upright=True)
    tab, (_, level) = outlines[2][:, 0].mean(), slide_levels(design)
    bearing = length_text(bench.bearing_mm + 2 * bench.fit_mm)
    for point, height, text in (
        ((-shaft, bench.bearing_mm / 2), 40.0, f"bearing {bearing}"),
        ((0.0, bench.platform_top_mm), 30.0, "platform"),
        ((tab, level), 50.0, "slides"),
    ):
        draw_label(axes, point, (point[0], height), text, ha="center")
    true_scale(axes, (low[0] - 14.0, high[0] + 10.0), (low[1] - 11.0, high[1] + 5.0))
