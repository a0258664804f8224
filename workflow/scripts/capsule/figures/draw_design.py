"""Draw the figures of the capsule's design, and of other designs that the paper's text allows.

A *reading* here is one interpretation of the paper's text, not a sensor's value.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule.figures.inputs import FigureInputs
from capsule.figures.style import (
    COLUMN_WIDTH_IN,
    INK,
    ORANGE,
    PAGE_WIDTH_IN,
    Drawing,
    figure_style,
)
from capsule.kinds import Look
from capsule.parts.design import Design
from capsule.parts.drawings import draw_bench, draw_row, draw_substructure, true_scale
from capsule.parts.files import shipped_design
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


def outline_table(readings: dict[str, Origami]) -> pd.DataFrame:
    """Return a figure's outlines, one row per corner, with the pitch of each reading."""
    rows = []
    for words, origami in readings.items():
        boundaries = zip(("outer", "inner"), outline(shape_of(origami)), strict=True)
        for boundary, each in boundaries:
            rows += [(words, pitch(origami), boundary, x, y) for x, y in points(each).round(4)]
    return pd.DataFrame(rows, columns=["reading", "pitch_mm", "boundary", "x_mm", "y_mm"])


def capsule_drawing(inputs: FigureInputs) -> Drawing:
    """Return the drawing of the substructure, the row of sensors, and the bench in section."""
    design = shipped_design()
    table = outline_table({"chosen": design.phantom.origami})
    sensors = inputs.settings["recording"]["sensors"]
    return table, lambda width_in: draw_capsule(design, sensors, width_in)


def readings_drawing(_: FigureInputs) -> Drawing:
    """Return the drawing that compares the readings of the paper's text."""
    readings = other_readings(shipped_design().phantom.origami)
    return outline_table(readings), lambda width_in: draw_other_readings(readings, width_in)


def draw_capsule(design: Design, sensors: int, width_in: float = PAGE_WIDTH_IN) -> Figure:
    """Draw the capsule and the bench with their dimensions, in mm."""
    origami, choices = design.phantom.origami, design.parts.choice
    panels: tuple[tuple[str, Callable[[Axes], None]], ...] = (
        ("one substructure", lambda axes: draw_substructure(axes, origami, choices)),
        (
            "sensors, wires (blue), glue (green)",
            lambda axes: draw_row(axes, origami, choices, sensors),
        ),
        ("the bench in section across the gut", lambda axes: draw_bench(axes, design)),
    )
    rows = ([0], [1], [2]) if width_in <= COLUMN_WIDTH_IN else ([0, 1], [2])
    with figure_style():
        figure = Figure()
        drawn = []
        for title, draw in panels:
            axes = figure.add_axes((0, 0, 1, 1), label=title)
            draw(axes)
            axes.set_title(f"{title}, in mm", loc="center")
            drawn.append(axes)
        _stack(figure, [[drawn[number] for number in row] for row in rows], width_in)
    return figure


def _stack(
    figure: Figure,
    rows: Sequence[Sequence[Axes]],
    width_in: float,
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
    scales = [width_in / sum(wide for wide, _ in row) for row in spans]
    heights = [
        max(tall for _, tall in row) * scale for row, scale in zip(spans, scales, strict=True)
    ]
    total = sum(heights) + title_in * len(rows) + below_in
    figure.set_size_inches(width_in, total)
    top = total
    for row, sizes, scale, height in zip(rows, spans, scales, heights, strict=True):
        # All drawings of a row get the same height, so that their titles align.
        half = height / scale / 2
        top -= title_in + height
        left = 0.0
        for axes, (wide, _) in zip(row, sizes, strict=True):
            axes.set_position((left, top / total, wide * scale / width_in, height / total))
            middle = np.mean(axes.get_ylim())
            axes.set_ylim(middle - half, middle + half)
            left += wide * scale / width_in


def draw_other_readings(readings: dict[str, Origami], width_in: float = PAGE_WIDTH_IN) -> Figure:
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
        half = len(panels) // 2
        narrow = width_in <= COLUMN_WIDTH_IN
        rows = [panels[:half], panels[half:]] if narrow else [panels]
        _stack(figure, rows, width_in, title_in=0.42, below_in=0.3)
        # Each outline has an outer and an inner boundary.
        figure.legend(handles=panels[0].lines[::2], loc="lower center", ncols=2)
    return figure
