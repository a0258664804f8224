"""Draw the ROC curves: the rates that each threshold of a score reaches."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from capsule.evaluation.cross_validation import main_scheme
from capsule.figures.inputs import Drawing, FigureInputs
from capsule.figures.style import (
    COLUMN_WIDTH_IN,
    MUTED,
    PAGE_WIDTH_IN,
    detector_looks,
    figure_style,
    say_nothing_to_show,
)
from capsule.kinds import Look


def curve_table(
    roc: pd.DataFrame, summary: pd.DataFrame, sensitivity: pd.DataFrame, scheme: str
) -> pd.DataFrame:
    """Return the curves and the operating points of one scheme.

    Parameters
    ----------
    roc : DataFrame
        Curves, per detector and size; an empty size means any nodule.
    summary, sensitivity : DataFrame
        Specificity per detector, and sensitivity per detector and size.
    scheme : str
        The scheme.

    Returns
    -------
    DataFrame
        ``detector``, ``size_mm`` (NaN for any nodule), ``kind`` (``curve`` or ``operating point``)
        and both rates.
    """
    columns = ["detector", "size_mm", "false_positive_rate", "true_positive_rate"]
    curves = roc[roc["scheme"] == scheme].reindex(columns=columns)
    specificity = summary[summary["scheme"] == scheme].set_index("detector")["specificity"]
    points = sensitivity[sensitivity["scheme"] == scheme].assign(
        false_positive_rate=lambda rows: 1 - rows["detector"].map(specificity).astype(float)
    )
    points = points.rename(columns={"sensitivity": "true_positive_rate"}).reindex(columns=columns)
    points = points.dropna(subset=columns[2:])
    parts = [curves.assign(kind="curve"), points.assign(kind="operating point")]
    # Leave out empty parts: pandas warns about them, because their columns have no types.
    return pd.concat([part for part in parts if not part.empty] or parts[:1], ignore_index=True)


def roc_drawing(inputs: FigureInputs) -> Drawing:
    """Return the drawing of all detectors' curves for the main scheme."""
    tables = inputs.judgements
    scheme = main_scheme(tables["roc"]["scheme"].unique())
    curves = curve_table(tables["roc"], tables["summary"], tables["predictive_values"], scheme)
    detectors = inputs.evaluation.detectors()
    return curves, lambda width_in: draw_roc(curves, detectors, width_in)


def draw_roc(
    table: pd.DataFrame, detectors: Sequence[str], width_in: float = PAGE_WIDTH_IN
) -> Figure:
    """Draw the curves of any nodule and of each size against no nodule, one panel per curve.

    Detectors with the same score share one curve, but each has its own operating point.

    Parameters
    ----------
    table : DataFrame
        From `curve_table`.
    detectors : sequence of str
        In the order of the configuration.
    width_in : float
        Width of the figure in inches.

    Returns
    -------
    Figure
    """
    sizes_mm = sorted(table["size_mm"].dropna().unique())
    panels = [float("nan"), *sizes_mm]
    across = 2 if width_in <= COLUMN_WIDTH_IN else 3
    down = -(-len(panels) // across)
    looks = detector_looks(detectors)
    with figure_style():
        side = width_in / across
        figure = Figure(figsize=(width_in, side * down + 0.55), layout="constrained")
        grid = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True)
        for axes in grid.flat[len(panels) :]:
            axes.set_visible(False)
        for axes, size_mm in zip(grid.flat, panels, strict=False):
            of_any = np.isnan(size_mm)
            axes.set_title("any nodule" if of_any else f"{size_mm:g} mm")
            size = table["size_mm"]
            _draw_panel(axes, table[size.isna() if of_any else size == size_mm], looks)
        for index, axes in enumerate(grid.flat[: len(panels)]):
            if index + across >= len(panels):
                axes.set_xlabel("false alarms")
                axes.tick_params(labelbottom=True)
            if index % across == 0:
                axes.set_ylabel("nodules found")
        handles, labels = grid[0, 0].get_legend_handles_labels()
        if handles:
            columns = 1 if across == 2 else 3
            figure.legend(handles, labels, loc="outside lower center", ncols=columns)
    return figure


def _draw_panel(axes: Axes, table: pd.DataFrame, looks: Mapping[str, Look]) -> None:
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
        axis.set_ticks(np.linspace(0, 1, 3))
        axis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.grid(color="#d9d9d9", linewidth=0.5)
    axes.set_axisbelow(True)
