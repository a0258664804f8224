"""Compute exact faces for CAD programs: plane faces of a mesh, and the smooth flank of a cam."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from capsule.arrays import FloatArray, IntArray
from capsule.geometry.cam import Cam

# Largest distance in mm of a neighbouring triangle in the same plane: a tenth of a nanometre.
_PLANE_MM = 1e-7
# Least cosine between the normals of one plane: about 8 degrees.
_SAME_SIDE = 0.99
# Number of cubic pieces around the circle and along the helix. A cubic deviates from a circle of
# radius R by R (2 pi / pieces)^4 / 384: less than 1e-4 mm for all allowed radii.
_PIECES = 32
DEGREE = 3


@dataclass(frozen=True)
class PlaneFace:
    """A plane face of a solid.

    Attributes
    ----------
    normal
        Outward unit vector, shape (3,).
    loops
        Indices of the vertices around each boundary: first the outline, then the holes. Seen from
        outside, the face is to the left of each boundary.
    """

    normal: FloatArray
    loops: list[IntArray]


def plane_faces(vertices: FloatArray, triangles: IntArray) -> list[PlaneFace]:
    """Return the plane faces of a closed mesh, each joined from triangles in one plane.

    Parameters
    ----------
    vertices, triangles
        The mesh, as in `capsule.parts.design.Part`; each edge belongs to two triangles.

    Returns
    -------
    list of PlaneFace
        In the order of their first triangles.
    """
    corners = vertices[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twin = _twins(triangles, len(vertices))
    face = _same_plane(vertices, triangles, area, twin)
    normal = np.zeros((face.max() + 1, 3))
    np.add.at(normal, face, area)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)

    outline: list[list[tuple[float, IntArray]]] = [[] for _ in normal]
    start = triangles.ravel()
    for loop in _boundaries(face, twin):
        of_face = face[loop[0] // 3]
        around = vertices[start[loop]]
        enclosed = np.cross(around, np.roll(around, -1, axis=0)).sum(axis=0) @ normal[of_face]
        outline[of_face].append((-enclosed, start[loop]))
    return [
        # Holes have the opposite direction, so only the outline encloses a positive area.
        PlaneFace(direction, [loop for _, loop in sorted(loops, key=lambda each: each[0])])
        for direction, loops in zip(normal, outline, strict=True)
    ]


def _twins(triangles: IntArray, vertices: int) -> IntArray:
    """Return each edge's twin in the next triangle; edge 3 t + k leaves corner k of triangle t."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    key = start * vertices + end
    order = np.argsort(key)
    return order[np.searchsorted(key, end * vertices + start, sorter=order)]


def _same_plane(
    vertices: FloatArray, triangles: IntArray, area: FloatArray, twin: IntArray
) -> IntArray:
    """Return the number of each triangle's face."""
    size = np.linalg.norm(area, axis=1)
    edge = np.arange(len(twin))
    # Of two neighbours, the larger triangle gives the more accurate plane.
    large, small = edge // 3, twin // 3
    apex = triangles[small, (twin + 2) % 3]
    wanted = size[large] >= size[small]
    large, small, apex, edge = large[wanted], small[wanted], apex[wanted], edge[wanted]
    normal = area[large] / size[large, np.newaxis]
    away = np.einsum("ij,ij->i", vertices[apex] - vertices[triangles.ravel()[edge]], normal)
    along = np.einsum("ij,ij->i", normal, area[small] / size[small, np.newaxis])
    joined = (np.abs(away) < _PLANE_MM) & (along > _SAME_SIDE)
    pairs = coo_array(
        (np.ones(joined.sum()), (large[joined], small[joined])), shape=(len(triangles),) * 2
    )
    _, label = connected_components(pairs, directed=False)
    # Number the faces by their first triangles.
    _, first, number = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[number]


def _boundaries(face: IntArray, twin: IntArray) -> list[IntArray]:
    """Return the boundaries of all faces, each as a loop of edges."""
    edge = np.arange(len(twin))
    following = edge - edge % 3 + (edge + 1) % 3
    inner = face[edge // 3] == face[twin // 3]
    after = following.copy()
    # Turn around a corner, through the face's own triangles, to the next edge of the boundary.
    while (through := inner[after]).any():
        after[through] = following[twin[after[through]]]
    loops: list[IntArray] = []
    unused = ~inner
    for first in np.flatnonzero(~inner):
        if not unused[first]:
            continue
        loop, at = [], first
        while unused[at]:
            unused[at] = False
            loop.append(at)
            at = after[at]
        loops.append(np.array(loop))
    return loops


def cam_surface(cam: Cam) -> tuple[FloatArray, IntArray]:
    """Return the flank of one turn of the cam, upright on z = 0, as a B-spline of degree 3.

    The circle moves without turning. So a point of the flank is a point of the circle plus a point
    of the helix, and the poles are such sums, too. From 0 to 1, u runs around the circle and v
    upwards.

    Returns
    -------
    knots, poles
        The knots of both u and v, shape (K,), with repeated end knots; the poles, shape (N, N, 3),
        in mm, with u along the first axis.
    """
    turn = np.linspace(0.0, 1.0, _PIECES + 1)
    angle = 2 * np.pi * turn
    still = np.zeros_like(turn)
    circle = cam.radius_mm * np.column_stack([np.cos(angle), np.sin(angle), still])
    # The circle's angle lags upwards, because the wave travels along the shaft.
    helix = cam.eccentricity_mm * np.column_stack([np.cos(angle), -np.sin(angle), still])
    helix[:, 2] = cam.lead_mm * turn
    ahead = np.array([0.0, 2 * np.pi * cam.radius_mm, 0.0])
    upwards = np.array([0.0, -2 * np.pi * cam.eccentricity_mm, cam.lead_mm])
    # Set the exact slope at both ends, so that the seam is as smooth as the rest.
    around = make_interp_spline(turn, circle, DEGREE, bc_type=([(1, ahead)], [(1, ahead)]))
    along = make_interp_spline(turn, helix, DEGREE, bc_type=([(1, upwards)], [(1, upwards)]))
    return around.t, around.c[:, np.newaxis] + along.c[np.newaxis]
