"""Draw pre-processing: signal, envelope and matrix of a run without and a run with a nodule."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule.evaluation.paper import Evaluation
from capsule.figures.contours import contour_levels, draw_matrix
from capsule.figures.inputs import Drawing, FigureInputs
from capsule.figures.style import (
    COLUMN_WIDTH_IN,
    INK,
    PAGE_WIDTH_IN,
    figure_style,
    say_nothing_to_show,
    sensor_line,
)
from capsule.preprocessing import PreprocessedRun


def typical_recording(energy: Mapping[str, float]) -> str | None:
    """Return the median recording, so that the figure does not show an unusually good one.

    Parameters
    ----------
    energy : mapping of str to float
        Each recording's distance to the zero template, by name.

    Returns
    -------
    str or None
        The lower median; of equal recordings the first by name; None if there is no recording.
    """
    ordered = sorted(energy, key=lambda name: (energy[name], name))
    return ordered[(len(ordered) - 1) // 2] if ordered else None


def typical_recordings(evaluation: Evaluation) -> list[tuple[str, str | None]]:
    """Return a typical run without a nodule, and a typical run over a nodule of the middle size.

    Returns
    -------
    list of (str, str or None)
        The panel's title, and the recording's name; None if there is no such recording.
    """
    nodules_mm = evaluation.sizes_mm()[1:]
    wanted = {"no nodule": 0.0, "nodule": None}
    if nodules_mm:
        middle_mm = nodules_mm[(len(nodules_mm) - 1) // 2]
        wanted = {"no nodule": 0.0, f"{middle_mm:g} mm nodule": middle_mm}
    rows = evaluation.predictions.drop_duplicates("recording").set_index("recording")
    distances = rows["rmse_0mm"]
    return [
        (title, typical_recording(distances[rows["size_mm"] == size_mm].to_dict()))
        for title, size_mm in wanted.items()
    ]


def example_table(examples: Sequence[PreprocessedRun | None]) -> pd.DataFrame:
    """Return the figure's data as a table, one row per sample."""
    columns = ["recording", "time_s"]
    frames = []
    for example in filter(None, examples):
        frame = pd.DataFrame({"recording": example.recording, "time_s": example.time_s})
        for name in ("values", "envelope", "matrix"):
            label = "reading" if name == "values" else name
            for sensor, row in enumerate(getattr(example, name), start=1):
                frame[f"{label}_{sensor}"] = row
        frames.append(frame)
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=columns)


def preprocessing_drawing(inputs: FigureInputs) -> Drawing:
    """Return the drawing of the stages of a typical run without and a typical run with a nodule."""
    typical = typical_recordings(inputs.evaluation)
    examples = [inputs.run(name, title) if name else None for title, name in typical]
    threshold = inputs.settings["preprocessing"]["threshold"]
    return (
        example_table(examples),
        lambda width_in: draw_preprocessing(examples, threshold, width_in),
    )


def draw_preprocessing(
    examples: Sequence[PreprocessedRun | None], threshold: float, width_in: float = PAGE_WIDTH_IN
) -> Figure:
    """Draw the stages of pre-processing (eq. normalization to eq. extended), one column per run.

    Parameters
    ----------
    examples : sequence of PreprocessedRun or None
        The runs, from left to right; None if the archive has no such run.
    threshold : float
        c, drawn over the envelopes, in standard deviations.
    width_in : float
        Width of the figure in inches.

    Returns
    -------
    Figure
    """
    known = [example for example in examples if example is not None]
    highest = max((float(np.max(example.matrix)) for example in known), default=0.0)
    tallest = max((float(np.nanmax(example.envelope)) for example in known), default=1.0)
    levels = contour_levels(highest)
    narrow = width_in <= COLUMN_WIDTH_IN
    with figure_style():
        figure = Figure(figsize=(width_in, 4.4 if narrow else 4.7), layout="constrained")
        grid = figure.subplots(3, len(examples), squeeze=False, height_ratios=[1.15, 1, 1])
        filled = None
        for column, example in enumerate(examples):
            signal, envelope, matrix = grid[:, column]
            letter = chr(ord("A") + column)
            if example is None:
                for axes in (signal, envelope, matrix):
                    say_nothing_to_show(axes, "no such recording")
                continue
            signal.set_title(f"({letter}) {example.title}" + ("" if narrow else ": readings"))
            _draw_signals(signal, example)
            _draw_envelopes(envelope, example, threshold, tallest)
            drawn = draw_matrix(matrix, example.matrix, example.time_s, levels)
            filled = drawn or filled
            matrix.set_xlabel("time (s)")
            if not narrow:
                envelope.set_title("RMS envelope and threshold")
                matrix.set_title("matrix")
        grid[0, 0].set_ylabel("readings")
        grid[1, 0].set_ylabel("envelope (SD)")
        grid[2, 0].set_ylabel("sensor")
        if filled is not None:
            bar = figure.colorbar(filled, ax=grid[2, :].tolist(), aspect=9, pad=0.01)
            bar.set_label("height (SD)")
            bar.outline.set_linewidth(0.4)
        _add_legend(figure, known, threshold)
    return figure


def _draw_signals(axes: Axes, example: PreprocessedRun) -> None:
    """Draw the readings of each sensor below the other, with one scale for all."""
    centred = example.values - np.nanmedian(example.values, axis=1, keepdims=True)
    distance = float(np.nanmax(centred) - np.nanmin(centred)) * 0.75
    sensors = len(centred)
    for sensor, row in enumerate(centred):
        line = {**sensor_line(sensor), "linestyle": "-", "linewidth": 0.6}
        axes.plot(example.time_s, row - sensor * distance, **line)
    axes.set_yticks([-sensor * distance for sensor in range(sensors)])
    axes.set_yticklabels([str(sensor + 1) for sensor in range(sensors)])
    axes.set_xlim(example.time_s[0], example.time_s[-1])
    axes.tick_params(labelbottom=False)


def _draw_envelopes(axes: Axes, example: PreprocessedRun, threshold: float, tallest: float) -> None:
    for sensor, row in enumerate(example.envelope):
        axes.plot(example.time_s, row, **sensor_line(sensor))
    axes.axhline(threshold, color=INK, linewidth=0.6, zorder=0)
    axes.set(xlim=(example.time_s[0], example.time_s[-1]), ylim=(0, 1.05 * tallest))
    axes.tick_params(labelbottom=False)


def _add_legend(figure: Figure, examples: Sequence[PreprocessedRun], threshold: float) -> None:
    if not examples:
        return
    sensors = len(examples[0].values)
    axes = figure.axes[0]
    for sensor in range(sensors):
        axes.plot([], [], label=f"sensor {sensor + 1}", **sensor_line(sensor))
    axes.plot([], [], color=INK, linewidth=0.6, label=f"threshold {threshold:g}")
    handles, labels = axes.get_legend_handles_labels()
    columns = 3 if figure.get_figwidth() <= COLUMN_WIDTH_IN else 8
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, handlelength=2.8)
