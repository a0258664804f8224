"""Solids from outlines: prisms, twisted prisms, what is joined to them and cut from them.

The only module that knows manifold3d, whose solids are manifold by construction.
"""

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold

from capsule.arrays import FloatArray, IntArray

# Vertices that differ by less, in mm, are one; a tenth of what a printer can place.
_FINEST_MM = 1e-3


def section(outlines: Sequence[FloatArray]) -> CrossSection:
    """Return the area within outlines; one that runs clockwise is a hole."""
    return CrossSection(list(outlines), FillRule.Positive)


def prism(outlines: Sequence[FloatArray], height_mm: float, low_mm: float = 0.0) -> Manifold:
    """Return the solid above an area, from ``low_mm`` on."""
    return Manifold.extrude(section(outlines), height_mm).translate((0.0, 0.0, low_mm))


def twisted(
    outlines: Sequence[FloatArray], height_mm: float, twist_deg: float, steps: int
) -> Manifold:
    """Return the solid above an area that turns about the origin on its way up."""
    return Manifold.extrude(section(outlines), height_mm, steps - 1, twist_deg)


def crossways(outlines: Sequence[FloatArray], length_mm: float, along: str) -> Manifold:
    """Return the solid along x or y above an area, half of it to either side.

    Along x the area's coordinates are (y, z), along y they are (x, z).
    """
    solid = Manifold.extrude(section(outlines), length_mm).translate((0.0, 0.0, -length_mm / 2))
    if along == "x":
        # (a, b, c) -> (c, a, b)
        return solid.transform(((0.0, 0.0, 1.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)))
    # (a, b, c) -> (a, -c, b)
    return solid.transform(((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -1.0, 0.0), (0.0, 1.0, 0.0, 0.0)))


def mesh(solid: Manifold) -> tuple[FloatArray, IntArray]:
    """Return a solid's vertices, shape (V, 3), and triangles, shape (T, 3)."""
    made = solid.simplify(_FINEST_MM).to_mesh64()
    return np.asarray(made.vert_properties)[:, :3].copy(), np.asarray(made.tri_verts).astype(int)
