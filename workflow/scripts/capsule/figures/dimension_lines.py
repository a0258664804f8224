"""Draw dimensions: lines with arrows, angles, and labels with a leader line."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from capsule.arrays import FloatArray
from capsule.figures.style import INK, MUTED
from capsule.kinds import Look

_END = {"mutation_scale": 5.0, "linewidth": 0.5, "color": INK, "shrinkA": 0, "shrinkB": 0}
_ARROW = {"arrowstyle": "<|-|>"} | _END
_THIN: Look = {"color": MUTED, "linewidth": 0.4, "solid_capstyle": "butt"}


def length_text(value_mm: float) -> str:
    """Return a length as drawings print it: to 0.01 mm, without trailing zeros."""
    return f"{value_mm:.2f}".rstrip("0").rstrip(".").replace("-", "\u2212")


def draw_length(
    axes: Axes,
    start: FloatArray,
    end: FloatArray,
    at: float,
    *,
    upright: bool,
    name: str = "",
    outside: bool = False,
    part: float = 1.0,
) -> None:
    """Draw the dimension of the distance between two points along one axis.

    Parameters
    ----------
    start, end
        The points, shape (2,), in mm.
    at
        Position of the dimension's line: its x if upright, else its y.
    upright
        Whether the distance is measured along y.
    name
        Symbol before the number.
    outside
        Whether the number is beyond the end, for lengths without room for it.
    part
        Magnification of this part of the drawing.
    """
    along, across = (1, 0) if upright else (0, 1)
    low, high = sorted((float(start[along]), float(end[along])))

    def point(value: float, beside: float) -> tuple[float, float]:
        return (beside, value) if upright else (value, beside)

    for corner in (start, end):
        line = np.array([point(float(corner[along]), each) for each in (float(corner[across]), at)])
        axes.plot(*line.T, **_THIN)
    length = length_text((high - low) / part)
    text = f"{name} = {length}" if name else length
    turned = 90 if upright else 0
    if outside:
        # Arrows point inwards from both sides; the number follows the second arrow.
        reach = 0.9
        for tip, tail in ((low, low - reach), (high, high + reach)):
            arrow = {"arrowstyle": "-|>"} | _END
            axes.annotate("", point(tip, at), point(tail, at), arrowprops=arrow)
        ha, va = ("center", "bottom") if upright else ("left", "center")
        axes.text(*point(high + reach, at), f" {text}", ha=ha, va=va, rotation=turned)
        return
    axes.annotate("", point(low, at), point(high, at), arrowprops=_ARROW)
    axes.text(
        *point((low + high) / 2, at),
        text,
        ha="center",
        va="center",
        rotation=turned,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
    )


def draw_angle(
    axes: Axes,
    corner: FloatArray,
    radius_mm: float,
    start_deg: float,
    end_deg: float,
    text: str,
    *,
    shift: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Draw an angle as an arc with its text."""
    angles = np.radians(np.linspace(start_deg, end_deg, 40))
    arc = corner + radius_mm * np.column_stack([np.cos(angles), np.sin(angles)])
    axes.plot(*arc.T, color=INK, linewidth=0.5)
    middle = np.radians((start_deg + end_deg) / 2)
    x, y = corner + (radius_mm + 0.9) * np.array([np.cos(middle), np.sin(middle)]) + shift
    axes.text(x, y, text, ha="center", va="center")


def draw_label(
    axes: Axes,
    point: FloatArray,
    where: tuple[float, float],
    text: str,
    **look: Any,  # noqa: ANN401
) -> None:
    """Draw a label with a leader line to its point."""
    leader = {"arrowstyle": "-", "linewidth": 0.5, "color": MUTED, "shrinkA": 0, "shrinkB": 0}
    tip = float(point[0]), float(point[1])
    axes.annotate(text, tip, where, arrowprops=leader, va="center", **look)


def draw_area(axes: Axes, outline: FloatArray, colour: str, **look: Any) -> None:  # noqa: ANN401
    """Fill an outline."""
    style = {"facecolor": colour, "edgecolor": INK, "linewidth": 0.6} | look
    axes.add_patch(Polygon(outline, closed=True, **style))


def true_scale(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    """Limit the axes to the ranges x and y, with equal scales and without axis lines."""
    axes.set(xlim=x, ylim=y, aspect="equal")
    axes.set_axis_off()
