"""Draw a matrix of S sensors by L columns as filled contours, as the paper does."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.ticker import MaxNLocator

from capsule.arrays import FloatArray, NumberArray
from capsule.figures.style import COLOURS_OF_HEIGHT, INK, say_nothing_to_show

# More columns than this add no visible detail, and their contours make large files.
_COLUMNS_DRAWN = 250


def contour_levels(highest: float, count: int = 8, *, with_faint: bool = False) -> FloatArray:
    """Return round heights from 0 to at least the highest value.

    Parameters
    ----------
    highest : float
        Largest value of the drawing; 0 is treated as 1.
    count : int
        Approximate number of bands.
    with_faint : bool
        Whether to add a height at a fifth of the first step, which shows low patterns.

    Returns
    -------
    (N,) array
        Ascending from 0, two or more.
    """
    ticks = MaxNLocator(count).tick_values(0.0, highest if highest > 0 else 1.0)
    levels: FloatArray = np.asarray(ticks)
    levels = levels[levels >= 0]
    return np.insert(levels, 1, levels[1] / 5) if with_faint else levels


def draw_matrix(
    axes: Axes, matrix: FloatArray, column: NumberArray, levels: FloatArray
) -> QuadContourSet | None:
    """Draw one matrix with sensor 1 on top; heights between the rows are interpolated.

    Parameters
    ----------
    axes : Axes
        The axes.
    matrix : (S, L) array
        The heights. With any NaN, or with zeros only, the axes show a note instead.
    column : (L,) array
        Position of each column along the axis of time.
    levels : (N,) array
        Heights of the contours, from `contour_levels`.

    Returns
    -------
    QuadContourSet or None
        For a colour bar; None if there are no contours.
    """
    sensors = matrix.shape[0]
    # Contours need two rows, so a single sensor becomes a band.
    row = np.arange(1, sensors + 1) if sensors > 1 else np.array([0.5, 1.5])
    heights = matrix if sensors > 1 else np.repeat(matrix, 2, axis=0)
    step = max(1, -(-column.size // _COLUMNS_DRAWN))
    axes.set(xlim=(column[0], column[-1]), ylim=(row[-1], row[0]))
    axes.set_yticks(np.arange(1, sensors + 1))
    if np.isnan(matrix).any():
        say_nothing_to_show(axes, "not known: no accepted recording")
        return None
    if not matrix.any():
        axes.text(0.5, 0.5, "zero everywhere", transform=axes.transAxes, ha="center", va="center")
        return None
    column, heights = column[::step], heights[:, ::step]
    filled = axes.contourf(column, row, heights, levels=levels, cmap=COLOURS_OF_HEIGHT)
    axes.contour(column, row, heights, levels=levels[1:], colors=INK, linewidths=0.4)
    return filled
