"""Draw curves of rates: for each threshold of a score, and by the recordings that teach."""

from collections.abc import Mapping
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from capsule.evaluation.cross_validation import main_scheme
from capsule.evaluation.learning import main_ranges
from capsule.evaluation.measures import ALWAYS
from capsule.figures import style
from capsule.figures.inputs import FigureInputs
from capsule.kinds import Look


def curve_table(roc: pd.DataFrame, summary: pd.DataFrame, scheme: str) -> pd.DataFrame:
    """Return the curves and the operating points of one scheme; NaN mm is any nodule."""
    columns = ["detector", "size_mm", "false_positive_rate", "true_positive_rate"]
    points = summary[summary["detector"] != ALWAYS]
    points = points.assign(
        false_positive_rate=1 - points["specificity"].astype(float),
        true_positive_rate=points["sensitivity"],
    )
    parts = [
        table.loc[table["scheme"] == scheme, columns].dropna(subset=columns[2:]).assign(kind=kind)
        for kind, table in (("curve", roc), ("operating point", points))
    ]
    # Leave out empty parts: pandas warns about them, because their columns have no types.
    return pd.concat([part for part in parts if not part.empty] or parts[:1], ignore_index=True)


def roc_drawing(inputs: FigureInputs) -> style.Drawing:
    """Return the drawing of all detectors' curves for the main scheme, with their verdicts.

    A panel each has any nodule and each size against no nodule.
    """
    tables = inputs.evaluation.tables
    scheme = main_scheme(tables["roc"]["scheme"].unique())
    table = curve_table(tables["roc"], tables["summary"], scheme)
    sizes = table["size_mm"]
    panels = {"any nodule": table[sizes.isna()]}
    panels |= {f"{size:g} mm": table[sizes == size] for size in sorted(sizes.dropna().unique())}
    draw = partial(_draw_roc, looks=style.detector_looks(inputs.evaluation.detectors()))
    labels = ("false alarms", "nodules found")
    return table, partial(style.rates_figure, panels, draw, labels, square=True)


def _draw_roc(axes: Axes, table: pd.DataFrame, looks: Mapping[str, Look]) -> None:
    rates = ["false_positive_rate", "true_positive_rate"]
    axes.plot([0, 1], [0, 1], color=style.MUTED, linewidth=0.5)
    point = {"linestyle": "none", "markersize": 4.5, "markeredgecolor": "white", "zorder": 3}
    for (name, kind), rows in table.groupby(["detector", "kind"], sort=False):
        if kind == "curve":
            # The curve is a staircase: each rate holds for at most that many false alarms.
            steps = np.vstack([[0, 0], rows[rates].sort_values(rates[0])]).T
            look = {**looks[name], "marker": "", "label": f"score of {name}"}
            axes.step(*steps, where="post", **look)
        else:
            look = {**looks[name], **point, "label": f"verdicts of {name}"}
            axes.plot(*rows[rates].to_numpy().T, markeredgewidth=0.6, **look)
    axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), aspect="equal")
    for axis in (axes.xaxis, axes.yaxis):
        style.show_percent(axis, 3)
    axes.grid()


def learning_drawing(inputs: FigureInputs) -> style.Drawing:
    """Return the drawing of specificity and sensitivity against the recordings that teach.

    A panel each has one rate. A detector without a row has no curve.
    """
    table, panels = inputs.learning, {}
    known = table.dropna(subset="rate")
    # Without recordings, one empty panel remains, with a note.
    for low, high in main_ranges(table["size_from_mm"]) or [(0.0, 0.0)]:
        sizes = f"{low:g} mm" if low == high else f"from {low:g} mm on"
        of_range = (known["size_from_mm"] == low) & (known["size_to_mm"] == high)
        panels[f"{sizes}: found" if high > 0 else "no nodule: specificity"] = known[of_range]
    draw = partial(_draw_learning, looks=style.detector_looks(inputs.evaluation.detectors()))
    labels = ("recordings that teach\n(healthy ones)", "")
    return table, partial(style.rates_figure, panels, draw, labels)


def _draw_learning(axes: Axes, table: pd.DataFrame, looks: Mapping[str, Look]) -> None:
    for name, of_name in table.groupby("detector", sort=False):
        rows, look = of_name.sort_values("taught"), looks[name]
        area = {"color": look["color"], "alpha": 0.15, "linewidth": 0}
        axes.fill_between(rows["taught"], rows["rate_low"], rows["rate_high"], **area)
        axes.plot(rows["taught"], rows["rate"], markersize=4, label=name, **look)
    ticks = table.drop_duplicates("share").sort_values("taught")
    counts = ticks[["taught", "taught_healthy"]].to_numpy()
    axes.set_xticks(ticks["taught"], [f"{each:.0f}\n({healthy:.0f})" for each, healthy in counts])
    axes.set(xlim=(0, 1.08 * max(1.0, float(ticks["taught"].max()))), ylim=(-0.03, 1.05))
    style.show_percent(axes.yaxis, 6)
    axes.grid()
