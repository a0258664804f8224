"""The design of all parts: the phantom's dimensions and what the paper leaves open."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, get_type_hints

from capsule.errors import CapsuleError
from capsule.geometry.cam import Cam
from capsule.geometry.open_choices import Choices
from capsule.geometry.stand import Bench, front
from capsule.geometry.substructure import Shape, loop_length, shape_of
from capsule.phantom.parameters import Phantom, value_of

# Parts of the table that hold no choice.
LIMITS = "limits"


@dataclass(frozen=True)
class Printing:
    """The printer: nozzle, height of a layer, room, and the overhang it needs no support for."""

    nozzle_mm: float
    layer_mm: float
    bed_x_mm: float
    bed_y_mm: float
    bed_z_mm: float
    overhang_deg: float


@dataclass(frozen=True)
class Material:
    """Densities of the capsule's and of the bench's plastic."""

    capsule_g_cm3: float
    bench_g_cm3: float


@dataclass(frozen=True)
class Coupon:
    """Test coupons: the bars' length, and by how much they differ from the wall."""

    bar_mm: float
    thinner_mm: float


@dataclass(frozen=True)
class Parts:
    """What ``config/parts.yaml`` holds, by part."""

    choice: Choices
    print: Printing
    material: Material
    coupon: Coupon
    bench: Bench


@dataclass(frozen=True)
class Design:
    """All that the parts are made from.

    Attributes
    ----------
    phantom
        Dimensions of the origami, of the gut and of the wave.
    parts
        What the paper leaves open.
    resistivity_ohm_m
        Of the conductive plastic: with it the paper's substructure has the paper's resistance.
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
        return shape_of(self.phantom.origami, self.parts.choice)

    @property
    def cam(self) -> Cam:
        """The cam that makes the phantom's wave."""
        wall = self.phantom.wall
        return Cam(self.parts.bench.cam_radius_mm, wall.amplitude_mm, wall.wavelength_mm)

    @property
    def front_mm(self) -> float:
        """How far a follower reaches from its shaft towards the gut."""
        wall = self.phantom.wall
        return front(self.parts.bench, wall.lumen_mm, wall.wall_mm + wall.sheet_mm)


def entries(table: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Return each choice's name and entry, in the order of the table."""
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
        ``{part: {key: entry}}``, as in ``config/parts.yaml``: an entry has a ``value`` and a
        ``range`` or what is ``allowed``, and may say that it is ``whole``. Under ``limits`` stand
        the smallest and largest value of what is the phantom's.
    values
        Changed values by ``part.key``.
    phantom, unchanged
        The phantom with the user's changes, and without: the latter is the paper's capsule, by
        whose resistance the plastic is known.

    Raises
    ------
    CapsuleError
        A value is outside its limits; the text names both.
    """
    chosen = {name: values.get(name, entry["value"]) for name, entry in entries(table)}
    for name, entry in entries(table):
        _check(name, chosen[name], entry)
    for name, (low, high) in table[LIMITS].items():
        _check(name, value_of(phantom, name), {"range": (low, high)})
    kinds = get_type_hints(Parts)
    parts = Parts(
        **{
            part: kind(**{item.name: chosen[f"{part}.{item.name}"] for item in fields(kind)})
            for part, kind in kinds.items()
        }
    )
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

    The wall is a wire of constant section along the hexagon; the awns carry no current. At one cut
    the wires measure the whole loop, ``rho L / A``; with both flats cut the two halves of the loop
    lie beside each other, ``rho L / (4 A)``.
    """
    origami = phantom.origami
    section_mm2 = origami.wall_thickness_mm * origami.height_mm
    length_mm = loop_length(shape_of(origami, choices))
    whole = resistivity_ohm_m * 1e3 * length_mm / section_mm2
    return whole if choices.current == "loop" else whole / 4


def resistivity(phantom: Phantom, choices: Choices) -> float:
    """Return the resistivity that gives a substructure the phantom's resistance, in ohm metre."""
    return phantom.sensor.resistance_ohm / resistance(1.0, phantom, choices)
