"""Draw the learning curves: rates against the number of recordings that teach."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from capsule.evaluation.learning import main_ranges
from capsule.figures.inputs import Drawing, FigureInputs
from capsule.figures.style import (
    COLUMN_WIDTH_IN,
    PAGE_WIDTH_IN,
    detector_looks,
    figure_style,
    say_nothing_to_show,
)
from capsule.kinds import Look


def learning_drawing(inputs: FigureInputs) -> Drawing:
    """Return the drawing of the rates at each share of the archive, per learning detector."""
    table, detectors = inputs.learning, inputs.evaluation.detectors()
    return table, lambda width_in: draw_learning(table, detectors, width_in)


def draw_learning(
    table: pd.DataFrame, detectors: Sequence[str], width_in: float = PAGE_WIDTH_IN
) -> Figure:
    """Draw specificity and sensitivity against the recordings that teach, one panel per rate.

    Parameters
    ----------
    table : DataFrame
        From `capsule.evaluation.learning`.
    detectors : sequence of str
        In the order of the configuration; a detector without a row has no curve.
    width_in : float
        Width of the figure in inches.

    Returns
    -------
    Figure
    """
    # Without recordings, one empty panel remains, with a note.
    ranges = main_ranges(table["size_from_mm"]) or [(0.0, 0.0)]
    narrow = width_in <= COLUMN_WIDTH_IN
    shape = (len(ranges), 1) if narrow else (1, len(ranges))
    with figure_style():
        height = 1.5 * len(ranges) + 0.8 if narrow else 2.5
        figure = Figure(figsize=(width_in, height), layout="constrained")
        grid = figure.subplots(*shape, squeeze=False, sharey=True)
        for axes, (low, high) in zip(grid.flat, ranges, strict=True):
            axes.set_title(_title(low, high))
            of_range = (table["size_from_mm"] == low) & (table["size_to_mm"] == high)
            _draw_panel(axes, table[of_range & table["rate"].notna()], detector_looks(detectors))
        for axes in grid[-1]:
            axes.set_xlabel("recordings that teach\n(healthy ones)")
        handles = {
            label: handle
            for axes in grid.flat
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        if handles:
            columns = min(len(handles), 2 if narrow else 4)
            figure.legend(
                handles.values(), handles.keys(), loc="outside lower center", ncols=columns
            )
    return figure


def _title(low: float, high: float) -> str:
    if high == 0:
        return "no nodule: specificity"
    return f"{low:g} mm: found" if low == high else f"from {low:g} mm on: found"


def _draw_panel(axes: Axes, table: pd.DataFrame, looks: Mapping[str, Look]) -> None:
    if table.empty:
        say_nothing_to_show(axes, "no recording to count")
        return
    for name, look in looks.items():
        rows = table[table["detector"] == name].sort_values("taught")
        if rows.empty:
            continue
        low, high = rows["rate_low"].to_numpy(), rows["rate_high"].to_numpy()
        axes.fill_between(rows["taught"], low, high, color=look["color"], alpha=0.15, linewidth=0)
        axes.plot(rows["taught"], rows["rate"], markersize=4, label=name, **look)
    ticks = table.drop_duplicates("share").sort_values("taught")
    axes.set_xticks(ticks["taught"])
    axes.set_xticklabels(
        [
            f"{taught:.0f}\n({healthy:.0f})"
            for taught, healthy in zip(ticks["taught"], ticks["taught_healthy"], strict=True)
        ]
    )
    axes.set(xlim=(0, 1.08 * float(ticks["taught"].max())), ylim=(-0.03, 1.05))
    axes.set_yticks(np.linspace(0, 1, 6))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.grid(color="#d9d9d9", linewidth=0.5)
    axes.set_axisbelow(True)
