"""Figures of the phantom's documentation."""

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule.phantom.simulation import Run

# Told apart without colour, too: by shade, line style and marker.
STYLES = (
    {"color": "#000000", "linestyle": "-", "marker": "o"},
    {"color": "#0072b2", "linestyle": "--", "marker": "s"},
    {"color": "#d55e00", "linestyle": "-.", "marker": "^"},
    {"color": "#009e73", "linestyle": ":", "marker": "D"},
    {"color": "#777777", "linestyle": "-", "marker": "v"},
)


def repeatable() -> None:
    """Make matplotlib write the same figure as the same bytes, with text as text."""
    mpl.rcParams.update({"svg.hashsalt": "phantom", "svg.fonttype": "none", "font.size": 9})


def signals(
    runs: Sequence[Run],
    titles: Sequence[str],
    envelopes: Sequence[np.ndarray],
    matrices: Sequence[np.ndarray],
) -> Figure:
    """Draw runs as the paper's pre-processing figure does: readings, envelopes, matrix.

    Parameters
    ----------
    runs, titles
        The simulated runs, one a column, and what to call them.
    envelopes
        RMS envelopes, each (S, K).
    matrices
        Matrices V, each (S, L).
    """
    figure = Figure(figsize=(2.4 * len(runs), 5.6), layout="constrained")
    axes = figure.subplots(3, len(runs), sharex=True, sharey="row", squeeze=False)
    for column, (run, envelope, matrix) in enumerate(zip(runs, envelopes, matrices, strict=True)):
        top, middle, bottom = axes[:, column]
        top.set_title(titles[column])
        for sensor, style in zip(range(len(run.counts)), STYLES, strict=False):
            line = {"color": style["color"], "linewidth": 0.7}
            samples = np.arange(run.time_s.size)
            top.plot(samples, run.counts[sensor] - run.counts[sensor].mean() - 150 * sensor, **line)
            middle.plot(
                samples,
                envelope[sensor],
                linestyle=style["linestyle"],
                **line | {"linewidth": 1.2},
                label=f"sensor {sensor + 1}",
            )
        middle.axhline(1.0, color="0.6", linewidth=0.8)
        rows = np.arange(1, len(matrix) + 1)
        bottom.contour(
            np.arange(matrix.shape[1]),
            rows,
            matrix,
            np.arange(0.1, 1.6, 0.2),
            cmap="Greys",
            vmin=-0.5,
            vmax=1.2,
        )
        bottom.set(yticks=rows, xlabel="sample (10 a second)", ylim=(rows[-1] + 0.5, 0.5))
    axes[0, 0].set_ylabel("reading, counts\n(sensors set apart)")
    axes[1, 0].set_ylabel("RMS envelope\n(standard deviations)")
    axes[2, 0].set_ylabel("matrix V, sensor")
    axes[1, -1].legend(fontsize=7, frameon=False)
    return figure


def cells(rows: Sequence[Mapping[str, str]]) -> Figure:
    """Draw each cell of the paper's table over the range of the simulated archives.

    Parameters
    ----------
    rows
        As `phantom_study.paper_table.summary` gives them; numbers or their text.
    """
    figure = Figure(figsize=(7, 0.24 * len(rows) + 1.0), layout="constrained")
    axes = figure.subplots()
    for place, row in enumerate(rows):
        axes.plot(
            [float(row["low"]), float(row["high"])],
            [place, place],
            color="0.7",
            linewidth=5,
            solid_capstyle="butt",
            label="simulated, central 95 %" if place == 0 else None,
        )
        axes.plot(
            float(row["mean"]),
            place,
            "k|",
            markersize=9,
            label="simulated, mean" if place == 0 else None,
        )
        axes.plot(
            float(row["paper"]),
            place,
            "o",
            color="#d55e00",
            markersize=5,
            label="paper" if place == 0 else None,
        )
    axes.set(
        yticks=range(len(rows)),
        yticklabels=[row["cell"] for row in rows],
        xlabel="%",
        xlim=(-2, 102),
    )
    axes.invert_yaxis()
    figure.legend(loc="outside upper center", ncols=3, fontsize=8, frameon=False)
    return figure


def sensitivity(rows: Sequence[Mapping[str, str]]) -> Figure:
    """Draw how the rates move with each disturbance.

    Parameters
    ----------
    rows
        One a disturbance and level: ``variation``, ``level`` (a factor, or the kind of a fault),
        and one column a rate, in percent.
    """
    variations = list(dict.fromkeys(row["variation"] for row in rows))
    figure = Figure(figsize=(9.5, 5.6), layout="constrained")
    axes = figure.subplots(2, 3, sharey=True).ravel()
    rates = [key for key in rows[0] if key not in ("variation", "level")]
    for panel, variation in zip(axes, variations, strict=False):
        chosen = [row for row in rows if row["variation"] == variation]
        _panel(panel, variation, chosen, rates)
    for panel in axes[len(variations) :]:
        panel.axis("off")
    handles, labels = axes[0].get_legend_handles_labels()
    axes[-1].legend(handles, labels, loc="center", frameon=False)
    for panel in (axes[0], axes[3]):
        panel.set_ylabel("%")
    return figure


def _panel(axes: Axes, variation: str, rows: Sequence[Mapping[str, str]], rates: list[str]) -> None:
    levels = [row["level"] for row in rows]
    factors = variation != "one faulty sensor"
    places = [float(level) for level in levels] if factors else range(len(levels))
    for rate, style in zip(rates, STYLES, strict=True):
        drawn = style if factors else style | {"linestyle": "none"}
        axes.plot(places, [float(row[rate]) for row in rows], markersize=4, label=rate, **drawn)
    axes.set(title=variation, ylim=(-3, 103))
    if factors:
        axes.set_xlabel("times the calibrated value")
        axes.axvline(1.0, color="0.85", zorder=0)
    else:
        axes.set(xticks=list(places), xticklabels=levels, xlim=(-0.5, len(levels) - 0.5))
