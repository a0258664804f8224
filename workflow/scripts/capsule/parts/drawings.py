"""Draw capsule and bench with dimensions, for the report and for workshop drawings."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from capsule.arrays import FloatArray
from capsule.figures.style import BLUE, GREEN, INK, MUTED, ORANGE
from capsule.kinds import Look
from capsule.parts import stand
from capsule.parts.design import Design
from capsule.parts.outlines import circle, points, rectangle
from capsule.parts.substructure import (
    EYELET_AT_MM,
    Choices,
    Shape,
    cut_lines,
    glue_faces,
    outline,
    shape_of,
    top_mm,
    wire_positions,
)
from capsule.phantom.origami import Origami, pitch, vertices

CAPSULE_COLOUR, EMPTY = "#c9d6e4", "#ffffff"
FOLLOWER, CAM = "#e9e4d8", "#cdd3da"
_STEEL, _SLIDE, _WALL, _SHEET = "#8a8a8a", "#f4f1ea", "#f3c6b8", "#f9e3da"
AXIS: Look = {"color": MUTED, "linewidth": 0.5, "linestyle": (0, (8, 2, 1.5, 2))}
_CUT: Look = {"color": ORANGE, "linewidth": 1.4, "linestyle": (0, (2, 1))}
_GLUE: Look = {"color": GREEN, "linewidth": 1.8, "solid_capstyle": "butt"}
_END = {"mutation_scale": 5.0, "linewidth": 0.5, "color": INK, "shrinkA": 0, "shrinkB": 0}
_ARROW = {"arrowstyle": "<|-|>"} | _END
_THIN: Look = {"color": MUTED, "linewidth": 0.4, "solid_capstyle": "butt"}


def length_text(value_mm: float) -> str:
    """Return a length as drawings print it: to 0.01 mm, without trailing zeros."""
    return f"{value_mm:.2f}".rstrip("0").rstrip(".").replace("-", "\u2212")


def draw_length(
    axes: Axes,
    start: FloatArray,
    end: FloatArray,
    at: float,
    *,
    upright: bool,
    name: str = "",
    outside: bool = False,
    part: float = 1.0,
) -> None:
    """Draw the dimension of the distance between two points along one axis.

    The dimension's line lies at ``at``, along y if ``upright``. A number without room stands
    ``outside``. ``part`` is the magnification of this part of the drawing.
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
    turned = 90 if upright else 0
    if outside:
        # Arrows point inwards from both sides; the number follows the second arrow.
        reach = 0.9
        for tip, tail in ((low, low - reach), (high, high + reach)):
            arrow = {"arrowstyle": "-|>"} | _END
            axes.annotate("", point(tip, at), point(tail, at), arrowprops=arrow)
        ha, va = ("center", "bottom") if upright else ("left", "center")
        axes.text(*point(high + reach, at), f" {text}", ha=ha, va=va, rotation=turned)
        return
    axes.annotate("", point(low, at), point(high, at), arrowprops=_ARROW)
    axes.text(
        *point((low + high) / 2, at),
        text,
        ha="center",
        va="center",
        rotation=turned,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
    )


def draw_angle(
    axes: Axes,
    corner: FloatArray,
    radius_mm: float,
    start_deg: float,
    end_deg: float,
    text: str,
    *,
    shift: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Draw an angle as an arc with its text."""
    angles = np.radians(np.linspace(start_deg, end_deg, 40))
    arc = corner + radius_mm * np.column_stack([np.cos(angles), np.sin(angles)])
    axes.plot(*arc.T, color=INK, linewidth=0.5)
    middle = np.radians((start_deg + end_deg) / 2)
    x, y = corner + (radius_mm + 0.9) * np.array([np.cos(middle), np.sin(middle)]) + shift
    axes.text(x, y, text, ha="center", va="center")


def draw_label(
    axes: Axes,
    point: FloatArray,
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


def draw_wall(axes: Axes, shape: Shape, shift_mm: float = 0.0) -> None:
    """Draw one substructure in section; the inside of the hexagon stays empty."""
    outer, inner = outline(shape)
    shift = np.array([shift_mm, 0.0, 0.0])
    draw_area(axes, outer + shift, CAPSULE_COLOUR)
    draw_area(axes, inner + shift, EMPTY)


def draw_substructure(axes: Axes, origami: Origami, choices: Choices) -> None:
    """Draw the dimensioned substructure with cut, wires and glue faces."""
    shape, corner = shape_of(origami), vertices(origami)
    draw_wall(axes, shape)
    faces, side = glue_faces(shape), shape.side
    right = max(float(faces["head"][0, 0]), float(corner["C"][0])) + 1.0
    left = float(min(shape.cap[0] - shape.cap_radius_mm, faces["tail"][0, 0])) - 1.0
    axes.plot([left - 2.6, right + 6.0], [0, 0], **AXIS)
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
    draw_length(axes, corner["A"] * [1.0, -1.0], corner["B"] * [1.0, -1.0], below, upright=False)
    _draw_angles(axes, origami, corner, side)
    middle = (shape.fold + shape.shoulder) / 2 * [1.0, -1.0]
    wall = f"wall {length_text(origami.wall_thickness_mm)}"
    draw_label(
        axes,
        middle,
        (middle[0] + side * 2.6, middle[1] - 1.5),
        wall,
        ha="left" if side > 0 else "right",
    )
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
    offsets = {
        "A": (-0.9 * side, 0.0),
        "B": (0.9 * side, 0.0),
        "C": (1.0 * side, 0.5),
        "D": (1.5, 0.1),
    }
    look: Look = {"ha": "center", "va": "center", "weight": "bold"}
    for name, point in corner.items():
        x, y = point + np.array(offsets[name])
        axes.text(x, y, name, **look)
        if name != "D":
            axes.text(x, -y, f"{name}\u2032", **look)


def _draw_heights(axes: Axes, corner: dict[str, FloatArray], right: float) -> None:
    on_axis = np.array([right, 0.0])
    levels = (
        ("h\u2081", on_axis, corner["A"], right + 1.2),
        ("h\u2082", corner["A"], corner["C"], right + 1.2),
        ("h\u2083", corner["C"], corner["D"], right + 1.2),
    )
    for name, low, high, at in levels:
        draw_length(axes, low, high, at, upright=True)
        axes.text(at + 0.7, (low[1] + high[1]) / 2, name, ha="left", va="center")


def _draw_angles(axes: Axes, origami: Origami, corner: dict[str, FloatArray], side: float) -> None:
    to_b = np.degrees(np.arctan2(*(corner["B"] - corner["C"])[::-1]))
    to_a = np.degrees(np.arctan2(*(corner["A"] - corner["C"])[::-1]))
    beta = f"\u03b2 = {length_text(origami.fold_angle_deg)}\u00b0"
    draw_angle(axes, corner["C"], 2.4, to_b, to_a, beta, shift=(0.6 * side, -0.8))
    # The dashed line across the axis is the reference for the awn's tilt.
    tilt = origami.awn_tilt_deg
    top = corner["D"][1] + 2.4
    axes.plot([corner["B"][0]] * 2, [corner["B"][1], top], **AXIS)
    lean = corner["B"][0] - (top - corner["B"][1]) * np.tan(np.radians(tilt))
    axes.plot([corner["D"][0], lean], [corner["D"][1], top], **AXIS)
    alpha = f"\u03b1 = {length_text(tilt)}\u00b0"
    axes.text(corner["B"][0] + 0.3, top, alpha, ha="left", va="top")


def draw_row(axes: Axes, origami: Origami, choices: Choices, sensors: int) -> None:
    """Draw the row of substructures with their sensors' numbers and wires."""
    shape, step = shape_of(origami), pitch(origami)
    faces = glue_faces(shape)
    half = top_mm(shape)
    for number in range(1, sensors + 1):
        shift = -step * (number - 1)
        draw_wall(axes, shape, shift)
        middle = shift + (shape.fold[0] + shape.lower[0]) / 2
        axes.text(middle, 0.0, str(number), ha="center", va="center", weight="bold", fontsize=9)
        for wire in wire_positions(shape, choices):
            x, y = wire[0] + shift, wire[1]
            out = np.copysign(half + 2.2, y)
            axes.plot([x, x], [y, out], color=BLUE, linewidth=0.5, zorder=4)
            axes.plot(x, y, "o", color=BLUE, markersize=2.4, zorder=5)
        if number < sensors:
            glued = faces["tail"][:, 0] + shift - origami.adhesive_mm / 2
            axes.plot(glued, faces["tail"][:, 1], **_GLUE)
    if choices.folding == "eyelets":
        ends = np.array([faces["head"][0, 0] + 2.5, faces["tail"][0, 0] - (sensors - 1) * step])
        for side in (-1.0, 1.0):
            axes.plot(ends, [side * EYELET_AT_MM] * 2, color=ORANGE, linewidth=0.7, zorder=6)
        axes.text(ends[0], 2.2, "cables\n(ours)", ha="center", va="bottom", color=ORANGE)
    axes.text(faces["head"][0, 0] + 0.8, 0.0, "head", ha="left", va="center", color=MUTED)
    tail = faces["tail"][0, 0] - (sensors - 1) * step
    axes.text(tail - 0.8, 0.0, "tail", ha="right", va="center", color=MUTED)
    first, last = faces["head"][0], np.array([tail, faces["tail"][0, 1]])
    draw_length(axes, first, last, -half - 4.2, upright=False)
    start = faces["head"][1]
    draw_length(axes, start, start - [step, 0.0], half + 3.8, upright=False, name="pitch")
    true_scale(axes, (tail - 5.0, first[0] + 5.0), (-half - 5.2, half + 5.2))


def draw_bench(axes: Axes, design: Design, turn_rad: float = np.pi / 2) -> None:
    """Draw the bench in section across the gut, with the cams turned by an angle.

    With the default angle, the walls are at their baselines.
    """
    bench, cam, wall = design.parts.bench, design.cam, design.phantom.wall
    moved = cam.eccentricity_mm * np.cos(turn_rad)
    opening = stand.window(bench, cam)
    outer, _ = stand.follower_outline(bench, cam, design.front_mm)
    low, high = stand.slide_levels(bench, cam)
    span = stand.slide_span(bench, cam, design.front_mm)
    shaft, silicone = bench.shaft_distance_mm / 2, wall.wall_mm + wall.sheet_mm
    tall = outer[:, 1].max() - 1.0
    for side in (-1.0, 1.0):
        # A follower's coordinate u increases towards the gut; a mirrored arc turns the other way.
        flip = np.array([-side, 1.0, -side])
        at, stroke = np.array([side * shaft, 0.0, 0.0]), np.array([moved, 0.0, 0.0])
        draw_area(axes, at + flip * (outer + stroke), FOLLOWER)
        ridge = rectangle(
            -opening.ridge_mm, -opening.height_mm, opening.ridge_mm, opening.height_mm
        )
        draw_area(axes, at + flip * (ridge + stroke), EMPTY)
        centre = (moved, cam.eccentricity_mm * np.sin(turn_rad))
        draw_area(axes, at + flip * circle(cam.radius_mm, centre), CAM)
        draw_area(axes, at + flip * circle(bench.rod_mm / 2), _STEEL)
        for levels in ((low, high), (-high, -low)):
            slide = rectangle(span[0], levels[0], span[1], levels[1])
            draw_area(axes, at + flip * slide, _SLIDE)
        inner = wall.lumen_mm / 2 - moved
        for depth, thick, colour in (
            (inner, wall.wall_mm, _WALL),
            (inner + wall.wall_mm, silicone - wall.wall_mm, _SHEET),
        ):
            sheet = rectangle(depth, -tall, depth + thick, tall)
            draw_area(axes, flip * [-1.0, 1.0, -1.0] * sheet, colour)
    half, top = bench.platform_width_mm / 2, bench.platform_top_mm
    draw_area(axes, rectangle(-half, top - bench.platform_mm, half, top), FOLLOWER)
    origami = design.phantom.origami
    wide = top_mm(design.shape)
    pressed = min(wide, wall.lumen_mm / 2 - moved)
    draw_area(axes, rectangle(-pressed, top, pressed, top + origami.height_mm), CAPSULE_COLOUR)
    _label_bench(axes, design, moved, (low, high), span)
    wide = shaft - span[0] + 44.0
    true_scale(axes, (-wide, wide), (-high - 8.0, high + 7.0))


def _label_bench(
    axes: Axes,
    design: Design,
    moved: float,
    levels: tuple[float, float],
    span: tuple[float, float],
) -> None:
    bench, cam, wall = design.parts.bench, design.cam, design.phantom.wall
    shaft, high = bench.shaft_distance_mm / 2, levels[1]
    left, right = np.array([-shaft, 0.0]), np.array([shaft, 0.0])
    draw_length(axes, left, right, -high - 4.5, upright=False)
    walls = [np.array([side * (wall.lumen_mm / 2 - moved), high]) for side in (-1.0, 1.0)]
    draw_length(axes, walls[0], walls[1], high + 3.5, upright=False)
    edge = shaft - span[0]
    inner, silicone = wall.lumen_mm / 2 - moved, wall.wall_mm + wall.sheet_mm
    off = length_text(cam.eccentricity_mm)
    names = (
        (1, (shaft + 6.0, 4.0), f"cam, radius {length_text(cam.radius_mm)}"),
        (1, (shaft, 0.0), f"rod, {off} off"),
        (1, (edge - 6.5, -14.0), f"follower {length_text(bench.follower_mm)}"),
        (1, (edge - 3.0, -(levels[0] + high) / 2), "slide"),
        (-1, (-inner - wall.wall_mm / 2, 11.0), f"wall {length_text(wall.wall_mm)}"),
        (-1, (-inner - silicone / 2, 6.0), f"sheet {length_text(wall.sheet_mm)}"),
        (-1, (-inner + 4.0, 0.0), "capsule"),
        (-1, (1.0 - bench.platform_width_mm / 2, bench.platform_top_mm - 4.0), "platform"),
    )
    for number, (side, point, text) in enumerate(names):
        where = (side * (edge + 3.0), 13.0 - 9.0 * (number % 4))
        draw_label(axes, np.array(point), where, text, ha="left" if side > 0 else "right")
