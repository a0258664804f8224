"""Draw rates: of each size, for each threshold of a score, and by the recordings that teach."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from capsule import words
from capsule.detectors.registry import PAPER
from capsule.evaluation import paper
from capsule.evaluation.archive_rates import leading
from capsule.evaluation.cross_validation import main_scheme
from capsule.evaluation.learning import main_ranges
from capsule.evaluation.measures import ALWAYS
from capsule.figures import style
from capsule.figures.inputs import FigureInputs
from capsule.kinds import Look

# Look of all markers and whiskers; each detector has its own colour and shape.
_MARKS: Look = {"linestyle": "none", "markersize": 4.5, "elinewidth": 0.9, "capsize": 1.8}


def _figure(
    panels: Mapping[str, pd.DataFrame],
    draw: Callable[[Axes, pd.DataFrame], None],
    labels: tuple[str, str],
    width_in: float,
    *,
    square: bool = False,
) -> Figure:
    """Return a figure of rates: a panel for each title, drawn from its rows, or with a note.

    `labels` are those of the axes. If both of these are rates, the panels are `square`.
    """
    across = min(len(panels), 1 + square if width_in <= style.COLUMN_WIDTH_IN else 3)
    row_in = width_in / across if square else 1.9
    with style.new_figure(width_in, row_in * -(-len(panels) // across) + 0.7) as figure:
        shown = style.panels_in_rows(figure, len(panels), across, *labels, sharex=square)
        for axes, (title, rows) in zip(shown, panels.items(), strict=True):
            axes.set_title(title)
            if rows.empty:
                style.say_nothing_to_show(axes, "no recording to count")
                continue
            draw(axes, rows)
            axes.set_ylim(-0.03, 1.05)
            if square:
                axes.set(xlim=axes.get_ylim(), aspect="equal")
            for axis in (axes.xaxis, axes.yaxis) if square else (axes.yaxis,):
                axis.set_ticks(np.linspace(0, 1, 3 if square else 6))
                axis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
                axis.grid(visible=True)
        style.add_legend(figure, shown)
    return figure


def detection_drawing(inputs: FigureInputs) -> style.Drawing:
    """Return the drawing of precision and recall per size, for each series."""
    table = paper.detection_points(series_rows(inputs, "detection"))
    return _drawing(inputs, table, {"precision": "precision", "recall": "recall"})


def sizing_drawing(inputs: FigureInputs) -> style.Drawing:
    """Return the drawing of the exact and within-tolerance rates per size, for each series."""
    table = paper.sizing_points(series_rows(inputs, "sizing"))
    within = f"within {inputs.settings['evaluation']['tolerance_mm']:g} mm (*: one-sided)"
    return _drawing(inputs, table, {"exact_rate": "exact size", "within_rate": within})


def negatives_drawing(inputs: FigureInputs) -> style.Drawing:
    """Return the drawing of the verdicts on healthy recordings, for each series."""
    table = paper.negative_points(series_rows(inputs, "confusion"))
    panels = {"classified": "recordings without a nodule, by verdict"}
    return _drawing(inputs, table, panels, "predicted size (mm)", from_size=0)


def _drawing(
    inputs: FigureInputs,
    table: pd.DataFrame,
    panels: Mapping[str, str],
    x_label: str = "size of the nodule (mm)",
    from_size: int = 1,
) -> style.Drawing:
    """Return the drawing of rates with their intervals; `panels` has the title of each measure.

    Rates are fractions, NaN if nothing was counted.
    """
    sizes_mm = inputs.evaluation.sizes_mm()[from_size:]
    looks = style.detector_looks(inputs.evaluation.detectors()) | {paper.NAME: style.PAPER_LOOK}
    known = table[table["size_mm"].isin(sizes_mm) & table["rate"].notna()]
    of_title = {title: known[known["measure"] == measure] for measure, title in panels.items()}
    draw = partial(_draw_panel, sizes_mm=sizes_mm, looks=looks)
    return table, partial(_figure, of_title, draw, (x_label, ""))


def series_rows(inputs: FigureInputs, name: str) -> pd.DataFrame:
    """Return the rows of a table that the figures of rates show.

    The leading detector's rows for the main scheme, then those of the paper's detector if another
    one leads, then the paper's own rows.
    """
    evaluation, settings = inputs.evaluation, inputs.settings
    schemes, named = settings["evaluation"]["schemes"], settings["report"]["lead"]
    lead = leading(evaluation.tables["summary"], evaluation.detectors(), schemes, named)
    table = evaluation.tables[name]
    table = table[table["scheme"] == main_scheme(table["scheme"].unique())]
    shown = [table[table["detector"] == each] for each in dict.fromkeys([lead.detector, PAPER])]
    return pd.concat([*shown, evaluation.paper[name]], ignore_index=True)


def _draw_panel(
    axes: Axes, table: pd.DataFrame, sizes_mm: Sequence[float], looks: Mapping[str, Look]
) -> None:
    series = table.groupby(["detector", "scheme"], sort=False)
    for order, ((detector, scheme), rows) in enumerate(series):
        shift = 0.2 * (order - (series.ngroups - 1) / 2)
        value = rows["rate"].to_numpy()
        reach = np.maximum([value - rows["low"], rows["high"] - value], 0.0)
        shown = words.scheme(scheme)
        label = shown if detector == paper.NAME else f"{detector} ({shown})"
        position = np.searchsorted(sizes_mm, rows["size_mm"]) + shift
        axes.errorbar(position, value, yerr=reach, label=label, **{**looks[detector], **_MARKS})
    one_sided = set(table.loc[table["one_sided"], "size_mm"])
    names = [
        f"{size_mm:g}" + "*" * (size_mm in one_sided) if size_mm else "none" for size_mm in sizes_mm
    ]
    axes.set_xticks(range(len(sizes_mm)), names)
    axes.set_xlim(-0.6, len(sizes_mm) - 0.4)
    axes.axhline(0, color=style.INK, linewidth=0.6)


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
    return table, partial(_figure, panels, draw, labels, square=True)


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
    return table, partial(_figure, panels, draw, labels)


def _draw_learning(axes: Axes, table: pd.DataFrame, looks: Mapping[str, Look]) -> None:
    for name, of_name in table.groupby("detector", sort=False):
        rows, look = of_name.sort_values("taught"), looks[name]
        area = {"color": look["color"], "alpha": 0.15, "linewidth": 0}
        axes.fill_between(rows["taught"], rows["rate_low"], rows["rate_high"], **area)
        axes.plot(rows["taught"], rows["rate"], markersize=4, label=name, **look)
    ticks = table.drop_duplicates("share").sort_values("taught")
    counts = ticks[["taught", "taught_healthy"]].to_numpy()
    axes.set_xticks(ticks["taught"], [f"{each:.0f}\n({healthy:.0f})" for each, healthy in counts])
    axes.set_xlim(0, 1.08 * max(1.0, float(ticks["taught"].max())))
