"""Hold the design of all parts, from the phantom's dimensions and parts.yaml, and each part."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.errors import CapsuleError
from capsule.parts.cam import Cam
from capsule.parts.outlines import Solid
from capsule.parts.stand import Bench
from capsule.parts.substructure import Choices, Shape, loop_length, shape_of
from capsule.phantom.parameters import Phantom, built, value_of

CAPSULE, BENCH = "conductive TPU", "PLA"
# The part of the table with limits instead of choices.
LIMITS = "limits"


@dataclass(frozen=True)
class Printing:
    """The printer: nozzle, layer height, room, and largest overhang without support."""

    nozzle_mm: float
    layer_mm: float
    bed_x_mm: float
    bed_y_mm: float
    bed_z_mm: float
    overhang_deg: float


@dataclass(frozen=True)
class Material:
    """Densities of the plastics of capsule and bench."""

    capsule_g_cm3: float
    bench_g_cm3: float


@dataclass(frozen=True)
class Coupon:
    """Test coupons: length of the bars, and their difference from the wall's thickness."""

    bar_mm: float
    thinner_mm: float


@dataclass(frozen=True)
class Parts:
    """The values of ``config/parts.yaml``, by part."""

    choice: Choices
    print: Printing
    material: Material
    coupon: Coupon
    bench: Bench


@dataclass(frozen=True)
class Design:
    """All values that determine the parts.

    Attributes
    ----------
    phantom
        Dimensions of the origami, of the gut and of the wave.
    parts
        The choices that the paper leaves open.
    resistivity_ohm_m
        Resistivity of the conductive plastic, computed so that the paper's substructure has the
        paper's resistance.
    limits
        Smallest and largest value of the phantom's dimensions, by ``part.parameter``.
    """

    phantom: Phantom
    parts: Parts
    resistivity_ohm_m: float
    limits: Mapping[str, tuple[float, float]]

    @property
    def shape(self) -> Shape:
        """The substructure at rest."""
        return shape_of(self.phantom.origami)

    @property
    def cam(self) -> Cam:
        """The cam that makes the phantom's wave."""
        wall = self.phantom.wall
        return Cam(self.parts.bench.cam_radius_mm, wall.amplitude_mm, wall.wavelength_mm)

    @property
    def front_mm(self) -> float:
        """Distance from a follower's shaft to its front at the silicone, in mm."""
        wall = self.phantom.wall
        to_baseline = (self.parts.bench.shaft_distance_mm - wall.lumen_mm) / 2
        return to_baseline - (wall.wall_mm + wall.sheet_mm)


def entries(table: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield name and entry of each choice, in the order of the table."""
    for part, rows in table.items():
        if part != LIMITS:
            yield from ((f"{part}.{key}", entry) for key, entry in rows.items())


def design_of(
    table: Mapping[str, Any],
    values: Mapping[str, str | float],
    phantom: Phantom,
    unchanged: Phantom,
) -> Design:
    """Return the design that a table and changed values describe.

    Parameters
    ----------
    table
        ``{part: {key: entry}}``, as in ``config/parts.yaml``. An entry has a ``value`` and either
        a ``range`` or a list ``allowed``; ``whole`` marks integers. ``limits`` holds the smallest
        and largest values of the phantom's dimensions.
    values
        Changed values by ``part.key``.
    phantom, unchanged
        The phantom with and without the user's changes. The unchanged phantom is the paper's
        capsule, whose resistance gives the plastic's resistivity.

    Raises
    ------
    CapsuleError
        If a value is outside its limits; the message names both.
    """
    chosen = {name: values.get(name, entry["value"]) for name, entry in entries(table)}
    for name, entry in entries(table):
        _check(name, chosen[name], entry)
    for name, (low, high) in table[LIMITS].items():
        _check(name, value_of(phantom, name), {"range": (low, high)})
    parts = built(Parts, chosen)
    return Design(phantom, parts, resistivity(unchanged, parts.choice), table[LIMITS])


def _check(name: str, value: float | str, entry: Mapping[str, Any]) -> None:
    if "allowed" in entry:
        if value not in entry["allowed"]:
            raise CapsuleError(f"{name} is {value}; allowed are {', '.join(entry['allowed'])}")
        return
    low, high = entry["range"]
    if isinstance(value, str) or not low <= value <= high:
        raise CapsuleError(f"{name} is {value}; allowed is {low:g} to {high:g}")
    if entry.get("whole") and value != round(value):
        raise CapsuleError(f"{name} is {value}; allowed are whole numbers")


def resistance(resistivity_ohm_m: float, phantom: Phantom, choices: Choices) -> float:
    """Return the resistance between the two wires of a substructure, in ohm.

    The wall acts as a wire of constant section along the hexagon; the awns carry no current. With
    one cut, the current takes the whole loop: ``rho L / A``. With both flats cut, it takes the two
    halves of the loop in parallel: ``rho L / (4 A)``.
    """
    origami = phantom.origami
    section_mm2 = origami.wall_thickness_mm * origami.height_mm
    length_mm = loop_length(shape_of(origami))
    whole = resistivity_ohm_m * 1e3 * length_mm / section_mm2
    return whole if choices.current == "loop" else whole / 4


def resistivity(phantom: Phantom, choices: Choices) -> float:
    """Return the resistivity in ohm metre for which a substructure has the phantom's resistance."""
    return phantom.sensor.resistance_ohm / resistance(1.0, phantom, choices)


@dataclass(frozen=True)
class Flat:
    """The outlines of a flat part to cut and to engrave."""

    cuts: Sequence[FloatArray]
    marks: Sequence[FloatArray] = ()


@dataclass(frozen=True)
class Part:
    """A part in its pose for printing.

    Attributes
    ----------
    name
        Name of the part and of its files.
    solid
        Its exact form.
    vertices, triangles
        The solid's mesh, as `capsule.parts.solids.mesh` makes it: shape (V, 3) in mm, and shape
        (T, 3), anticlockwise seen from outside.
    quantity, material, note
        Number of pieces for the whole experiment, material, and purpose in one sentence.
    limited_by
        Name of the value to change if the part does not fit the printer.
    flat
        Outlines, if the part can be cut from a sheet.
    sizes
        Dimensions for the list of parts, by name.
    """

    name: str
    solid: Solid
    vertices: FloatArray
    triangles: IntArray
    quantity: int
    material: str
    note: str
    limited_by: str
    flat: Flat | None = None
    sizes: dict[str, float] = field(default_factory=dict)

    @property
    def bodies(self) -> list[tuple[str, FloatArray, IntArray]]:
        """Name and mesh of each body; of several copies, the first is at the head."""
        count = len(self.solid.places_mm)
        if count == 1:
            return [(self.name, self.vertices, self.triangles)]
        triangles = np.split(self.triangles, count)[0]
        return [
            (f"{self.name} {number}", vertices, triangles)
            for number, vertices in enumerate(np.split(self.vertices, count), start=1)
        ]


def volume(part: Part) -> float:
    """Return the volume that a mesh encloses, in mm3 (by the divergence theorem)."""
    first, second, third = np.moveaxis(part.vertices[part.triangles], 1, 0)
    return float(np.einsum("ij,ij->i", first, np.cross(second, third)).sum() / 6)


def extent(part: Part) -> FloatArray:
    """Return the lengths of the box around a part, along x, y and z: shape (3,)."""
    lengths: FloatArray = np.ptp(part.vertices, axis=0)
    return lengths
