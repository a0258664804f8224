"""Check that a design can be made; an error names the value and its limit."""

import functools
import math
from collections.abc import Sequence

import numpy as np

from capsule.arrays import FloatArray
from capsule.errors import CapsuleError
from capsule.parts.bench_parts import (
    belt_length,
    outer_radius,
    pitch_radius,
    slide_levels,
    slide_span,
    teeth_around,
    window,
)
from capsule.parts.cam import steepest_overhang
from capsule.parts.design import Design
from capsule.parts.outlines import points, polygon, signed_area
from capsule.parts.solids import section
from capsule.parts.substructure import (
    EYELET_AT_MM,
    EYELET_MM,
    face_to_face,
    folded,
    outline,
    top_mm,
)

# Least wall around a bore or between two openings.
_LEFT_MM = 1.0


def check_design(design: Design) -> None:
    """Raise an error if a design's parts cannot be made, or do not fit each other.

    Raises
    ------
    CapsuleError
        If so; the message names the value and its limit, or the value to change.
    """
    _check_substructure(design)
    angle = f"origami.fold_angle_deg is {design.phantom.origami.fold_angle_deg:g}"
    if not _has_room_inside(design):
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
    _check_bench(design)
    _check_end_plate(design)


def _check(
    design: Design, name: str, so_that: str, least: float = -math.inf, most: float = math.inf
) -> None:
    """Raise an error if a value, ``part.key``, is outside its limits, which serve a purpose."""
    part, key = name.split(".")
    values = design.parts if hasattr(design.parts, part) else design.phantom
    value = float(getattr(getattr(values, part), key))
    if least - 1e-9 <= value <= most + 1e-9:
        return
    # Rounded to the allowed side, so that the limit in the message is allowed.
    limit = (
        f"at least {math.ceil(least * 1e3 - 1e-6) / 1e3:g}"
        if value < least
        else f"at most {math.floor(most * 1e3 + 1e-6) / 1e3:g}"
    )
    raise CapsuleError(f"{name} is {value:g}; it must be {limit}, so that {so_that}")


def _check_substructure(design: Design) -> None:
    origami, check = design.phantom.origami, functools.partial(_check, design)
    nozzle, tilt = design.parts.print.nozzle_mm, origami.awn_tilt_deg
    wall, angle = origami.wall_thickness_mm, "origami.fold_angle_deg"
    thin = f"no wall is thinner than the nozzle (print.nozzle_mm = {nozzle:g})"
    check("origami.wall_thickness_mm", thin, nozzle)
    if origami.fold_side == "head":
        check(angle, "the wall AC meets the axis", most=85 - tilt)
    else:
        check(angle, "the wall AC leans from the flat A", tilt + 5)
    radius, room = "origami.tip_radius_mm", origami.shoulder_to_tip_mm - wall
    if origami.tip == "bulb":
        check(radius, "the bulb stands clear of the shoulder C", most=room / 2)
        check(radius, "the bulb is as wide as the wall", wall / 2)
    elif origami.tip == "curl":
        check(radius, "the curl stands clear of the shoulder C", most=room)
        check(radius, "the wall can bend that closely", 1.5 * wall)
    else:
        check("origami.shoulder_to_tip_mm", "there is an awn", 2 * wall)
    shoulder = origami.axis_to_fold_mm + origami.fold_to_shoulder_mm
    check("origami.lower_corner_mm", "B lies below C", most=shoulder - 3 * wall)
    if design.parts.choice.folding == "eyelets":
        least, reason = EYELET_AT_MM + EYELET_MM / 2 + wall, "the eyelets lie in the flats"
        check("origami.axis_to_fold_mm", reason, least)
        check("origami.lower_corner_mm", reason, least)
        check("origami.height_mm", reason, 2 * EYELET_MM)


def _has_room_inside(design: Design) -> bool:
    """Return whether the hexagon is an area with room for half a wall or more inside."""
    shape, (outer, inner) = design.shape, outline(design.shape)
    heights = np.unique(np.abs(inner[:, 1]).round(9))
    flats = shape.side * (shape.fold[0] - shape.lower[0]) - 2 * shape.wall_mm
    narrowest = min(heights[-1] - heights[-2], heights[0]) - shape.wall_mm / 2
    areas = signed_area(outer), -signed_area(inner)
    return not crosses([outer, inner]) and min(flats, narrowest, *areas) >= 0


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
    shared = section([upper]) ^ section([upper - [pitch_mm, 0.0, 0.0]])
    return shared.is_empty() and not crosses([upper])


def _check_bench(design: Design) -> None:
    bench, cam, wall = design.parts.bench, design.cam, design.phantom.wall
    printing, check = design.parts.print, functools.partial(_check, design)
    steepest = np.tan(np.radians(printing.overhang_deg)) * cam.lead_mm / (2 * np.pi)
    reason = f"the cam overhangs by {printing.overhang_deg:g} degrees at most"
    check("wall.amplitude_mm", reason, most=steepest)
    reason = "the window touches the cam at its ridge alone"
    check("bench.bevel_deg", reason, steepest_overhang(cam))
    reason = "a section of the cam shaft fits the printer"
    check("wall.wavelength_mm", reason, most=printing.bed_z_mm)
    room = printing.bed_x_mm - 2 * bench.plate_mm - bench.row_play_mm
    longest = float(np.floor(room / cam.lead_mm) * cam.lead_mm)
    check("bench.length_mm", "platform and slides fit the printer", most=longest)
    steps = {"wall.wavelength_mm": cam.lead_mm, "bench.follower_mm": bench.follower_mm}
    for name, size in steps.items():
        if abs(bench.length_mm / size - round(bench.length_mm / size)) > 1e-9:
            raise CapsuleError(
                f"bench.length_mm is {bench.length_mm:g}; it must be a multiple of {name} "
                f"({size:g}), at most {longest:g}"
            )
    thinnest = 2 * printing.nozzle_mm + bench.follower_gap_mm
    check("bench.follower_mm", "a follower is thicker than two nozzles", thinnest)
    smallest = cam.eccentricity_mm + bench.rod_mm / 2 + bench.fit_mm + _LEFT_MM
    check("bench.cam_radius_mm", "a wall is left between rod and flank", smallest)
    silicone = wall.wall_mm + wall.sheet_mm
    nearest = 2 * (window(design).face_mm + 2 * _LEFT_MM + silicone) + wall.lumen_mm
    reason = "a follower's frame closes in front of its window"
    check("bench.shaft_distance_mm", reason, nearest)
    narrowest = wall.lumen_mm - 2 * wall.amplitude_mm - _LEFT_MM
    check("bench.platform_width_mm", "the walls do not touch the platform", most=narrowest)


def _check_end_plate(design: Design) -> None:
    bench, printing = design.parts.bench, design.parts.print
    check, (low, high) = functools.partial(_check, design), slide_levels(design)
    aside = (bench.shaft_distance_mm - bench.platform_width_mm) / 2 - bench.play_mm
    reason = "the end plate's openings stay apart"
    widest = 2 * (min(low - bench.play_mm, aside) - _LEFT_MM - bench.fit_mm)
    check("bench.bearing_mm", reason, most=widest)
    thickest = low - _LEFT_MM + bench.platform_top_mm - 2 * bench.play_mm
    check("bench.platform_mm", reason, most=thickest)
    fewest = teeth_around(bench.rod_mm / 2 + bench.fit_mm + _LEFT_MM)
    check("bench.cam_teeth", "a wall is left between rod and teeth", fewest)
    # The motor's body is above the upper slide, and the pulleys do not touch each other.
    clear = max(
        high + bench.plate_mm + 10.0,
        outer_radius(bench.cam_teeth) + outer_radius(bench.motor_teeth) + 2 * _LEFT_MM,
        abs(pitch_radius(bench.motor_teeth) - pitch_radius(bench.cam_teeth)) + _LEFT_MM,
    )
    shortest = belt_length(bench.motor_teeth, bench.cam_teeth, clear)
    check("bench.drive_belt_mm", "the motor clears the slides", shortest)
    tallest = printing.bed_y_mm - high - 2 * bench.plate_mm - 24.0
    longest = belt_length(bench.motor_teeth, bench.cam_teeth, max(tallest, clear))
    reason = "an end plate fits the printer"
    check("bench.drive_belt_mm", reason, most=longest)
    widest = printing.bed_x_mm - 2 * (bench.plate_mm - slide_span(design)[0])
    check("bench.shaft_distance_mm", reason, most=widest)


def crosses(outlines: Sequence[FloatArray]) -> bool:
    """Return whether the outlines of an area cross themselves or each other."""
    polygons = [polygon(points(each)) for each in outlines]
    # Where outlines cross, some of the area counts twice, or with the wrong sign.
    signed = sum(signed_area(each) for each in polygons)
    return bool(abs(section(polygons).area() - signed) > 1e-6 * abs(signed))
