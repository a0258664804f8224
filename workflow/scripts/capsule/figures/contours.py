"""A matrix of S sensors by L columns as filled contours, as the paper shows it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.ticker import MaxNLocator

from capsule.arrays import FloatArray, NumberArray
from capsule.figures.style import COLOURS_OF_HEIGHT, INK, say_nothing_to_show

# More columns than this are finer than print; contours of all of them make heavy files.
_COLUMNS_DRAWN = 250


def contour_levels(highest: float, count: int = 8, *, with_faint: bool = False) -> FloatArray:
    """Choose round heights from 0 up to at least the highest value.

    Parameters
    ----------
    highest : float
        Largest value to be shown; where it is 0, any heights do.
    count : int
        About how many bands.
    with_faint : bool
        Add a height at a fifth of the first step, so that a low pattern beside high ones shows.

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
    """Draw one matrix, sensor 1 on top; between the rows the heights are interpolated.

    Parameters
    ----------
    axes : Axes
        Where to draw.
    matrix : (S, L) array
        The heights; one that holds NaN is said to be unknown, one of zeros to be zero.
    column : (L,) array
        Position of each column along the axis of time.
    levels : (N,) array
        Heights of the contours, from `contour_levels`.

    Returns
    -------
    QuadContourSet or None
        For a colour bar; None where there was nothing to draw.
    """
    sensors = matrix.shape[0]
    # A single sensor becomes a band.
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
