"""Dimensions on a drawing: lines with arrows, angles, and labels with a leader."""

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
    """Return a length as drawings print it: to a hundredth, without idle zeros."""
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
    """Draw the length between two points along one axis.

    Parameters
    ----------
    start, end
        The points, shape (2,), in mm.
    at
        Where the dimension's line runs: its x if upright, else its y.
    upright
        Whether the length is that along y.
    name
        A symbol before the number.
    outside
        Whether the number stands beyond the end, for lengths that have no room for it.
    part
        How many times larger than the rest of the drawing this part of it is.
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
        # Arrows from both sides, and the number beyond the second.
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
    """Draw an angle as an arc with its number."""
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
    """Write a label beside the drawing, with a line that leads to its point."""
    leader = {"arrowstyle": "-", "linewidth": 0.5, "color": MUTED, "shrinkA": 0, "shrinkB": 0}
    tip = float(point[0]), float(point[1])
    axes.annotate(text, tip, where, arrowprops=leader, va="center", **look)


def draw_area(axes: Axes, outline: FloatArray, colour: str, **look: Any) -> None:  # noqa: ANN401
    """Fill an outline."""
    style = {"facecolor": colour, "edgecolor": INK, "linewidth": 0.6} | look
    axes.add_patch(Polygon(outline, closed=True, **style))


def true_scale(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    """Show nothing but the drawing from x to x and y to y, with equal scales."""
    axes.set(xlim=x, ylim=y, aspect="equal")
    axes.set_axis_off()
