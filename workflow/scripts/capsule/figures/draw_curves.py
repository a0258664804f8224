"""Draw curves of rates: for each threshold of a score, and by the recordings that teach."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule.evaluation.cross_validation import main_scheme
from capsule.evaluation.learning import main_ranges
from capsule.evaluation.measures import ALWAYS
from capsule.figures.inputs import FigureInputs
from capsule.figures.style import (
    COLUMN_WIDTH_IN,
    MUTED,
    PAGE_WIDTH_IN,
    Drawing,
    add_legend,
    detector_looks,
    new_figure,
    panels_in_rows,
    say_nothing_to_show,
    show_percent,
)
from capsule.kinds import Look


def curve_table(roc: pd.DataFrame, summary: pd.DataFrame, scheme: str) -> pd.DataFrame:
    """Return the curves and the operating points of one scheme; NaN mm is any nodule."""
    columns = ["detector", "size_mm", "false_positive_rate", "true_positive_rate"]
    curves = roc[roc["scheme"] == scheme].reindex(columns=columns)
    points = summary[(summary["scheme"] == scheme) & (summary["detector"] != ALWAYS)]
    points = points.assign(
        false_positive_rate=1 - points["specificity"].astype(float),
        true_positive_rate=points["sensitivity"],
    )
    points = points.reindex(columns=columns).dropna(subset=columns[2:])
    parts = [curves.assign(kind="curve"), points.assign(kind="operating point")]
    # Leave out empty parts: pandas warns about them, because their columns have no types.
    return pd.concat([part for part in parts if not part.empty] or parts[:1], ignore_index=True)


def roc_drawing(inputs: FigureInputs) -> Drawing:
    """Return the drawing of all detectors' curves for the main scheme."""
    tables = inputs.evaluation.tables
    scheme = main_scheme(tables["roc"]["scheme"].unique())
    curves = curve_table(tables["roc"], tables["summary"], scheme)
    detectors = inputs.evaluation.detectors()
    return curves, partial(draw_roc, curves, detectors)


def draw_roc(
    table: pd.DataFrame, detectors: Sequence[str], width_in: float = PAGE_WIDTH_IN
) -> Figure:
    """Draw the curves of any nodule and of each size against no nodule, one panel per curve.

    Detectors with the same score share one curve, but each has its own operating point.
    """
    sizes_mm = [float("nan"), *sorted(table["size_mm"].dropna().unique())]
    across = 2 if width_in <= COLUMN_WIDTH_IN else 3
    looks = detector_looks(detectors)
    height = width_in / across * -(-len(sizes_mm) // across) + 0.55
    with new_figure(width_in, height) as figure:
        panels = panels_in_rows(figure, len(sizes_mm), across, "false alarms", "nodules found")
        for axes, size_mm in zip(panels, sizes_mm, strict=True):
            of_any = np.isnan(size_mm)
            axes.set_title("any nodule" if of_any else f"{size_mm:g} mm")
            size = table["size_mm"]
            _draw_roc_panel(axes, table[size.isna() if of_any else size == size_mm], looks)
        add_legend(figure, panels[:1], 1 if across == 2 else 3)
    return figure


def _draw_roc_panel(axes: Axes, table: pd.DataFrame, looks: Mapping[str, Look]) -> None:
    curves = table[table["kind"] == "curve"]
    if curves.empty:
        say_nothing_to_show(axes, "no recording to count")
        return
    axes.plot([0, 1], [0, 1], color=MUTED, linewidth=0.5)
    drawn: dict[tuple[float, ...], list[str]] = {}
    for name in looks:
        rows = curves[curves["detector"] == name]
        if not rows.empty:
            drawn.setdefault(tuple(rows["true_positive_rate"]), []).append(name)
    for names in drawn.values():
        rows = curves[curves["detector"] == names[-1]].sort_values("false_positive_rate")
        look = looks[names[-1]]
        # The curve is a staircase: each rate holds for at most that many false alarms.
        axes.step(
            np.concatenate([[0], rows["false_positive_rate"]]),
            np.concatenate([[0], rows["true_positive_rate"]]),
            where="post",
            color=look["color"],
            linestyle=look["linestyle"],
            label=f"score of {', '.join(names)}",
        )
    points = table[table["kind"] == "operating point"]
    for name, look in looks.items():
        row = points[points["detector"] == name]
        if not row.empty:
            axes.plot(
                row["false_positive_rate"],
                row["true_positive_rate"],
                linestyle="none",
                marker=look["marker"],
                color=look["color"],
                markersize=4.5,
                markeredgecolor="white",
                markeredgewidth=0.6,
                label=f"verdicts of {name}",
                zorder=3,
            )
    axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), aspect="equal")
    for axis in (axes.xaxis, axes.yaxis):
        show_percent(axis, 3)
    axes.grid()
    axes.set_axisbelow(True)


def learning_drawing(inputs: FigureInputs) -> Drawing:
    """Return the drawing of the rates at each share of the archive, per learning detector."""
    table, detectors = inputs.learning, inputs.evaluation.detectors()
    return table, partial(draw_learning, table, detectors)


def draw_learning(
    table: pd.DataFrame, detectors: Sequence[str], width_in: float = PAGE_WIDTH_IN
) -> Figure:
    """Draw specificity and sensitivity against the recordings that teach, one panel per rate.

    A detector without a row has no curve.
    """
    looks = detector_looks(detectors)
    # Without recordings, one empty panel remains, with a note.
    ranges = main_ranges(table["size_from_mm"]) or [(0.0, 0.0)]
    narrow = width_in <= COLUMN_WIDTH_IN
    shape = (len(ranges), 1) if narrow else (1, len(ranges))
    with new_figure(width_in, 1.5 * len(ranges) + 0.8 if narrow else 2.5) as figure:
        grid = figure.subplots(*shape, squeeze=False, sharey=True)
        for axes, (low, high) in zip(grid.flat, ranges, strict=True):
            sizes = f"{low:g} mm" if low == high else f"from {low:g} mm on"
            axes.set_title(f"{sizes}: found" if high > 0 else "no nodule: specificity")
            of_range = (table["size_from_mm"] == low) & (table["size_to_mm"] == high)
            _draw_learning_panel(axes, table[of_range & table["rate"].notna()], looks)
        for axes in grid[-1]:
            axes.set_xlabel("recordings that teach\n(healthy ones)")
        add_legend(figure, list(grid.flat), 2 if narrow else 4)
    return figure


def _draw_learning_panel(axes: Axes, table: pd.DataFrame, looks: Mapping[str, Look]) -> None:
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
    counts = ticks[["taught", "taught_healthy"]].to_numpy()
    axes.set_xticks(ticks["taught"], [f"{each:.0f}\n({healthy:.0f})" for each, healthy in counts])
    axes.set(xlim=(0, 1.08 * max(1.0, float(ticks["taught"].max()))), ylim=(-0.03, 1.05))
    show_percent(axes.yaxis, 6)
    axes.grid()
    axes.set_axisbelow(True)
