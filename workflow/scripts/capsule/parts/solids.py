"""Make solids from outlines: prisms and twisted prisms.

The solids are those of manifold3d, so they are always manifold.
"""

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold

from capsule.arrays import FloatArray, IntArray

# Vertices closer than this, in mm, are merged; it is a tenth of a printer's accuracy.
_FINEST_MM = 1e-3


def section(outlines: Sequence[FloatArray]) -> CrossSection:
    """Return the area inside outlines; a clockwise outline is a hole."""
    return CrossSection(list(outlines), FillRule.Positive)


def prism(outlines: Sequence[FloatArray], height_mm: float, low_mm: float = 0.0) -> Manifold:
    """Return the prism above an area, from the height ``low_mm`` on."""
    return Manifold.extrude(section(outlines), height_mm).translate((0.0, 0.0, low_mm))


def twisted(
    outlines: Sequence[FloatArray], height_mm: float, twist_deg: float, steps: int
) -> Manifold:
    """Return the prism above an area, twisted about the origin."""
    return Manifold.extrude(section(outlines), height_mm, steps - 1, twist_deg)


def crossways(outlines: Sequence[FloatArray], length_mm: float, along: str) -> Manifold:
    """Return the prism of an area along x or y, centred on the origin.

    Along x, the area's coordinates are (y, z). Along y, they are (x, z).
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
