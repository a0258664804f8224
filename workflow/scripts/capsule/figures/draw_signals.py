"""Draw signals: the stages of pre-processing, the templates, and a recording as it is judged."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import cycle
from string import ascii_uppercase

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from capsule import words
from capsule.arrays import FloatArray, NumberArray
from capsule.evaluation.paper import Evaluation
from capsule.figures import style
from capsule.figures.inputs import FigureInputs
from capsule.kinds import Look
from capsule.method.preprocessing import PreprocessedRun

# More columns than this add no visible detail, and their contours make large files.
_COLUMNS_DRAWN = 250
# Room above the readings for the legend, as a share of the readings' range.
_HEADROOM = 0.3


def contour_levels(highest: float, *, with_faint: bool = False) -> FloatArray:
    """Return some eight round heights from 0 to at least the highest value, two or more.

    A faint height at a fifth of the first step shows low patterns.
    """
    levels: FloatArray = np.asarray(MaxNLocator(8).tick_values(0.0, highest or 1.0))
    return np.insert(levels, 1, levels[1] / 5) if with_faint else levels


def _draw_matrices(
    panels: Sequence[tuple[Axes, FloatArray, NumberArray]], bar: Look, *, with_faint: bool = False
) -> None:
    """Draw matrices over their columns, sensor 1 on top, with one scale and its bar.

    Heights between the rows are interpolated. A matrix with any NaN, or with zeros only, has a note
    instead of contours.
    """
    highest = max((float(np.nanmax(each, initial=0.0)) for _, each, _ in panels), default=0.0)
    levels, filled = contour_levels(highest, with_faint=with_faint), None
    for axes, heights, column in panels:
        row = np.arange(1.0, len(heights) + 1)
        axes.set_yticks(row)
        if len(heights) == 1:
            # Contours need two rows, so a single sensor becomes a band.
            row, heights = np.array([0.5, 1.5]), np.repeat(heights, 2, axis=0)
        axes.set(xlim=(column[0], column[-1]), ylim=(row[-1], row[0]))
        if np.isnan(heights).any():
            style.say_nothing_to_show(axes, "not known: no accepted recording")
        elif not heights.any():
            middle: Look = {"transform": axes.transAxes, "ha": "center", "va": "center"}
            axes.text(0.5, 0.5, "zero everywhere", **middle)
        else:
            some = slice(None, None, max(1, -(-column.size // _COLUMNS_DRAWN)))
            drawn = column[some], row, heights[:, some]
            filled = axes.contourf(*drawn, levels=levels, cmap=style.COLOURS_OF_HEIGHT)
            axes.contour(*drawn, levels=levels[1:], colors=style.INK, linewidths=0.4)
    if filled is not None:
        beside = [axes for axes, _, _ in panels]
        scale = axes.figure.colorbar(filled, ax=beside, label="height (SD)", **bar)
        scale.outline.set_linewidth(0.4)


def typical_recordings(evaluation: Evaluation) -> list[tuple[str, str | None]]:
    """Return title and name of a typical run without a nodule, and of one over the middle size.

    A typical recording is the median one by its distance to the zero template (of two the lower, of
    equal ones the first by name), so that the figure does not show an unusually good one. Without
    such a recording the name is None.
    """
    nodules_mm = evaluation.sizes_mm()[1:]
    middle_mm = nodules_mm[(len(nodules_mm) - 1) // 2] if nodules_mm else None
    nodule = f"{middle_mm:g} mm nodule" if nodules_mm else "nodule"
    rows = evaluation.predictions.drop_duplicates("recording")
    ordered = rows.sort_values(["rmse_0mm", "recording"])
    typical = []
    for title, size_mm in (("no nodule", 0.0), (nodule, middle_mm)):
        names = ordered.loc[ordered["size_mm"] == size_mm, "recording"].tolist()
        typical.append((title, names[(len(names) - 1) // 2] if names else None))
    return typical


def _of_sensors(name: str, rows: FloatArray) -> dict[str, FloatArray]:
    """Return a row per sensor as columns of a table, such as ``reading_1``."""
    return {f"{name}_{sensor}": row for sensor, row in enumerate(rows, start=1)}


def example_table(examples: Sequence[PreprocessedRun | None]) -> pd.DataFrame:
    """Return the figure's data as a table, one row per sample."""
    columns = ["recording", "time_s"]
    frames = [
        pd.DataFrame(
            {"recording": each.recording, "time_s": each.time_s}
            | _of_sensors("reading", each.values)
            | _of_sensors("envelope", each.envelope)
            | _of_sensors("matrix", each.matrix)
        )
        for each in filter(None, examples)
    ]
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=columns)


def preprocessing_drawing(inputs: FigureInputs) -> style.Drawing:
    """Return the drawing of the stages of a typical run without and a typical run with a nodule."""
    typical = typical_recordings(inputs.evaluation)
    examples = [inputs.run(name, title) if name else None for title, name in typical]
    threshold = inputs.settings["preprocessing"]["threshold"]
    return example_table(examples), partial(draw_preprocessing, examples, threshold)


def draw_preprocessing(
    examples: Sequence[PreprocessedRun | None],
    threshold: float,
    width_in: float = style.PAGE_WIDTH_IN,
) -> Figure:
    """Draw the stages of pre-processing (eq. normalization to eq. extended), one column per run.

    None stands for a run that the archive does not have. The threshold is in standard deviations.
    """
    known = [example for example in examples if example is not None]
    tallest = max((float(np.nanmax(each.envelope)) for each in known), default=1.0)
    with style.new_figure(width_in, 4.6) as figure:
        grid = figure.subplots(3, len(examples), squeeze=False, height_ratios=[1.15, 1, 1])
        matrices = []
        labels = ("readings", "RMS envelope (SD)", "matrix, by sensor")
        for axes, label in zip(grid[:, 0], labels, strict=True):
            axes.set_ylabel(label)
        for letter, example, column in zip(ascii_uppercase, examples, grid.T, strict=False):
            signal, envelope, matrix = column
            if example is None:
                for axes in column:
                    style.say_nothing_to_show(axes, "no such recording")
                continue
            signal.set_title(f"({letter}) {example.title}")
            for axes in (signal, envelope):
                axes.set_prop_cycle(color=style.SENSOR_COLOURS, linestyle=style.SENSOR_DASHES)
                axes.set_xlim(example.time_s[0], example.time_s[-1])
                axes.tick_params(labelbottom=False)
            # The readings of each sensor stand below the other, with one scale for all.
            readings = example.values - np.nanmedian(example.values, axis=1, keepdims=True)
            sensors = np.arange(1, len(readings) + 1)
            middles = -0.75 * (np.nanmax(readings) - np.nanmin(readings)) * (sensors - 1)
            signal.plot(example.time_s, readings.T + middles, linestyle="-", linewidth=0.6)
            signal.set_yticks(middles, sensors.astype(str))
            names = [f"sensor {sensor}" for sensor in sensors]
            envelope.plot(example.time_s, example.envelope.T, label=names)
            look = {"label": f"threshold {threshold:g}", "color": style.INK, "linewidth": 0.6}
            envelope.axhline(threshold, zorder=0, **look)
            envelope.set_ylim(0, 1.05 * tallest)
            matrix.set_xlabel("time (s)")
            matrices.append((matrix, example.matrix, example.time_s))
        _draw_matrices(matrices, {"aspect": 9, "pad": 0.01})
        style.add_legend(figure, grid[1, :].tolist(), handlelength=2.8)
    return figure


def draw_judged(
    run: PreprocessedRun,
    threshold: float,
    places_s: Mapping[float, Sequence[str]],
    passing_s: Sequence[float] = (),
) -> Figure:
    """Draw a recording, with lines where the detectors find a nodule; its title has their verdicts.

    `places_s` are the detectors by the time in s at which sensor 1 passes the nodule. `passing_s`
    are the times at which the sensors pass it, which make the diagonal; empty if unknown.
    """
    figure = draw_preprocessing([run], threshold)
    signal, envelope, matrix = figure.axes[:3]
    with style.figure_style():
        for (place, names), look in zip(places_s.items(), cycle(style.DETECTOR_LOOKS)):
            label = f"place by {words.enumerate_words(names)}: {words.place(place, None)}"
            line = {**look, "marker": "", "linewidth": 1.2, "label": label}
            for axes in (signal, envelope, matrix):
                axes.axvline(place, **line)
        if passing_s:
            look = {"color": style.INK, "marker": "o", "markersize": 3.5, "linewidth": 0.9}
            for axes in (signal, matrix):
                axes.plot(passing_s, axes.get_yticks(), label="the diagonal", **look)
        low, high = signal.get_ylim()
        signal.set(title=run.title, ylim=(low, high + _HEADROOM * (high - low)))
        marks, names = signal.get_legend_handles_labels()
        if marks:
            signal.legend(marks, names, loc="upper right", ncols=len(marks), borderaxespad=0)
    return figure


def template_table(templates: Mapping[float, FloatArray]) -> pd.DataFrame:
    """Return the templates by size in mm as a table, one row per column of a matrix."""
    frames = [
        pd.DataFrame(
            {"size_mm": size_mm, "column": np.arange(1, matrix.shape[1] + 1)}
            | _of_sensors("sensor", matrix)
        )
        for size_mm, matrix in templates.items()
    ]
    return pd.concat(frames, ignore_index=True)


def templates_drawing(inputs: FigureInputs) -> style.Drawing:
    """Return the drawing of the templates, each with the number of recordings that it averages."""
    templates = inputs.templates
    return template_table(templates), partial(draw_templates, templates, inputs.template_counts)


def draw_templates(
    templates: Mapping[float, FloatArray],
    counts: Sequence[int],
    width_in: float = style.PAGE_WIDTH_IN,
) -> Figure:
    """Draw every template T^b with one scale, and how many recordings it averages."""
    narrow = width_in <= style.COLUMN_WIDTH_IN
    across = min(len(templates), 2 if narrow else 3)
    height = -(-len(templates) // across) * (1.15 if narrow else 1.45) + (0.75 if narrow else 0.35)
    with style.new_figure(width_in, height) as figure:
        matrices = []
        panels = style.panels_in_rows(figure, len(templates), across, "column (sample)", "sensor")
        for axes, (size_mm, matrix), count in zip(panels, templates.items(), counts, strict=True):
            matrices.append((axes, matrix, np.arange(1, matrix.shape[1] + 1)))
            peak = f" (n = {count}, peak {words.number(float(np.max(matrix)))})"
            axes.set_title(words.size(size_mm) + (peak if size_mm else ""))
        place = {"location": "bottom", "aspect": 40} if narrow else {"aspect": 25, "pad": 0.01}
        _draw_matrices(matrices, place, with_faint=True)
    return figure
