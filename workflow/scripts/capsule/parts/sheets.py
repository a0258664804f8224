"""Draw the parts on A4 sheets with dimensions; each sheet states its scale."""

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule.figures.style import INK, MUTED, figure_style
from capsule.parts import stand
from capsule.parts.cam import follower_displacement
from capsule.parts.design import Design
from capsule.parts.drawings import (
    AXIS,
    CAM,
    EMPTY,
    FOLLOWER,
    draw_area,
    draw_bench,
    draw_label,
    draw_length,
    draw_row,
    draw_substructure,
    length_text,
    true_scale,
)
from capsule.parts.outlines import circle, polygon

_MM_IN = 25.4
_MARGIN_MM = 10.0
_BLOCK_MM = 24.0


@dataclass(frozen=True)
class Sheet:
    """A drawing: its name, title and scale, the sheet's orientation, and the drawing function."""

    name: str
    title: str
    scale: float
    upright: bool
    draw: Callable[[Axes], None]


def sheets(design: Design, sensors: int) -> list[Sheet]:
    """Return all drawings."""
    origami, choices = design.phantom.origami, design.parts.choice
    return [
        Sheet(
            "substructure",
            "Substructure: cut (orange), wires (blue), glue faces (green)",
            7.0,
            True,
            lambda axes: draw_substructure(axes, origami, choices),
        ),
        Sheet(
            "assembly",
            f"Assembly of {sensors}: sensor numbers, wires (blue), adhesive (green)",
            5.0,
            False,
            lambda axes: draw_row(axes, origami, choices, sensors),
        ),
        Sheet(
            "bench", "Bench in section across the gut", 1.5, False, lambda a: draw_bench(a, design)
        ),
        Sheet("follower", "Follower", 2.5, True, lambda a: draw_follower(a, design)),
        Sheet("cam", "Cam shaft, one section", 1.5, False, lambda a: draw_cam(a, design)),
        Sheet("end-plate", "End plate", 1.0, True, lambda axes: draw_end_plate(axes, design)),
    ]


def sheet_figure(sheet: Sheet, lines: Sequence[str]) -> Figure:
    """Return a drawing on A4 at its scale."""
    width, height = (210.0, 297.0) if sheet.upright else (297.0, 210.0)
    figure = Figure(figsize=(width / _MM_IN, height / _MM_IN))
    left, low = _MARGIN_MM, _MARGIN_MM + _BLOCK_MM
    wide, high = width - 2 * _MARGIN_MM, height - low - _MARGIN_MM
    axes = figure.add_axes((left / width, low / height, wide / width, high / height))
    sheet.draw(axes)
    # The drawing is centred on the sheet.
    middle = np.mean([axes.get_xlim(), axes.get_ylim()], axis=1)
    half = (wide / sheet.scale / 2, high / sheet.scale / 2)
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
    block = figure.add_axes((left / width, _MARGIN_MM / height, wide / width, 18.0 / height))
    block.set(xticks=[], yticks=[], xlim=(0, wide), ylim=(0, 18))
    for spine in block.spines.values():
        spine.set_visible(True)
        spine.set_color(INK)
    block.text(3, 12.5, sheet.title, fontsize=10, weight="bold", va="center")
    block.text(3, 5, "; ".join(lines), fontsize=7, color=MUTED, va="center")
    scale = f"{sheet.scale:g} : 1, in mm"
    block.text(wide - 3, 12.5, scale, fontsize=10, ha="right", va="center")
    return figure


def sheet_files(sheet: Sheet, lines: Sequence[str]) -> dict[str, bytes]:
    """Return a drawing as SVG and as PDF; the same drawing always gives the same bytes."""
    dates = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    # Type 3 draws the glyphs. To embed them as a font would take a third of the time of all parts.
    settings: Any = {"svg.fonttype": "none", "pdf.fonttype": 3, "svg.hashsalt": sheet.name}
    made = {}
    with figure_style(), matplotlib.rc_context(settings):
        figure = sheet_figure(sheet, lines)
        for kind, date in dates.items():
            stream = io.BytesIO()
            figure.savefig(stream, format=kind, metadata={**date, "Title": sheet.title})
            made[kind] = stream.getvalue()
    return made


def draw_follower(axes: Axes, design: Design) -> None:
    """Draw a follower from the front and from the side, with the ridge of its window."""
    bench, cam = design.parts.bench, design.cam
    opening = stand.window(bench, cam)
    outer, inner = stand.follower_outline(bench, cam, design.front_mm)
    draw_area(axes, outer, FOLLOWER)
    draw_area(axes, inner, EMPTY)
    for u in (-opening.ridge_mm, opening.ridge_mm):
        axes.plot([u, u], [-opening.height_mm, opening.height_mm], color=INK, linewidth=0.4)
    outer, inner = outer[:, :2], inner[:, :2]
    low, high = outer.min(axis=0), outer.max(axis=0)
    centre = np.zeros(2)
    draw_area(axes, circle(cam.radius_mm), EMPTY, facecolor="none", linestyle=(0, (4, 2)))
    axes.plot([low[0] - 2, high[0] + 2], [0, 0], **AXIS)
    axes.plot([0, 0], [low[1] - 2, high[1] + 2], **AXIS)
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
    draw_area(axes, polygon(profile), FOLLOWER)
    axes.text(left, -frame * 2 - 8.0, "window\u2019s edge, 5 times", ha="center", va="center")
    draw_length(axes, profile[0], profile[1], -frame * 2 - 4.0, upright=False, part=large)
    peak = profile[3]
    text = f"ridge, bevel {length_text(bench.bevel_deg)}\u00b0"
    draw_label(axes, peak, (left, peak[1] + 5.0), text, ha="center")


def draw_cam(axes: Axes, design: Design) -> None:
    """Draw the cam shaft in section, seen from its end, and one lead of it from the side."""
    bench, cam = design.parts.bench, design.cam
    centre = (cam.eccentricity_mm, 0.0)
    draw_area(axes, circle(cam.radius_mm, centre), CAM)
    draw_area(axes, stand.bore(bench), EMPTY)
    reach = cam.radius_mm + cam.eccentricity_mm
    axes.plot([-reach, reach + 2], [0, 0], **AXIS)
    axes.plot([0, 0], [-reach, reach], **AXIS)
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
    draw_area(axes, polygon(flank), CAM)
    axes.plot([start - 3, start + cam.lead_mm + 3], [0, 0], **AXIS)
    axes.plot(start + along, middle, color=INK, linewidth=0.5, linestyle=(0, (4, 2)))
    end = np.array([start + cam.lead_mm, -cam.radius_mm])
    draw_length(axes, np.array([start, -cam.radius_mm]), end, -reach - 2.5, upright=False)
    true_scale(axes, (-reach - 18.0, end[0] + 5.0), (-reach - 5.0, reach + 7.0))


def draw_end_plate(axes: Axes, design: Design) -> None:
    """Draw an end plate with its openings, seen along the gut."""
    bench, cam = design.parts.bench, design.cam
    outline, holes = stand.end_plate(bench, cam, design.front_mm)
    draw_area(axes, outline, FOLLOWER)
    for hole in holes:
        draw_area(axes, hole, EMPTY)
    low, high = outline[:, :2].min(axis=0), outline[:, :2].max(axis=0)
    shaft, motor = bench.shaft_distance_mm / 2, stand.motor_height(bench)
    axes.plot([low[0] - 2, high[0] + 2], [0, 0], **AXIS)
    for side in (-shaft, shaft):
        axes.plot([side, side], [low[1] - 2, high[1] + 2], **AXIS)
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
