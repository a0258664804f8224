"""Hold the design of all parts, from the phantom's dimensions and parts.yaml, and each part."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.errors import CapsuleError
from capsule.parts.cam import Cam
from capsule.parts.outlines import Solid
from capsule.parts.solids import mesh
from capsule.parts.substructure import Choices, Shape, loop_length, shape_of
from capsule.phantom.parameters import (
    Phantom,
    built,
    check_allowed,
    nearest,
    number_of,
    parameter_names,
    parsed,
    value_of,
    with_values,
    words_of,
)
from capsule.phantom.quantities import Limits

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
class Bench:
    """Dimensions of the bench that the paper leaves open, as in config/parts.yaml."""

    length_mm: float
    follower_mm: float
    follower_gap_mm: float
    cam_radius_mm: float
    play_mm: float
    fit_mm: float
    bevel_deg: float
    frame_mm: float
    shaft_distance_mm: float
    rod_mm: float
    rod_flat_mm: float
    bearing_mm: float
    plate_mm: float
    slide_mm: float
    row_play_mm: float
    platform_width_mm: float
    platform_mm: float
    platform_top_mm: float
    cam_teeth: int
    motor_teeth: int
    drive_belt_mm: float

    @property
    def thickness_mm(self) -> float:
        """Thickness of a follower."""
        return self.follower_mm - self.follower_gap_mm

    @property
    def row_mm(self) -> float:
        """Distance between the end plates."""
        return self.length_mm + self.row_play_mm


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
    sensors
        Number of substructures of a capsule.
    """

    phantom: Phantom
    parts: Parts
    resistivity_ohm_m: float
    sensors: int

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
    table: Mapping[str, Any], changes: Iterable[str], unchanged: Phantom, sensors: int
) -> Design:
    """Return the design that a table and changes describe.

    Parameters
    ----------
    table
        ``{part: {key: entry}}``, as in ``config/parts.yaml``. An entry has a ``value`` and either
        a ``range`` or a list ``allowed``; ``whole`` marks integers. ``limits`` holds the smallest
        and largest values of the phantom's dimensions.
    changes
        Texts of the form ``part.key=value``, of the table or of the phantom; a value is a number
        or a word.
    unchanged
        The phantom without the changes. It is the paper's capsule, whose resistance gives the
        plastic's resistivity.
    sensors
        Number of substructures of a capsule.

    Raises
    ------
    CapsuleError
        If a name is unknown or a value is outside its limits; the message names both.
    """
    rows = dict(entries(table))
    chosen = {name: entry["value"] for name, entry in rows.items()}
    theirs = [*table[LIMITS], *filter(words_of, parameter_names())]
    phantom = unchanged
    for change in changes:
        name, _, text = change.partition("=")
        if name in rows:
            chosen[name] = text if "allowed" in rows[name] else number_of(change)
        elif name in theirs:
            phantom = with_values(phantom, dict([parsed(change)]))
        else:
            near = nearest(name, [*rows, *theirs])
            hint = f"did you mean {near}?" if near else "config/parts.yaml lists all"
            raise CapsuleError(f"the parts have no value {name}; {hint}")
    for name, entry in rows.items():
        words, whole = entry.get("allowed", ()), entry.get("whole", False)
        check_allowed(name, chosen[name], words, Limits(*entry.get("range", ())), whole=whole)
    for name, limits in table[LIMITS].items():
        check_allowed(name, value_of(phantom, name), (), Limits(*limits))
    parts = built(Parts, chosen)
    resistivity = unchanged.sensor.resistance_ohm / resistance(1.0, unchanged, parts.choice)
    return Design(phantom, parts, resistivity, sensors)


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


@dataclass(frozen=True)
class Part:
    """A part in its pose for printing.

    Attributes
    ----------
    name
        Name of the part and of its files.
    solid
        Its exact form.
    quantity, material, note
        Number of pieces for the whole experiment, material, and purpose in one sentence.
    limited_by
        Name of the value to change if the part does not fit the printer.
    cuts, marks
        Outlines to cut and to engrave, if the part can be cut from a sheet.
    sizes
        Dimensions for the list of parts, by name.
    """

    name: str
    solid: Solid
    quantity: int
    material: str
    note: str
    limited_by: str
    cuts: Sequence[FloatArray] = ()
    marks: Sequence[FloatArray] = ()
    sizes: dict[str, float] = field(default_factory=dict)

    @cached_property
    def bodies(self) -> list[tuple[str, FloatArray, IntArray]]:
        """Name, vertices and triangles of each copy, of which the first is at the head."""
        vertices, triangles = mesh(self.solid)
        places = self.solid.places_mm
        numbers = [f" {n}" for n in range(1, len(places) + 1)] if len(places) > 1 else [""]
        return [
            (self.name + number, vertices + np.array([place, 0.0, 0.0]), triangles)
            for number, place in zip(numbers, places, strict=True)
        ]

    @property
    def corners(self) -> FloatArray:
        """The corners of all triangles, anticlockwise seen from outside: shape (T, 3, 3)."""
        return np.vstack([vertices[triangles] for _, vertices, triangles in self.bodies])


def volume(part: Part) -> float:
    """Return the volume that a mesh encloses, in mm3 (by the divergence theorem)."""
    first, second, third = np.moveaxis(part.corners, 1, 0)
    return float(np.einsum("ij,ij->i", first, np.cross(second, third)).sum() / 6)


def extent(part: Part) -> FloatArray:
    """Return the lengths of the box around a part, along x, y and z: shape (3,)."""
    lengths: FloatArray = np.ptp(part.corners, axis=(0, 1))
    return lengths
