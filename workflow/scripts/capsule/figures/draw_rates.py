"""Draw rates per size: of the leading detector, the paper's detector, and the paper."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from capsule import words
from capsule.detectors.registry import PAPER
from capsule.evaluation import paper
from capsule.evaluation.cross_validation import main_scheme
from capsule.evaluation.lead import leading
from capsule.figures import style
from capsule.figures.inputs import FigureInputs
from capsule.kinds import Look

# Look of all markers and whiskers; each detector has its own colour and shape.
_MARKS: Look = {"linestyle": "none", "markersize": 4.5, "elinewidth": 0.9, "capsize": 1.8}


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
    return table, partial(style.rates_figure, of_title, draw, (x_label, ""))


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
    axes.set(xlim=(-0.6, len(sizes_mm) - 0.4), ylim=(-0.03, 1.05))
    style.show_percent(axes.yaxis, 6)
    axes.grid(axis="y")
    axes.axhline(0, color=style.INK, linewidth=0.6)
