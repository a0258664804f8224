"""Draw the figures of the phantom's documentation."""

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from phantom_study.description import Example

# Shade, line style and marker also differ, so the lines can be told apart without colour.
STYLES = (
    {"color": "#000000", "linestyle": "-", "marker": "o"},
    {"color": "#0072b2", "linestyle": "--", "marker": "s"},
    {"color": "#d55e00", "linestyle": "-.", "marker": "^"},
    {"color": "#009e73", "linestyle": ":", "marker": "D"},
    {"color": "#777777", "linestyle": "-", "marker": "v"},
)


def repeatable() -> None:
    """Set matplotlib so that the same figure gives the same bytes, and text remains text."""
    mpl.rcParams.update({"svg.hashsalt": "phantom", "svg.fonttype": "none", "font.size": 9})


def signals(examples: Sequence[Example]) -> Figure:
    """Draw each run in a column, from readings to matrix, as in the paper's figure."""
    figure = Figure(figsize=(2.4 * len(examples), 5.6), layout="constrained")
    axes = figure.subplots(3, len(examples), sharex=True, sharey="row", squeeze=False)
    for (top, middle, bottom), example in zip(axes.T, examples, strict=True):
        top.set_title(example.title)
        _draw_sensors(top, middle, example)
        rows = np.arange(1, len(example.matrix) + 1)
        columns = np.arange(example.matrix.shape[1])
        levels = np.arange(0.1, 1.6, 0.2)
        bottom.contour(columns, rows, example.matrix, levels, cmap="Greys", vmin=-0.5, vmax=1.2)
        bottom.set(yticks=rows, xlabel="sample (10 a second)", ylim=(rows[-1] + 0.5, 0.5))
    axes[0, 0].set_ylabel("reading, counts\n(sensors set apart)")
    axes[1, 0].set_ylabel("RMS envelope\n(standard deviations)")
    axes[2, 0].set_ylabel("matrix V, sensor")
    axes[1, -1].legend(fontsize=7, frameon=False)
    return figure


def _draw_sensors(readings_axes: Axes, envelope_axes: Axes, example: Example) -> None:
    """Draw the readings of the sensors one below the other, and their envelopes."""
    counts = example.run.counts
    samples = np.arange(example.run.time_s.size)
    for sensor, style in zip(range(len(counts)), STYLES, strict=False):
        apart = counts[sensor] - counts[sensor].mean() - 150 * sensor
        readings_axes.plot(samples, apart, color=style["color"], linewidth=0.7)
        envelope_axes.plot(
            samples,
            example.envelope[sensor],
            color=style["color"],
            linestyle=style["linestyle"],
            linewidth=1.2,
            label=f"sensor {sensor + 1}",
        )
    envelope_axes.axhline(1.0, color="0.6", linewidth=0.8)


def cells(rows: Sequence[Mapping[str, str]]) -> Figure:
    """Draw each cell of the paper's table over the range of the simulated archives.

    Parameters
    ----------
    rows
        Rows from `phantom_study.paper_table.summary`; numbers may be text.
    """
    figure = Figure(figsize=(7, 0.24 * len(rows) + 1.0), layout="constrained")
    axes = figure.subplots()
    heights = range(len(rows))
    low, high, mean, paper = (
        [float(row[key]) for row in rows] for key in ("low", "high", "mean", "paper")
    )
    axes.hlines(heights, low, high, color="0.7", linewidth=5, label="simulated, central 95 %")
    axes.plot(mean, heights, "k|", markersize=9, label="simulated, mean")
    axes.plot(paper, heights, "o", color="#d55e00", markersize=5, label="paper")
    axes.set(
        yticks=heights,
        yticklabels=[row["cell"] for row in rows],
        xlabel="%",
        xlim=(-2, 102),
    )
    axes.invert_yaxis()
    figure.legend(loc="outside upper center", ncols=3, fontsize=8, frameon=False)
    return figure


def sensitivity(rows: Sequence[Mapping[str, str]]) -> Figure:
    """Draw how the rates change with each disturbance.

    Parameters
    ----------
    rows
        One row for each disturbance and level, with ``variation``, ``level`` (a factor, or the
        kind of a fault) and the rates in percent.
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
    positions = [float(level) for level in levels] if factors else range(len(levels))
    for rate, style in zip(rates, STYLES, strict=True):
        drawn = style if factors else style | {"linestyle": "none"}
        axes.plot(positions, [float(row[rate]) for row in rows], markersize=4, label=rate, **drawn)
    axes.set(title=variation, ylim=(-3, 103))
    if factors:
        axes.set_xlabel("times the calibrated value")
        axes.axvline(1.0, color="0.85", zorder=0)
    else:
        axes.set(xticks=list(positions), xticklabels=levels, xlim=(-0.5, len(levels) - 0.5))
