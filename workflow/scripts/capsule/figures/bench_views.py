"""Draw the bench and its parts with dimensions, for the report and for workshop drawings."""

import numpy as np
from matplotlib.axes import Axes

from capsule.figures.dimension_lines import (
    draw_area,
    draw_label,
    draw_length,
    length_text,
    true_scale,
)
from capsule.figures.style import INK, MUTED
from capsule.geometry import stand
from capsule.geometry.cam import follower_displacement
from capsule.geometry.substructure import top_mm
from capsule.kinds import Look
from capsule.parts.design import Design

CAPSULE_COLOUR = "#c9d6e4"
_FOLLOWER, _CAM, _STEEL, _SLIDE = "#e9e4d8", "#cdd3da", "#8a8a8a", "#f4f1ea"
_WALL, _SHEET, _EMPTY = "#f3c6b8", "#f9e3da", "#ffffff"
_AXIS: Look = {"color": MUTED, "linewidth": 0.5, "linestyle": (0, (8, 2, 1.5, 2))}


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
        # A follower's coordinate u increases towards the gut.
        flip = np.array([-side, 1.0])
        at, stroke = np.array([side * shaft, 0.0]), np.array([moved, 0.0])
        draw_area(axes, at + flip * (outer + stroke), _FOLLOWER)
        ridge = stand.rectangle(
            -opening.ridge_mm, -opening.height_mm, opening.ridge_mm, opening.height_mm
        )
        draw_area(axes, at + flip * (ridge + stroke), _EMPTY)
        centre = (moved, cam.eccentricity_mm * np.sin(turn_rad))
        draw_area(axes, at + flip * stand.circle(cam.radius_mm, centre), _CAM)
        draw_area(axes, at + flip * stand.circle(bench.rod_mm / 2), _STEEL)
        for levels in ((low, high), (-high, -low)):
            slide = stand.rectangle(span[0], levels[0], span[1], levels[1])
            draw_area(axes, at + flip * slide, _SLIDE)
        inner = wall.lumen_mm / 2 - moved
        for depth, thick, colour in (
            (inner, wall.wall_mm, _WALL),
            (inner + wall.wall_mm, silicone - wall.wall_mm, _SHEET),
        ):
            sheet = stand.rectangle(depth, -tall, depth + thick, tall)
            draw_area(axes, flip * [-1.0, 1.0] * sheet, colour)
    half, top = bench.platform_width_mm / 2, bench.platform_top_mm
    draw_area(axes, stand.rectangle(-half, top - bench.platform_mm, half, top), _FOLLOWER)
    origami = design.phantom.origami
    wide = top_mm(design.shape)
    pressed = min(wide, wall.lumen_mm / 2 - moved)
    draw_area(
        axes, stand.rectangle(-pressed, top, pressed, top + origami.height_mm), CAPSULE_COLOUR
    )
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


def draw_follower(axes: Axes, design: Design) -> None:
    """Draw a follower from the front and from the side, with the ridge of its window."""
    bench, cam = design.parts.bench, design.cam
    opening = stand.window(bench, cam)
    outer, inner = stand.follower_outline(bench, cam, design.front_mm)
    draw_area(axes, outer, _FOLLOWER)
    draw_area(axes, inner, _EMPTY)
    for u in (-opening.ridge_mm, opening.ridge_mm):
        axes.plot([u, u], [-opening.height_mm, opening.height_mm], color=INK, linewidth=0.4)
    low, high = outer.min(axis=0), outer.max(axis=0)
    centre = np.zeros(2)
    draw_area(axes, stand.circle(cam.radius_mm), _EMPTY, facecolor="none", linestyle=(0, (4, 2)))
    axes.plot([low[0] - 2, high[0] + 2], [0, 0], **_AXIS)
    axes.plot([0, 0], [low[1] - 2, high[1] + 2], **_AXIS)
    ridge = np.array([opening.ridge_mm, 0.0])
    draw_length(axes, -ridge, ridge, low[1] - 3.5, upright=False, name="ridge")
    draw_length(axes, inner.min(axis=0), inner.max(axis=0), low[1] - 7.0, upright=False)
    draw_length(axes, low, high, low[1] - 10.5, upright=False)
    draw_length(axes, centre, high * [1.0, 0.0], high[1] + 3.5, upright=False, name="front")
    draw_length(axes, inner.min(axis=0), inner.max(axis=0), low[0] - 3.5, upright=True)
    draw_length(axes, low, high, low[0] - 7.0, upright=True)
    _draw_follower_section(axes, design, float(high[0]) + 16.0)
    true_scale(axes, (low[0] - 9.0, high[0] + 28.0), (low[1] - 12.5, high[1] + 6.0))


def _draw_follower_section(axes: Axes, design: Design, left: float) -> None:
    """Draw the frame in section along the shaft, with the ridge in the middle of its thickness."""
    bench, cam = design.parts.bench, design.cam
    opening = stand.window(bench, cam)
    thick = bench.follower_mm - bench.follower_gap_mm
    # Draw it five times as large, because the ridge is too small to see otherwise.
    large = 5.0
    bevel = opening.face_mm - opening.ridge_mm
    frame = bench.frame_mm
    half = thick / 2 * large
    profile = np.array(
        [[-half, 0.0], [half, 0.0], [half, frame], [0.0, frame + bevel], [-half, frame]]
    )
    profile[:, 1] = (profile[:, 1] - frame) * large
    profile[:2, 1] = -frame * 2
    profile[:, 0] += left
    draw_area(axes, profile, _FOLLOWER)
    axes.text(left, -frame * 2 - 8.0, "window\u2019s edge, 5 times", ha="center", va="center")
    draw_length(axes, profile[0], profile[1], -frame * 2 - 4.0, upright=False, part=large)
    peak = profile[3]
    text = f"ridge, bevel {length_text(bench.bevel_deg)}\u00b0"
    draw_label(axes, peak, (left, peak[1] + 5.0), text, ha="center")


def draw_cam(axes: Axes, design: Design) -> None:
    """Draw the cam shaft in section, seen from its end, and one lead of it from the side."""
    bench, cam = design.parts.bench, design.cam
    centre = (cam.eccentricity_mm, 0.0)
    draw_area(axes, stand.circle(cam.radius_mm, centre), _CAM)
    draw_area(axes, stand.bore(bench), _EMPTY)
    reach = cam.radius_mm + cam.eccentricity_mm
    axes.plot([-reach, reach + 2], [0, 0], **_AXIS)
    axes.plot([0, 0], [-reach, reach], **_AXIS)
    draw_length(axes, np.zeros(2), np.array(centre), reach + 2.5, upright=False, outside=True)
    right = np.array([centre[0] + cam.radius_mm, 0.0])
    draw_length(axes, np.array(centre), right, -reach - 2.5, upright=False, name="R")
    draw_label(
        axes,
        np.array([bench.rod_mm / 2 - bench.rod_flat_mm, 1.0]),
        (-reach + 1.0, reach + 4.0),
        f"bore {length_text(bench.rod_mm + 2 * bench.fit_mm)}, flat keys the phase",
        ha="center",
    )
    start = reach + 12.0
    along = np.linspace(0.0, cam.lead_mm, 241)
    middle = follower_displacement(cam, along, np.zeros(1))
    flank = np.vstack(
        [
            np.column_stack([start + along, middle + cam.radius_mm]),
            np.column_stack([start + along, middle - cam.radius_mm])[::-1],
        ]
    )
    draw_area(axes, flank, _CAM)
    axes.plot([start - 3, start + cam.lead_mm + 3], [0, 0], **_AXIS)
    axes.plot(start + along, middle, color=INK, linewidth=0.5, linestyle=(0, (4, 2)))
    end = np.array([start + cam.lead_mm, -cam.radius_mm])
    draw_length(axes, np.array([start, -cam.radius_mm]), end, -reach - 2.5, upright=False)
    true_scale(axes, (-reach - 18.0, end[0] + 5.0), (-reach - 5.0, reach + 7.0))


def draw_end_plate(axes: Axes, design: Design) -> None:
    """Draw an end plate with its openings, seen along the gut."""
    bench, cam = design.parts.bench, design.cam
    outline, holes = stand.end_plate(bench, cam, design.front_mm)
    draw_area(axes, outline, _FOLLOWER)
    for hole in holes:
        draw_area(axes, hole, _EMPTY)
    low, high = outline.min(axis=0), outline.max(axis=0)
    shaft, motor = bench.shaft_distance_mm / 2, stand.motor_height(bench)
    axes.plot([low[0] - 2, high[0] + 2], [0, 0], **_AXIS)
    for side in (-shaft, shaft):
        axes.plot([side, side], [low[1] - 2, high[1] + 2], **_AXIS)
    left, right = np.array([-shaft, 0.0]), np.array([shaft, 0.0])
    draw_length(axes, left, right, low[1] - 4.0, upright=False)
    draw_length(axes, low, high, low[1] - 8.0, upright=False)
    draw_length(axes, low, high, low[0] - 10.0, upright=True)
    draw_length(axes, right, np.array([shaft, motor]), high[0] + 5.0, upright=True, name="motor")
    bearing = length_text(bench.bearing_mm + 2 * bench.fit_mm)
    where = np.array([-shaft, bench.bearing_mm / 2])
    draw_label(axes, where, (-shaft, 40.0), f"bearing {bearing}", ha="center")
    draw_label(axes, np.array([0.0, bench.platform_top_mm]), (0.0, 30.0), "platform", ha="center")
    levels = stand.slide_levels(bench, cam)
    tab = holes[1].mean(axis=0)
    draw_label(axes, np.array([tab[0], levels[1]]), (tab[0], 50.0), "slides", ha="center")
    true_scale(axes, (low[0] - 14.0, high[0] + 10.0), (low[1] - 11.0, high[1] + 5.0))
