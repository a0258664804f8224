"""Check that a design can be made; an error names the value and its limit."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from capsule.arrays import FloatArray
from capsule.errors import CapsuleError
from capsule.parts.cam import steepest_overhang
from capsule.parts.design import Design
from capsule.parts.outlines import Prism, points, polygon, signed_area
from capsule.parts.solids import prism, section
from capsule.parts.stand import (
    belt_length,
    outer_radius,
    pitch_radius,
    slide_levels,
    slide_span,
    teeth_around,
    window,
)
from capsule.parts.substructure import (
    EYELET_AT_MM,
    EYELET_MM,
    face_to_face,
    folded,
    outline,
    top_mm,
)
from capsule.phantom.parameters import value_of

# Least wall around a bore or between two openings.
_LEFT_MM = 1.0
# Largest distance that `gap` finds.
_FAR_MM = 100.0


class Bound(NamedTuple):
    """The limits of one value, ``part.key``, and what they are good for."""

    name: str
    least: float
    most: float
    reason: str


def _at_least(name: str, least: float, reason: str) -> Bound:
    return Bound(name, float(least), math.inf, reason)


def _at_most(name: str, most: float, reason: str) -> Bound:
    return Bound(name, -math.inf, float(most), reason)


def check_design(design: Design) -> None:
    """Raise an error if a design's parts cannot be made, or do not fit each other.

    Raises
    ------
    CapsuleError
        If so; the message names the value and its limit, or the value to change.
    """
    _check(design, _substructure_bounds(design))
    angle = f"origami.fold_angle_deg is {design.phantom.origami.fold_angle_deg:g}"
    if _room_inside(design) < 0:
        raise CapsuleError(
            f"{angle}; the hexagon crosses itself; enlarge it or origami.fold_to_shoulder_mm, or "
            "reduce origami.wall_thickness_mm"
        )
    limit = design.phantom.contact.fold_limit_mm
    if not all(_stands_clear(design, squeeze) for squeeze in (0.0, limit)):
        raise CapsuleError(
            f"{angle}; tips and walls meet the neighbour when the capsule is pressed by up to "
            f"{limit:g} mm; enlarge it, or reduce origami.tip_radius_mm or contact.fold_limit_mm"
        )
    _check(design, _bench_bounds(design))


def _check(design: Design, bounds: Iterable[Bound]) -> None:
    """Raise an error for the first bound that a design does not keep."""
    for name, least, most, reason in bounds:
        value = _value_of(design, name)
        if least - 1e-9 <= value <= most + 1e-9:
            continue
        # Rounded to the allowed side, so that the limit in the message is allowed.
        limit = (
            f"at least {math.ceil(least * 1e3 - 1e-6) / 1e3:g}"
            if value < least
            else f"at most {math.floor(most * 1e3 + 1e-6) / 1e3:g}"
        )
        raise CapsuleError(f"{name} is {value:g}; it must be {limit}, so that {reason}")


def _value_of(design: Design, name: str) -> float:
    part, key = name.split(".")
    if hasattr(design.parts, part):
        return float(getattr(getattr(design.parts, part), key))
    return value_of(design.phantom, name)


def _substructure_bounds(design: Design) -> Iterator[Bound]:
    origami = design.phantom.origami
    nozzle, tilt = design.parts.print.nozzle_mm, origami.awn_tilt_deg
    wall, angle = origami.wall_thickness_mm, "origami.fold_angle_deg"
    thin = f"no wall is thinner than the nozzle (print.nozzle_mm = {nozzle:g})"
    yield _at_least("origami.wall_thickness_mm", nozzle, thin)
    if origami.fold_side == "head":
        yield _at_most(angle, 85 - tilt, "the wall AC meets the axis")
    else:
        yield _at_least(angle, tilt + 5, "the wall AC leans from the flat A")
    radius, room = "origami.tip_radius_mm", origami.shoulder_to_tip_mm - wall
    if origami.tip == "bulb":
        yield _at_most(radius, room / 2, "the bulb stands clear of the shoulder C")
        yield _at_least(radius, wall / 2, "the bulb is as wide as the wall")
    elif origami.tip == "curl":
        yield _at_most(radius, room, "the curl stands clear of the shoulder C")
        yield _at_least(radius, 1.5 * wall, "the wall can bend that closely")
    else:
        yield _at_least("origami.shoulder_to_tip_mm", 2 * wall, "there is an awn")
    shoulder = origami.axis_to_fold_mm + origami.fold_to_shoulder_mm
    yield _at_most("origami.lower_corner_mm", shoulder - 3 * wall, "B lies below C")
    if design.parts.choice.folding == "eyelets":
        least, reason = EYELET_AT_MM + EYELET_MM / 2 + wall, "the eyelets lie in the flats"
        yield _at_least("origami.axis_to_fold_mm", least, reason)
        yield _at_least("origami.lower_corner_mm", least, reason)
        yield _at_least("origami.height_mm", 2 * EYELET_MM, reason)


def _room_inside(design: Design) -> float:
    """Return the least room inside the hexagon, less a wall; negative if there is none."""
    shape = design.shape
    outer, inner = outline(shape)
    if crosses([outer, inner]):
        return -1.0
    heights = np.sort(np.unique(np.abs(inner[:, 1]).round(9)))
    flats = shape.side * (shape.fold[0] - shape.lower[0]) - 2 * shape.wall_mm
    return min(
        float(flats),
        float(heights[-1] - heights[-2]) - shape.wall_mm / 2,
        float(heights[0]) - shape.wall_mm / 2,
        signed_area(outer),
        -signed_area(inner),
    )


def _stands_clear(design: Design, squeeze_mm: float) -> bool:
    """Return whether substructures that are pressed by a compression do not meet."""
    try:
        shape = folded(design.shape, top_mm(design.shape) - squeeze_mm)
    except ValueError:
        return False
    # The lower half is the mirror image.
    outer = points(outline(shape)[0])
    upper = polygon(outer[outer[:, 1] > 0])
    pitch_mm = face_to_face(shape) + design.phantom.origami.adhesive_mm
    return gap(upper, upper - [pitch_mm, 0.0, 0.0]) > 0 and not crosses([upper])


def _bench_bounds(design: Design) -> Iterator[Bound]:
    bench, cam, wall = design.parts.bench, design.cam, design.phantom.wall
    printing = design.parts.print
    most = np.tan(np.radians(printing.overhang_deg)) * cam.lead_mm / (2 * np.pi)
    reason = f"the cam overhangs by {printing.overhang_deg:g} degrees at most"
    yield _at_most("wall.amplitude_mm", most, reason)
    reason = "the window touches the cam at its ridge alone"
    yield _at_least("bench.bevel_deg", steepest_overhang(cam), reason)
    reason = "a section of the cam shaft fits the printer"
    yield _at_most("wall.wavelength_mm", printing.bed_z_mm, reason)
    room = printing.bed_x_mm - 2 * bench.plate_mm - bench.row_play_mm
    longest = float(np.floor(room / cam.lead_mm) * cam.lead_mm)
    yield _at_most("bench.length_mm", longest, "platform and slides fit the printer")
    steps = {"wall.wavelength_mm": cam.lead_mm, "bench.follower_mm": bench.follower_mm}
    for name, size in steps.items():
        if abs(bench.length_mm / size - round(bench.length_mm / size)) > 1e-9:
            raise CapsuleError(
                f"bench.length_mm is {bench.length_mm:g}; it must be a multiple of {name} "
                f"({size:g}), at most {longest:g}"
            )
    least = 2 * printing.nozzle_mm + bench.follower_gap_mm
    yield _at_least("bench.follower_mm", least, "a follower is thicker than two nozzles")
    least = cam.eccentricity_mm + bench.rod_mm / 2 + bench.fit_mm + _LEFT_MM
    yield _at_least("bench.cam_radius_mm", least, "a wall is left between rod and flank")
    silicone = wall.wall_mm + wall.sheet_mm
    least = 2 * (window(bench, cam).face_mm + 2 * _LEFT_MM + silicone) + wall.lumen_mm
    reason = "a follower's frame closes in front of its window"
    yield _at_least("bench.shaft_distance_mm", least, reason)
    narrowest = wall.lumen_mm - 2 * wall.amplitude_mm - _LEFT_MM
    reason = "the walls do not touch the platform"
    yield _at_most("bench.platform_width_mm", narrowest, reason)
    yield from _end_plate_bounds(design)


def _end_plate_bounds(design: Design) -> Iterator[Bound]:
    bench, cam, printing = design.parts.bench, design.cam, design.parts.print
    low, high = slide_levels(bench, cam)
    aside = (bench.shaft_distance_mm - bench.platform_width_mm) / 2 - bench.play_mm
    most = 2 * (min(low - bench.play_mm, aside) - _LEFT_MM - bench.fit_mm)
    reason = "the end plate's openings stay apart"
    yield _at_most("bench.bearing_mm", most, reason)
    most = low - _LEFT_MM + bench.platform_top_mm - 2 * bench.play_mm
    yield _at_most("bench.platform_mm", most, reason)
    least = teeth_around(bench.rod_mm / 2 + bench.fit_mm + _LEFT_MM)
    yield _at_least("bench.cam_teeth", least, "a wall is left between rod and teeth")
    # The motor's body is above the upper slide, and the pulleys do not touch each other.
    clear = max(
        high + bench.plate_mm + 10.0,
        outer_radius(bench.cam_teeth) + outer_radius(bench.motor_teeth) + 2 * _LEFT_MM,
        abs(pitch_radius(bench.motor_teeth) - pitch_radius(bench.cam_teeth)) + _LEFT_MM,
    )
    shortest = belt_length(bench.motor_teeth, bench.cam_teeth, clear)
    yield _at_least("bench.drive_belt_mm", shortest, "the motor clears the slides")
    tallest = printing.bed_y_mm - high - 2 * bench.plate_mm - 24.0
    most = belt_length(bench.motor_teeth, bench.cam_teeth, max(tallest, clear))
    yield _at_most("bench.drive_belt_mm", most, "an end plate fits the printer")
    back = -slide_span(bench, cam, design.front_mm)[0]
    most = printing.bed_x_mm - 2 * (back + bench.plate_mm)
    yield _at_most("bench.shaft_distance_mm", most, "an end plate fits the printer")


def crosses(outlines: Sequence[FloatArray]) -> bool:
    """Return whether the outlines of an area cross themselves or each other."""
    polygons = [polygon(points(each)) for each in outlines]
    # Where outlines cross, some of the area counts twice, or with the wrong sign.
    signed = sum(signed_area(each) for each in polygons)
    return bool(abs(section(polygons).area() - signed) > 1e-6 * abs(signed))


def gap(first: FloatArray, second: FloatArray) -> float:
    """Return the distance between two outlines in mm, at most 100; 0 if they overlap."""
    one, other = (prism(Prism([each], 0.0, 1.0)) for each in (first, second))
    return float(one.min_gap(other, _FAR_MM))
