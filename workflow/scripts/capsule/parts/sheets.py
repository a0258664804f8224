"""Draw the parts on A4 sheets with dimensions; each sheet states its scale."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule.figures.style import INK, MUTED, figure_style
from capsule.parts import drawings
from capsule.parts.design import Design

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
    draw: Callable[[Axes, Design], None]


def sheets(design: Design) -> list[Sheet]:
    """Return all drawings."""
    unit = "Substructure: cut (orange), wires (blue), glue faces (green)"
    row = f"Assembly of {design.sensors}: sensor numbers, wires (blue), adhesive (green)"
    return [
        Sheet("substructure", unit, 7.0, True, drawings.draw_substructure),
        Sheet("assembly", row, 5.0, False, drawings.draw_row),
        Sheet("bench", "Bench in section across the gut", 1.5, False, drawings.draw_bench),
        Sheet("follower", "Follower", 2.5, True, drawings.draw_follower),
        Sheet("cam", "Cam shaft, one section", 1.5, False, drawings.draw_cam),
        Sheet("end-plate", "End plate", 1.0, True, drawings.draw_end_plate),
    ]


def sheet_figure(sheet: Sheet, design: Design) -> Figure:
    """Return a drawing on A4 at its scale, with the design's choices."""
    origami, choices = design.phantom.origami, design.parts.choice
    chosen = (
        f"A at the {origami.fold_side} of BC; corners on the wall's {origami.corners}; "
        f"tip: {origami.tip}; current: {choices.current}; cut: {choices.cut}; "
        f"folding: {choices.folding}"
    )
    width, height = (210.0, 297.0) if sheet.upright else (297.0, 210.0)
    figure = Figure(figsize=(width / _MM_IN, height / _MM_IN))
    left, low = _MARGIN_MM, _MARGIN_MM + _BLOCK_MM
    wide, high = width - 2 * _MARGIN_MM, height - low - _MARGIN_MM
    axes = figure.add_axes((left / width, low / height, wide / width, high / height))
    sheet.draw(axes, design)
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
    block.text(3, 5, chosen, fontsize=7, color=MUTED, va="center")
    scale = f"{sheet.scale:g} : 1, in mm"
    block.text(wide - 3, 12.5, scale, fontsize=10, ha="right", va="center")
    return figure


def sheet_files(sheet: Sheet, design: Design) -> dict[str, bytes]:
    """Return a drawing as SVG and as PDF; the same drawing always gives the same bytes."""
    dates = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    # Type 3 draws the glyphs. To embed them as a font would take a third of the time of all parts.
    settings: Any = {"svg.fonttype": "none", "pdf.fonttype": 3, "svg.hashsalt": sheet.name}
    made = {}
    with figure_style(), matplotlib.rc_context(settings):
        figure = sheet_figure(sheet, design)
        for kind, date in dates.items():
            stream = io.BytesIO()
            figure.savefig(stream, format=kind, metadata={**date, "Title": sheet.title})
            made[kind] = stream.getvalue()
    return made
