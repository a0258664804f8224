"""The figure of the confusion matrix: true size by predicted size."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule.figures.inputs import Drawing, FigureInputs
from capsule.figures.style import (
    COLOURS_OF_HEIGHT,
    COLUMN_WIDTH_IN,
    INK,
    PAGE_WIDTH_IN,
    figure_style,
)

_TITLES = {"leave_one_out": "leave-one-out (the result)", "resubstitution": "resubstitution"}


def count_matrix(confusion: pd.DataFrame, scheme: str, sizes_mm: Sequence[float]) -> np.ndarray:
    """Arrange the counts of one scheme, true sizes down, predicted sizes across.

    Returns
    -------
    (B, B) array of int
    """
    rows = confusion[confusion["scheme"] == scheme]
    table = rows.pivot(index="size_mm", columns="predicted_mm", values="count")
    return table.reindex(index=sizes_mm, columns=sizes_mm, fill_value=0).to_numpy(dtype=np.int64)


def confusion_drawing(inputs: FigureInputs) -> Drawing:
    """Give the counts of the first detector, by true and predicted size."""
    evaluation, schemes = inputs.evaluation, inputs.settings["evaluation"]["schemes"]
    counts = evaluation.of("confusion", evaluation.detectors()[0])
    return counts, lambda width_in: draw_confusion(counts, schemes, evaluation.sizes_mm(), width_in)


def draw_confusion(
    confusion: pd.DataFrame,
    schemes: Sequence[str],
    sizes_mm: Sequence[float],
    width_in: float = PAGE_WIDTH_IN,
) -> Figure:
    """Draw the counts, shaded by their share of the true size.

    Parameters
    ----------
    confusion : DataFrame
        Counts per scheme, true and predicted size.
    schemes : sequence of str
        The schemes to draw, a panel each.
    sizes_mm : sequence of B floats
        The sizes, 0 for no nodule.
    width_in : float
        Width of the figure in inches.

    Returns
    -------
    Figure
    """
    narrow = width_in <= COLUMN_WIDTH_IN
    shape = (len(schemes), 1) if narrow else (1, len(schemes))
    height = 0.85 * width_in * len(schemes) if narrow else width_in / max(len(schemes), 2) * 0.9
    with figure_style():
        figure = Figure(figsize=(width_in, height), layout="constrained")
        grid = figure.subplots(*shape, squeeze=False)
        for axes, scheme in zip(grid.flat, schemes, strict=True):
            _draw_counts(axes, count_matrix(confusion, scheme, sizes_mm), sizes_mm)
            axes.set_title(_TITLES[scheme])
            axes.set_xlabel("predicted size (mm)")
            axes.set_ylabel("true size (mm)")
    return figure


def _draw_counts(axes: Axes, counts: np.ndarray, sizes_mm: Sequence[float]) -> None:
    total = counts.sum(axis=1, keepdims=True)
    share = np.divide(counts, total, out=np.zeros(counts.shape), where=total > 0)
    # Cells as vector rectangles, not as an image.
    edges = np.arange(len(sizes_mm) + 1) - 0.5
    axes.pcolormesh(edges, edges, share, cmap=COLOURS_OF_HEIGHT, vmin=0, vmax=1, edgecolors="white")
    for (row, column), count in np.ndenumerate(counts):
        if count:
            colour = "white" if share[row, column] > 0.55 else INK
            weight = "bold" if row == column else "normal"
            axes.text(
                column, row, str(count), ha="center", va="center", color=colour, fontweight=weight
            )
    labels = ["none" if size_mm == 0 else f"{size_mm:g}" for size_mm in sizes_mm]
    axes.set_xticks(range(len(labels)), labels)
    axes.set_yticks(range(len(labels)), labels)
    axes.tick_params(length=0)
    axes.set_aspect("equal")
    axes.invert_yaxis()
    for spine in axes.spines.values():
        spine.set_visible(False)
