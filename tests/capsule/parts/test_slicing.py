"""PrusaSlicer prints the parts as intended, and finds no fault in the meshes."""

from itertools import product

import numpy as np
import pytest

from capsule.parts.files import read_design
from support.command import output_of
from support.marks import needs_programs

pytestmark = [pytest.mark.slicer, needs_programs("prusa-slicer", packages="prusa-slicer")]
CENTRE = 125 + 105j


def lines_by_layer(gcode):
    """Return start, end (x + iy from the middle) and width of the printed lines of each layer."""
    layers, width, at = [], 0.0, 0j
    for line in gcode.splitlines():
        if line.startswith(";LAYER_CHANGE"):
            layers.append([])
        elif line.startswith(";WIDTH:"):
            width = float(line.partition(":")[2])
        elif line.startswith("G1 "):
            words = {word[0]: float(word[1:]) for word in line.split()[1:] if word[0] in "XYE"}
            end = complex(words.get("X", at.real), words.get("Y", at.imag))
            if layers and words.get("E", 0.0) > 0 and {"X", "Y"} & words.keys():
                layers[-1].append([at - CENTRE, end - CENTRE, width])
            at = end
    return [np.array(layer) for layer in layers]


def test_each_layer_is_one_unbroken_line_along_every_straight_wall(made, tmp_path):
    command = ["prusa-slicer", "--load", made / "print-profile.ini", "--center", "125,105"]
    command += ["--export-gcode", "--output", output := tmp_path / "printed.gcode"]
    output_of(*command, made / "substructure.stl")
    layers = lines_by_layer(output.read_text(encoding="utf-8"))
    assert len(layers) == 25
    shape = read_design().shape
    # The slicer centres the box around the part, which reaches from -1.1742 to 6.2088 mm.
    middle = (-1.1742 + 6.2088) / 2
    corners = np.array([shape.fold, shape.shoulder, shape.lower]) @ [1, 1j] - middle
    # A, C, B, and back on the other side of the axis.
    around = [*corners, *corners.conj()[::-1]]
    for first, second in zip(around, around[1:] + around[:1], strict=True):
        normal = 1j * (second - first) / abs(second - first)
        for lines, point in product(layers, first + np.linspace(0.2, 0.8, 20) * (second - first)):
            # Distance from the point, along the normal, and width of the lines that cross it.
            start, end, width = ((lines - [point, point, 0]) / [normal, normal, 1]).T
            crosses = (start.imag <= 0) != (end.imag <= 0)
            start, way = start[crosses], (end - start)[crosses]
            distance = start.real - start.imag * way.real / way.imag
            near = np.abs(distance) < 0.45
            crossed = distance[near], width.real[crosses][near]
            np.testing.assert_allclose(crossed, [[0.0], [0.5]], atol=0.02)
