"""Represent one part to print or cut: its mesh, its outline if it is flat, and its data."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.geometry.cam import Cam

CAPSULE, BENCH = "conductive TPU", "PLA"


@dataclass(frozen=True)
class Flat:
    """The outline of a flat part, for a cutter.

    Attributes
    ----------
    cuts
        Closed outlines, each of shape (N, 2), in mm.
    marks
        Closed outlines to engrave instead of cutting them.
    """

    cuts: Sequence[FloatArray]
    marks: Sequence[FloatArray] = ()


@dataclass(frozen=True)
class Spiral:
    """The exact form of a cam shaft's section, which the mesh approximates.

    Attributes
    ----------
    cam
        The cam, whose circle turns once.
    bore
        The bore's outline, anticlockwise: shape (N, 2), in mm.
    """

    cam: Cam
    bore: FloatArray


@dataclass(frozen=True)
class Part:
    """A part in its pose for printing.

    Attributes
    ----------
    name
        Name of the part and of its files.
    vertices, triangles
        The mesh: shape (V, 3) in mm, and shape (T, 3), anticlockwise seen from outside.
    quantity
        Number of pieces for the whole experiment.
    material
        Material to print with.
    note
        Purpose, in one sentence.
    limited_by
        Name of the value to change if the part does not fit the printer.
    bodies
        Number of separate bodies in the mesh.
    flat
        Outline, if the part can be cut from a sheet.
    spiral
        Exact form, if not all faces are plane.
    sizes
        Dimensions for the list of parts, by name.
    """

    name: str
    vertices: FloatArray
    triangles: IntArray
    quantity: int
    material: str
    note: str
    limited_by: str
    bodies: int = 1
    flat: Flat | None = None
    spiral: Spiral | None = None
    sizes: dict[str, float] = field(default_factory=dict)


def volume(part: Part) -> float:
    """Return the volume that a mesh encloses, in mm3 (by the divergence theorem)."""
    first, second, third = np.moveaxis(part.vertices[part.triangles], 1, 0)
    return float(np.einsum("ij,ij->i", first, np.cross(second, third)).sum() / 6)


def extent(part: Part) -> FloatArray:
    """Return the lengths of the box around a part, along x, y and z: shape (3,)."""
    lengths: FloatArray = np.ptp(part.vertices, axis=0)
    return lengths
