"""Draw the capsule with dimensions, for the report and for workshop drawings."""

import numpy as np
from matplotlib.axes import Axes

from capsule.arrays import FloatArray
from capsule.figures.dimension_lines import (
    draw_angle,
    draw_area,
    draw_label,
    draw_length,
    length_text,
    true_scale,
)
from capsule.figures.style import BLUE, GREEN, INK, MUTED, ORANGE
from capsule.geometry.open_choices import EYELET_AT_MM, Choices
from capsule.geometry.origami import Origami
from capsule.geometry.substructure import (
    Shape,
    glue_faces,
    named_corners,
    outline,
    shape_of,
    spacing,
    top_mm,
)
from capsule.geometry.wiring import cut_lines, wire_positions
from capsule.kinds import Look

WALL = "#c9d6e4"
_HOLE = "#ffffff"
_AXIS: Look = {"color": MUTED, "linewidth": 0.5, "linestyle": (0, (8, 2, 1.5, 2))}
_CUT: Look = {"color": ORANGE, "linewidth": 1.4, "linestyle": (0, (2, 1))}
_GLUE: Look = {"color": GREEN, "linewidth": 1.8, "solid_capstyle": "butt"}


def draw_wall(axes: Axes, shape: Shape, shift_mm: float = 0.0, colour: str = WALL) -> None:
    """Draw one substructure in section; the inside of the hexagon stays empty."""
    outer, inner = outline(shape)
    shift = np.array([shift_mm, 0.0])
    draw_area(axes, outer + shift, colour)
    draw_area(axes, inner + shift, _HOLE)


def draw_substructure(axes: Axes, origami: Origami, choices: Choices) -> None:
    """Draw the dimensioned substructure with cut, wires and glue faces."""
    shape, corner = shape_of(origami, choices), named_corners(origami, choices)
    draw_wall(axes, shape)
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
    axes.plot([corner["B"][0]] * 2, [corner["B"][1], top], **_AXIS)
    lean = corner["B"][0] - (top - corner["B"][1]) * np.tan(np.radians(tilt))
    axes.plot([corner["D"][0], lean], [corner["D"][1], top], **_AXIS)
    alpha = f"\u03b1 = {length_text(tilt)}\u00b0"
    axes.text(corner["B"][0] + 0.3, top, alpha, ha="left", va="top")


def draw_row(axes: Axes, origami: Origami, choices: Choices, sensors: int) -> None:
    """Draw the row of substructures with their sensors' numbers and wires."""
    shape = shape_of(origami, choices)
    pitch = spacing(shape, origami.adhesive_mm)
    faces = glue_faces(shape)
    half = top_mm(shape)
    for number in range(1, sensors + 1):
        shift = -pitch * (number - 1)
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
        ends = np.array([faces["head"][0, 0] + 2.5, faces["tail"][0, 0] - (sensors - 1) * pitch])
        for side in (-1.0, 1.0):
            axes.plot(ends, [side * EYELET_AT_MM] * 2, color=ORANGE, linewidth=0.7, zorder=6)
        axes.text(ends[0], 2.2, "cables\n(ours)", ha="center", va="bottom", color=ORANGE)
    axes.text(faces["head"][0, 0] + 0.8, 0.0, "head", ha="left", va="center", color=MUTED)
    tail = faces["tail"][0, 0] - (sensors - 1) * pitch
    axes.text(tail - 0.8, 0.0, "tail", ha="right", va="center", color=MUTED)
    first, last = faces["head"][0], np.array([tail, faces["tail"][0, 1]])
    draw_length(axes, first, last, -half - 4.2, upright=False)
    start = faces["head"][1]
    draw_length(axes, start, start - [pitch, 0.0], half + 3.8, upright=False, name="pitch")
    true_scale(axes, (tail - 5.0, first[0] + 5.0), (-half - 5.2, half + 5.2))


def draw_readings(axes: Axes, origami: Origami, readings: dict[str, Choices]) -> FloatArray:
    """Draw the outlines of several readings of the paper's text, with point C at the same place.

    Parameters
    ----------
    readings
        Choices by their description; the first is the chosen reading.

    Returns
    -------
    array of shape (2, 2)
        Lowest and highest corner of the drawing, in mm.
    """
    looks: tuple[Look, ...] = (
        {"color": INK, "linewidth": 1.6},
        {"color": ORANGE, "linestyle": (0, (5, 1.5))},
        {"color": BLUE, "linestyle": (0, (1.5, 1.2))},
        {"color": GREEN, "linestyle": (0, (6, 1.5, 1.2, 1.5))},
    )
    for (words, choices), look in zip(readings.items(), looks, strict=False):
        outer, inner = outline(shape_of(origami, choices))
        for index, boundary in enumerate((outer, inner)):
            closed = np.vstack([boundary, boundary[:1]])
            axes.plot(*closed.T, **look, label=words if index == 0 else None)
    corners = np.vstack([outline(shape_of(origami, each))[0] for each in readings.values()])
    box = np.array([corners.min(axis=0) - 0.6, corners.max(axis=0) + 0.6])
    true_scale(axes, tuple(box[:, 0]), tuple(box[:, 1]))
    return box
