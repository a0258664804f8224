"""One part: its solid as a mesh, its outline where it is flat, and what is to be known of it."""

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
        Closed outlines of what is engraved and not cut.
    """

    cuts: Sequence[FloatArray]
    marks: Sequence[FloatArray] = ()


@dataclass(frozen=True)
class Spiral:
    """The true form of a cam's section, of which a mesh is a fine polygon.

    Attributes
    ----------
    cam
        Its circle, which turns once.
    bore
        The bore's outline, anticlockwise: shape (N, 2), in mm.
    """

    cam: Cam
    bore: FloatArray


@dataclass(frozen=True)
class Part:
    """A part in the pose in which it is printed.

    Attributes
    ----------
    name
        As its files are called.
    vertices, triangles
        The mesh: shape (V, 3) in mm, and (T, 3), seen anticlockwise from outside.
    quantity
        How many the whole experiment takes.
    material
        What it is printed from.
    note
        What it is for, in one sentence.
    limited_by
        The value that is to be changed if the part does not fit the printer.
    bodies
        How many separate bodies the mesh holds.
    flat
        Its outline, if it can be cut from a sheet.
    spiral
        Its true form, if it is not bounded by planes alone.
    sizes
        Dimensions to be listed, by name.
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
