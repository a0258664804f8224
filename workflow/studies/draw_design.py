"""Draw the capsule's design, and other designs that the paper's text allows, for the report.

No recording changes these figures: workflow/report/figures holds them as this script draws them
from config/phantom.yaml and config/parts.yaml. A *reading* here is one interpretation of the
paper's text, not a sensor's value.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "workflow" / "scripts"))

from capsule.figures.style import INK, ORANGE, PAGE_WIDTH_IN, figure_style, render_figure
from capsule.kinds import Look
from capsule.parts.design import Design
from capsule.parts.drawings import draw_bench, draw_row, draw_substructure, true_scale
from capsule.parts.files import read_design
from capsule.parts.outlines import points
from capsule.parts.substructure import outline, shape_of
from capsule.phantom.origami import Origami, pitch

# The chosen reading, and the one beside it.
_LOOKS: tuple[Look, ...] = (
    {"color": INK, "linewidth": 1.6, "label": "chosen"},
    {"color": ORANGE, "linestyle": (0, (5, 1.5)), "label": "instead"},
)

# Other choices that the paper's text allows, one change at a time.
_OTHERS = (
    ("fold_side", {"head": "tail", "tail": "head"}, "A at the {} of BC"),
    ("corners", {"middle": "outside", "outside": "middle"}, "corners on the wall\u2019s {}"),
    ("tip", {"bulb": "curl", "round": "curl", "curl": "bulb"}, "tip: {}"),
    ("tip", {"bulb": "round", "round": "bulb", "curl": "round"}, "tip: {}"),
)


def other_readings(origami: Origami) -> dict[str, Origami]:
    """Return the chosen origami, then each that differs from it in one choice."""
    readings = {"chosen": origami}
    for key, instead, words in _OTHERS:
        other = instead[getattr(origami, key)]
        changes: dict[str, Any] = {key: other}
        readings[words.format(other)] = replace(origami, **changes)
    return readings


def draw_capsule(design: Design) -> Figure:
    """Draw the capsule and the bench with their dimensions, in mm."""
    panels = {
        "one substructure": draw_substructure,
        "sensors, wires (blue), glue (green)": draw_row,
        "the bench in section across the gut": draw_bench,
    }
    with figure_style():
        figure = Figure()
        drawn = []
        for title, draw in panels.items():
            axes = figure.add_axes((0, 0, 1, 1), label=title)
            draw(axes, design)
            axes.set_title(f"{title}, in mm", loc="center")
            drawn.append(axes)
        _stack(figure, [drawn[:2], drawn[2:]])
    return figure


def _stack(
    figure: Figure,
    rows: Sequence[Sequence[Axes]],
    title_in: float = 0.28,
    below_in: float = 0.0,
) -> None:
    """Arrange drawings in rows across the figure; the drawings of a row have one scale.

    The limits of the axes give the size of each drawing, so there are no empty margins.

    Parameters
    ----------
    title_in, below_in
        Room in inches for the titles of a row, and below all rows.
    """
    spans = [[(np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())) for axes in row] for row in rows]
    scales = [PAGE_WIDTH_IN / sum(wide for wide, _ in row) for row in spans]
    heights = [
        max(tall for _, tall in row) * scale for row, scale in zip(spans, scales, strict=True)
    ]
    total = sum(heights) + title_in * len(rows) + below_in
    figure.set_size_inches(PAGE_WIDTH_IN, total)
    top = total
    for row, sizes, scale, height in zip(rows, spans, scales, heights, strict=True):
        # All drawings of a row get the same height, so that their titles align.
        half = height / scale / 2
        top -= title_in + height
        left = 0.0
        for axes, (wide, _) in zip(row, sizes, strict=True):
            axes.set_position((left, top / total, wide * scale / PAGE_WIDTH_IN, height / total))
            middle = np.mean(axes.get_ylim())
            axes.set_ylim(middle - half, middle + half)
            left += wide * scale / PAGE_WIDTH_IN


def draw_other_readings(readings: Mapping[str, Origami]) -> Figure:
    """Draw each other reading over the chosen reading, which is the first; C at the same place."""
    outlines = {
        words: [points(boundary) for boundary in outline(shape_of(each))]
        for words, each in readings.items()
    }
    chosen, *others = readings
    with figure_style():
        figure = Figure()
        panels, boxes = [], []
        for words in others:
            axes = figure.add_axes((0, 0, 1, 1), label=words)
            for reading, look in zip((chosen, words), _LOOKS, strict=True):
                for boundary in outlines[reading]:
                    axes.plot(*np.vstack([boundary, boundary[:1]]).T, **look)
            corners = np.vstack([outlines[reading][0] for reading in (chosen, words)])
            box = np.array([corners.min(axis=0) - 0.6, corners.max(axis=0) + 0.6])
            true_scale(axes, tuple(box[:, 0]), tuple(box[:, 1]))
            axes.set_title(f"{words}\npitch {pitch(readings[words]):.2f} mm", loc="center")
            panels.append(axes)
            boxes.append(box)
        left, right = min(box[0, 0] for box in boxes), max(box[1, 0] for box in boxes)
        for axes in panels:
            # Leave room for the title.
            axes.set_xlim(left - 1.5, right + 1.5)
        _stack(figure, [panels], title_in=0.42, below_in=0.3)
        # Each outline has an outer and an inner boundary.
        figure.legend(handles=panels[0].lines[::2], loc="lower center", ncols=2)
    return figure


def figures() -> dict[str, bytes]:
    """Return the figures as SVG, by name."""
    design = read_design()
    drawn = {
        "capsule": draw_capsule(design),
        "readings": draw_other_readings(other_readings(design.phantom.origami)),
    }
    return {name: render_figure(figure, "svg", name) for name, figure in drawn.items()}


def main() -> None:
    """Write the figures."""
    for name, content in figures().items():
        (ROOT / "workflow" / "report" / "figures" / f"{name}.svg").write_bytes(content)


if __name__ == "__main__":
    main()
