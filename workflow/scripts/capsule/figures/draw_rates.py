"""Figures of rates per size: ours under each scheme, and the paper's, with intervals."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from capsule.evaluation import points
from capsule.figures.inputs import Drawing, FigureInputs
from capsule.figures.style import (
    BLUE,
    COLUMN_WIDTH_IN,
    INK,
    MUTED,
    ORANGE,
    PAGE_WIDTH_IN,
    figure_style,
    say_nothing_to_show,
)

_TRUE_SIZE = "size of the nodule (mm)"
# The result stands out; the shapes differ for those who see no colour.
_MARKS = {
    "leave_one_out": {
        "label": "leave-one-out (the result)",
        "marker": "o",
        "color": BLUE,
        "markersize": 5.5,
    },
    "resubstitution": {
        "label": "resubstitution",
        "marker": "s",
        "color": MUTED,
        "markersize": 4,
        "markerfacecolor": "white",
    },
    "paper": {
        "label": "paper, as printed",
        "marker": "D",
        "color": ORANGE,
        "markersize": 4,
        "markerfacecolor": "white",
    },
}


def detection_drawing(inputs: FigureInputs) -> Drawing:
    """Give precision and recall per size, of the first detector, beside the paper's."""
    sizes_mm = inputs.evaluation.sizes_mm()[1:]
    table = points.detection_points(_of_first(inputs, "detection"))
    panels = {"precision": "precision", "recall": "recall"}
    return table, lambda width_in: draw_rates(table, panels, sizes_mm, _TRUE_SIZE, width_in)


def sizing_drawing(inputs: FigureInputs) -> Drawing:
    """Give the rates of exact and of tolerable sizes, of the first detector, beside the paper's."""
    sizes_mm = inputs.evaluation.sizes_mm()[1:]
    table = points.sizing_points(_of_first(inputs, "sizing"))
    within = f"within {inputs.settings['evaluation']['tolerance_mm']:g} mm (*: one-sided)"
    panels = {"exact_rate": "exact size", "within_rate": within}
    return table, lambda width_in: draw_rates(table, panels, sizes_mm, _TRUE_SIZE, width_in)


def negatives_drawing(inputs: FigureInputs) -> Drawing:
    """Give what the first detector takes healthy recordings for, beside the paper's."""
    sizes_mm = inputs.evaluation.sizes_mm()
    confidence = inputs.settings["evaluation"]["confidence"]
    table = points.negative_points(_of_first(inputs, "confusion"), confidence)
    panels = {"classified": "recordings without a nodule, by verdict"}
    label = "predicted size (mm)"
    return table, lambda width_in: draw_rates(table, panels, sizes_mm, label, width_in)


def _of_first(inputs: FigureInputs, name: str) -> pd.DataFrame:
    """Give the first detector's rows of a table, and the paper's."""
    evaluation = inputs.evaluation
    return evaluation.of(name, evaluation.detectors()[0], with_paper=True)


def draw_rates(
    table: pd.DataFrame,
    panels: Mapping[str, str],
    sizes_mm: Sequence[float],
    x_label: str,
    width_in: float = PAGE_WIDTH_IN,
) -> Figure:
    """Draw rates per size with their intervals, a panel a measure.

    Parameters
    ----------
    table : DataFrame
        From `capsule.evaluation.points`; rates are fractions, NaN where nothing was counted.
    panels : mapping of str to str
        The measures to draw, and the title of each one's panel.
    sizes_mm : sequence of float
        The sizes along the axis; 0 is written as no nodule.
    x_label : str
        What the sizes are.
    width_in : float
        Width of the figure in inches.

    Returns
    -------
    Figure
    """
    narrow = width_in <= COLUMN_WIDTH_IN
    stacked = narrow and len(panels) > 1
    with figure_style():
        height = 1.75 * len(panels) + 0.85 if stacked else 2.6
        figure = Figure(figsize=(width_in, height), layout="constrained")
        shape = (len(panels), 1) if stacked else (1, len(panels))
        grid = figure.subplots(*shape, squeeze=False, sharey=True)
        for axes, (measure, title) in zip(grid.flat, panels.items(), strict=True):
            axes.set_title(title)
            _draw_panel(axes, table[table["measure"] == measure], sizes_mm)
        for axes in grid[-1]:
            axes.set_xlabel(x_label)
        handles, labels = _legend_of(grid)
        if handles:
            columns = 1 if narrow else len(handles)
            figure.legend(handles, labels, loc="outside lower center", ncols=columns)
    return figure


def _draw_panel(axes: Axes, table: pd.DataFrame, sizes_mm: Sequence[float]) -> None:
    table = table[table["size_mm"].isin(sizes_mm)]
    known = table[table["rate"].notna()]
    if known.empty:
        say_nothing_to_show(axes, "no recording to count")
        return
    schemes = [scheme for scheme in _MARKS if (table["scheme"] == scheme).any()]
    tick_of = {size_mm: position for position, size_mm in enumerate(sizes_mm)}
    for order, scheme in enumerate(schemes):
        rows = known[known["scheme"] == scheme]
        shift = 0.2 * (order - (len(schemes) - 1) / 2)
        position = np.array([tick_of[size_mm] + shift for size_mm in rows["size_mm"]])
        value = rows["rate"].to_numpy()
        reach = np.maximum([value - rows["low"], rows["high"] - value], 0.0)
        axes.errorbar(
            position,
            value,
            yerr=reach,
            linestyle="none",
            elinewidth=0.9,
            capsize=1.8,
            **_MARKS[scheme],
        )
    one_sided = set(table.loc[table["one_sided"], "size_mm"])
    axes.set_xticks(range(len(sizes_mm)))
    axes.set_xticklabels([_tick(size_mm, size_mm in one_sided) for size_mm in sizes_mm])
    axes.set(xlim=(-0.6, len(sizes_mm) - 0.4), ylim=(-0.03, 1.05))
    axes.set_yticks(np.linspace(0, 1, 6))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.grid(axis="y", color="#d9d9d9", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.axhline(0, color=INK, linewidth=0.6)


def _tick(size_mm: float, one_sided: bool) -> str:
    return "none" if size_mm == 0 else f"{size_mm:g}" + ("*" if one_sided else "")


def _legend_of(grid: np.ndarray) -> tuple[list, list]:
    handles: dict[str, object] = {}
    for axes in grid.flat:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    return list(handles.values()), list(handles)
