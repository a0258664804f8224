"""Place the cut and the two wires of a substructure."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.geometry.open_choices import Choices
from capsule.geometry.substructure import Shape, glue_faces


def cut_lines(shape: Shape, choices: Choices) -> list[FloatArray]:
    """Return the cuts along the axis through the flats, each of shape (2, 2), in mm."""
    faces = glue_faces(shape)
    inward = {"head": -shape.wall_mm, "tail": shape.wall_mm}
    cut = ("tail", "head") if choices.current == "halves" else (choices.cut,)
    return [
        np.array([[faces[flat][0, 0], 0.0], [faces[flat][0, 0] + inward[flat], 0.0]])
        for flat in cut
    ]


def wire_positions(shape: Shape, choices: Choices, beside_mm: float = 1.0) -> FloatArray:
    """Return the points at which the two wires enter the wall: shape (2, 2), in mm.

    With one cut, the wires are above and below it, and the current takes the whole loop. With both
    flats cut, one wire is in each cut, and the current takes the two halves in parallel.
    """
    middles = [line.mean(axis=0) for line in cut_lines(shape, choices)]
    if choices.current == "halves":
        return np.array(middles)
    positions: FloatArray = middles[0] + beside_mm * np.array([[0.0, 1.0], [0.0, -1.0]])
    return positions
