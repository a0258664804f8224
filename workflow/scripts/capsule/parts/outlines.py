"""Describe outlines of lines and arcs: their corners, points, areas and arcs.

An outline is an array of shape (N, 3), in mm: a row (x, y, bulge) for each corner. The bulge is
that of DXF, the tangent of a quarter of the angle that the arc to the next corner turns through: 0
for a line, 1 for half a circle, negative if the arc is clockwise. The outline closes itself.
Outlines around material are anticlockwise, and holes are clockwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from capsule.arrays import FloatArray
from capsule.parts.cam import Cam

# A polygon in place of an arc lies within this distance, in mm, and turns by at most this angle.
_SAGITTA_MM = 0.005
_STEP_RAD = np.radians(6.0)


@dataclass(frozen=True)
class Prism:
    """The prism of an area, from ``low_mm`` to ``high_mm`` along an axis, ``x``, ``y`` or ``z``.

    The area's coordinates are the two other axes in their order.
    """

    outlines: Sequence[FloatArray]
    low_mm: float
    high_mm: float
    along: str = "z"


@dataclass(frozen=True)
class Solid:
    """A body less all cuts; each of its copies is shifted along x.

    A cam stands on z = 0, and its circle turns clockwise.
    """

    body: Prism | Cam
    cuts: Sequence[Prism] = ()
    places_mm: Sequence[float] = (0.0,)


def polygon(corners: ArrayLike) -> FloatArray:
    """Return the outline of lines between corners of shape (N, 2)."""
    rows = np.asarray(corners, dtype=float)
    return np.column_stack([rows, np.zeros(len(rows))])


def rectangle(left: float, low: float, right: float, high: float) -> FloatArray:
    """Return a rectangle, anticlockwise."""
    return polygon([[left, low], [right, low], [right, high], [left, high]])


def circle(radius_mm: float, centre: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    """Return a circle of two arcs, anticlockwise."""
    x, y = centre
    return np.array([[x + radius_mm, y, 1.0], [x - radius_mm, y, 1.0]])


def slot(centre: tuple[float, float], width_mm: float, travel_mm: float) -> FloatArray:
    """Return an upright slot with round ends, anticlockwise."""
    half, travel = width_mm / 2, travel_mm / 2
    outline = polygon([[half, travel], [-half, travel], [-half, -travel], [half, -travel]])
    outline[[0, 2], 2] = 1.0
    outline[:, :2] += centre
    return outline


def arc(centre: FloatArray, radius_mm: float, start_rad: float, end_rad: float) -> FloatArray:
    """Return the two ends of an arc with its bulge, as rows of an outline: shape (2, 3)."""
    ends = np.array([start_rad, end_rad])
    bulges = np.array([np.tan((end_rad - start_rad) / 4), 0.0])
    return np.column_stack([centre[0] + radius_mm * np.cos(ends),
                            centre[1] + radius_mm * np.sin(ends), bulges])  # fmt: skip


def reverse(outline: FloatArray) -> FloatArray:
    """Return the outline in the opposite direction."""
    back = outline[::-1].copy()
    back[:, 2] = -np.roll(back[:, 2], -1)
    return back


def mirrored(half: FloatArray, about: str = "x") -> FloatArray:
    """Return rows of an outline, followed by their mirror image about the x or the y axis."""
    image = [1.0, -1.0, -1.0] if about == "x" else [-1.0, 1.0, -1.0]
    return np.vstack([half, reverse(half) * image])


def signed_area(outline: FloatArray) -> float:
    """Return the area of an outline in mm2; it is negative if the outline is clockwise."""
    x, y, bulge = outline.T
    lines = 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))
    curved = outline[:, 2] != 0
    turn = 4 * np.arctan(bulge[curved])
    return float(lines + 0.5 * radii(outline)[curved] ** 2 @ (turn - np.sin(turn)))


def radii(outline: FloatArray) -> FloatArray:
    """Return the radius of the arc after each corner, in mm; infinite for a line: shape (N,)."""
    chord = np.linalg.norm((np.roll(outline, -1, axis=0) - outline)[:, :2], axis=1)
    with np.errstate(divide="ignore"):
        radius: FloatArray = chord * (1 + outline[:, 2] ** 2) / (4 * np.abs(outline[:, 2]))
    return radius


def middles(outline: FloatArray) -> FloatArray:
    """Return the middle of the line or arc after each corner: shape (N, 2)."""
    start, end = outline[:, :2], np.roll(outline, -1, axis=0)[:, :2]
    # An anticlockwise arc lies to the right of its chord.
    aside = (end - start)[:, ::-1] * [1.0, -1.0]
    middle: FloatArray = (start + end) / 2 + outline[:, 2:] / 2 * aside
    return middle


def points(outline: FloatArray) -> FloatArray:
    """Return a polygon with its corners on the outline: shape (M, 2), in mm.

    Arcs have a corner where they are lowest, highest and outermost, so the polygon's box is that of
    the outline.
    """
    chains = []
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        chains.append(start[np.newaxis, :2])
        bulge, (wide, high) = start[2], (end - start)[:2]
        if bulge == 0:
            continue
        aside = (1 - bulge**2) / (4 * bulge) * np.array([-high, wide])
        centre = (start + end)[:2] / 2 + aside
        radius = np.linalg.norm(start[:2] - centre)
        first = np.arctan2(*(start[:2] - centre)[::-1])
        angles = _stops(first, first + 4 * np.arctan(bulge), float(radius))[1:-1]
        chains.append(centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]))
    return np.vstack(chains)


def _stops(start_rad: float, end_rad: float, radius_mm: float) -> FloatArray:
    """Return the angles of a polygon's corners on an arc, from its start to its end."""
    low, high = sorted((start_rad, end_rad))
    step = min(_STEP_RAD, 2 * np.arccos(max(1 - _SAGITTA_MM / radius_mm, 0.0)))
    quarter = np.pi / 2
    quarters = quarter * np.arange(np.ceil(low / quarter), np.floor(high / quarter) + 1)
    inner = quarters[(quarters > low + 1e-9) & (quarters < high - 1e-9)]
    stops = [low]
    for stop in (*inner, high):
        steps = int(np.ceil((stop - stops[-1]) / step - 1e-9))
        stops += np.linspace(stops[-1], stop, steps + 1)[1:].tolist()
    return np.array(stops if end_rad > start_rad else stops[::-1])
