"""Draw the templates with contour lines."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from capsule.arrays import FloatArray
from capsule.figures.contours import contour_levels, draw_matrix
from capsule.figures.inputs import Drawing, FigureInputs
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, figure_style


def template_table(sizes_mm: Sequence[float], matrices: Sequence[FloatArray]) -> pd.DataFrame:
    """Return the templates as a table, one row per size and column of the matrix."""
    frames = []
    for size_mm, matrix in zip(sizes_mm, matrices, strict=True):
        frame = pd.DataFrame({"size_mm": size_mm, "column": np.arange(1, matrix.shape[1] + 1)})
        for sensor, row in enumerate(matrix, start=1):
            frame[f"sensor_{sensor}"] = row
        frames.append(frame)
    return pd.concat(frames, ignore_index=True)


def templates_drawing(inputs: FigureInputs) -> Drawing:
    """Return the drawing of the templates, each with the number of recordings that it averages."""
    sizes_mm, matrices = list(inputs.templates), list(inputs.templates.values())
    counts = inputs.template_counts
    return (
        template_table(sizes_mm, matrices),
        lambda width_in: draw_templates(sizes_mm, matrices, counts, width_in),
    )


def draw_templates(
    sizes_mm: Sequence[float],
    matrices: Sequence[FloatArray],
    counts: Sequence[int],
    width_in: float = PAGE_WIDTH_IN,
) -> Figure:
    """Draw every template T^b, with one scale for all.

    Parameters
    ----------
    sizes_mm : sequence of B floats
        The sizes, 0 for no nodule.
    matrices : sequence of B (S, L) arrays
        The templates; NaN for a size without an accepted recording.
    counts : sequence of B ints
        Q, the number of recordings that each template averages.
    width_in : float
        Width of the figure in inches.

    Returns
    -------
    Figure
    """
    narrow = width_in <= COLUMN_WIDTH_IN
    columns = min(len(sizes_mm), 2 if narrow else 3)
    rows = -(-len(sizes_mm) // columns)
    highest = max((float(np.max(m)) for m in matrices if not np.isnan(m).any()), default=0.0)
    levels = contour_levels(highest, with_faint=True)
    with figure_style():
        height = rows * (1.15 if narrow else 1.45) + (0.75 if narrow else 0.35)
        figure = Figure(figsize=(width_in, height), layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        filled = None
        for index, axes in enumerate(grid.flat):
            if index >= len(sizes_mm):
                axes.set_visible(False)
                continue
            matrix = matrices[index]
            column = np.arange(1, matrix.shape[1] + 1)
            filled = draw_matrix(axes, matrix, column, levels) or filled
            axes.set_title(_title(sizes_mm[index], counts[index], float(np.max(matrix)), narrow))
            if index + columns >= len(sizes_mm):
                axes.set_xlabel("column (sample)")
                axes.tick_params(labelbottom=True)
            if index % columns == 0:
                axes.set_ylabel("sensor")
        if filled is not None:
            place = {"location": "bottom", "aspect": 40} if narrow else {"aspect": 25, "pad": 0.01}
            bar = figure.colorbar(filled, ax=grid.ravel().tolist(), **place)
            bar.set_label("height (SD)")
            bar.outline.set_linewidth(0.4)
    return figure


def _title(size_mm: float, count: int, highest: float, narrow: bool) -> str:
    if size_mm == 0:
        return "no nodule"
    if narrow or np.isnan(highest):
        return f"{size_mm:g} mm (n = {count})"
    return f"{size_mm:g} mm (mean of {count}, peak {highest:.2f})"
