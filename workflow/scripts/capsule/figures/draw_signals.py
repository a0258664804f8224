"""Draw signals: the stages of pre-processing, the templates, and a recording as it is judged."""

from collections.abc import Mapping, Sequence
from functools import partial
from string import ascii_uppercase

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
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


def draw_matrix(
    axes: Axes, matrix: FloatArray, column: NumberArray, levels: FloatArray
) -> QuadContourSet | None:
    """Draw one matrix with sensor 1 on top; heights between the rows are interpolated.

    A matrix with any NaN, or with zeros only, has a note instead of contours, and returns None.
    """
    sensors = matrix.shape[0]
    # Contours need two rows, so a single sensor becomes a band.
    row = np.arange(1, sensors + 1) if sensors > 1 else np.array([0.5, 1.5])
    heights = matrix if sensors > 1 else np.repeat(matrix, 2, axis=0)
    step = max(1, -(-column.size // _COLUMNS_DRAWN))
    axes.set(xlim=(column[0], column[-1]), ylim=(row[-1], row[0]))
    axes.set_yticks(np.arange(1, sensors + 1))
    if np.isnan(matrix).any():
        style.say_nothing_to_show(axes, "not known: no accepted recording")
        return None
    if not matrix.any():
        axes.text(0.5, 0.5, "zero everywhere", transform=axes.transAxes, ha="center", va="center")
        return None
    column, heights = column[::step], heights[:, ::step]
    filled = axes.contourf(column, row, heights, levels=levels, cmap=style.COLOURS_OF_HEIGHT)
    axes.contour(column, row, heights, levels=levels[1:], colors=style.INK, linewidths=0.4)
    return filled


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
    levels = contour_levels(max((float(np.max(each.matrix)) for each in known), default=0.0))
    tallest = max((float(np.nanmax(each.envelope)) for each in known), default=1.0)
    narrow, filled = width_in <= style.COLUMN_WIDTH_IN, None
    with style.new_figure(width_in, 4.4 if narrow else 4.7) as figure:
        grid = figure.subplots(3, len(examples), squeeze=False, height_ratios=[1.15, 1, 1])
        for axes, label in zip(grid[:, 0], ("readings", "envelope (SD)", "sensor"), strict=True):
            axes.set_ylabel(label)
        for letter, example, column in zip(ascii_uppercase, examples, grid.T, strict=False):
            signal, envelope, matrix = column
            if example is None:
                for axes in column:
                    style.say_nothing_to_show(axes, "no such recording")
                continue
            signal.set_title(f"({letter}) {example.title}" + ("" if narrow else ": readings"))
            # The readings of each sensor stand below the other, with one scale for all.
            readings = example.values - np.nanmedian(example.values, axis=1, keepdims=True)
            distance = 0.75 * float(np.nanmax(readings) - np.nanmin(readings))
            for sensor, values in enumerate(readings):
                look, label = style.sensor_line(sensor), f"sensor {sensor + 1}"
                line = {"color": look["color"], "linewidth": 0.6}
                signal.plot(example.time_s, values - sensor * distance, **line)
                envelope.plot(example.time_s, example.envelope[sensor], label=label, **look)
            sensors = np.arange(len(readings))
            signal.set_yticks(-distance * sensors, (sensors + 1).astype(str))
            look = {"label": f"threshold {threshold:g}", "color": style.INK, "linewidth": 0.6}
            envelope.axhline(threshold, zorder=0, **look)
            envelope.set(ylim=(0, 1.05 * tallest))
            for axes in (signal, envelope):
                axes.set_xlim(example.time_s[0], example.time_s[-1])
                axes.tick_params(labelbottom=False)
            filled = draw_matrix(matrix, example.matrix, example.time_s, levels) or filled
            matrix.set_xlabel("time (s)")
            if not narrow:
                envelope.set_title("RMS envelope and threshold")
                matrix.set_title("matrix")
        _add_height_bar(figure, filled, grid[2, :].tolist(), {"aspect": 9, "pad": 0.01})
        style.add_legend(figure, grid[1, :].tolist(), 3 if narrow else 8, handlelength=2.8)
    return figure


def _add_height_bar(
    figure: Figure, filled: QuadContourSet | None, beside: Sequence[Axes], place: Look
) -> None:
    if filled is None:
        return
    bar = figure.colorbar(filled, ax=beside, **place)
    bar.set_label("height (SD)")
    bar.outline.set_linewidth(0.4)


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
        for number, (place, names) in enumerate(places_s.items()):
            look = style.DETECTOR_LOOKS[number % len(style.DETECTOR_LOOKS)]
            line: Look = {"color": look["color"], "linestyle": look["linestyle"], "linewidth": 1.2}
            label = f"place by {words.enumerate_words(names)}: {words.place(place, None)}"
            for axes in (signal, envelope, matrix):
                axes.axvline(place, label=label, **line)
        if passing_s:
            look = {"color": style.INK, "marker": "o", "markersize": 3.5, "linewidth": 0.9}
            for axes in (signal, matrix):
                axes.plot(passing_s, axes.get_yticks(), label="the diagonal", **look)
        low, high = signal.get_ylim()
        signal.set(title=run.title, ylim=(low, high + _HEADROOM * (high - low)))
        if marks := signal.get_legend_handles_labels()[0]:
            signal.legend(handles=marks, loc="upper right", ncols=len(marks), borderaxespad=0)
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
    highest = max(float(np.nanmax(matrix, initial=0.0)) for matrix in templates.values())
    levels = contour_levels(highest, with_faint=True)
    height = -(-len(templates) // across) * (1.15 if narrow else 1.45) + (0.75 if narrow else 0.35)
    with style.new_figure(width_in, height) as figure:
        panels = style.panels_in_rows(figure, len(templates), across, "column (sample)", "sensor")
        filled = None
        for axes, (size_mm, matrix), count in zip(panels, templates.items(), counts, strict=True):
            column = np.arange(1, matrix.shape[1] + 1)
            filled = draw_matrix(axes, matrix, column, levels) or filled
            peak = float(np.max(matrix))
            behind = f"mean of {count}, peak {peak:.2f}"
            if narrow or np.isnan(peak):
                behind = f"n = {count}"
            axes.set_title(f"{size_mm:g} mm ({behind})" if size_mm else "no nodule")
        place = {"location": "bottom", "aspect": 40} if narrow else {"aspect": 25, "pad": 0.01}
        _add_height_bar(figure, filled, list(figure.axes), place)
    return figure
