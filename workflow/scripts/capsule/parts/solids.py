"""Make meshes of solids, by manifold3d, whose solids are always manifold."""

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold

from capsule.arrays import FloatArray, IntArray
from capsule.parts.cam import Cam
from capsule.parts.outlines import Prism, Solid, circle, points, polygon, signed_area

# Vertices closer than this, in mm, are merged; it is a tenth of a printer's accuracy.
_FINEST_MM = 1e-3
# Steps along a spiral: within 0.01 mm of the exact cam.
_STEPS = 160


def section(outlines: Sequence[FloatArray]) -> CrossSection:
    """Return the area inside outlines; a clockwise outline is a hole."""
    return CrossSection([points(each) for each in outlines], FillRule.Positive)


def united(outlines: Sequence[FloatArray]) -> list[FloatArray]:
    """Return the outlines of a union of polygons; holes follow the outline around them."""
    made = []
    for area in section(outlines).decompose():
        around = [polygon(each) for each in area.to_polygons()]
        made += sorted(around, key=signed_area, reverse=True)
    return made


def prism(shape: Prism) -> Manifold:
    """Return a prism."""
    low, high = shape.low_mm, shape.high_mm
    solid = Manifold.extrude(section(shape.outlines), high - low)
    if shape.along == "x":
        # (a, b, c) -> (c, a, b)
        return solid.transform(((0.0, 0.0, 1.0, low), (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)))
    if shape.along == "y":
        # (a, b, c) -> (a, -c, b)
        return solid.transform(((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -1.0, high), (0.0, 1.0, 0.0, 0.0)))
    return solid.translate((0.0, 0.0, low))


def spiral(cam: Cam) -> Manifold:
    """Return a cam; its polygon has the area of its circle, so that the cam is not too thin."""
    thin = section([circle(cam.radius_mm)])
    radius_mm = cam.radius_mm**2 * np.sqrt(np.pi / thin.area())
    area = section([circle(radius_mm, (cam.eccentricity_mm, 0.0))])
    return Manifold.extrude(area, cam.lead_mm, _STEPS - 1, -360.0)


def one(solid: Solid) -> Manifold:
    """Return one copy of a solid, unshifted."""
    made = spiral(solid.body) if isinstance(solid.body, Cam) else prism(solid.body)
    for cut in solid.cuts:
        made = made - prism(cut)
    return made


def mesh(solid: Solid) -> tuple[FloatArray, IntArray]:
    """Return vertices, shape (V, 3), and triangles, shape (T, 3), of one unshifted copy."""
    made = one(solid).simplify(_FINEST_MM).to_mesh64()
    return np.asarray(made.vert_properties)[:, :3], np.asarray(made.tri_verts).astype(int)
