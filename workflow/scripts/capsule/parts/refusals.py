"""Check that a design can be made; an error names the value and its limit."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.errors import CapsuleError
from capsule.geometry.cam import steepest_overhang
from capsule.geometry.stand import (
    belt_length,
    outer_radius,
    pitch_radius,
    slide_levels,
    slide_span,
    teeth_around,
    window,
)
from capsule.geometry.substructure import (
    EYELET_AT_MM,
    EYELET_MM,
    Choices,
    Shape,
    folded,
    outline,
    shape_of,
    signed_area,
    spacing,
    top_mm,
)
from capsule.parts.design import Design
from capsule.phantom.parameters import Phantom, value_of, with_values

# Number of tried values, and number of bisections, in the search for a limit.
_TRIES, _HALVINGS = 41, 16
# Least wall around a bore or between two openings.
_LEFT_MM = 1.0

Margin = Callable[[Phantom, Choices], float]


def check_design(design: Design) -> None:
    """Raise an error if a design's parts cannot be made, or do not fit each other.

    Raises
    ------
    CapsuleError
        If so; the message names the value and its limit.
    """
    _check_substructure(design)
    _check_bench(design)


def _at_least(design: Design, name: str, limit: float, reason: str) -> None:
    """Raise an error if a value of the design, by its name, is below a limit."""
    if (value := _value_of(design, name)) < limit - 1e-9:
        # Rounded to the allowed side, so that the limit in the message is allowed.
        least = math.ceil(limit * 1e3 - 1e-6) / 1e3
        raise CapsuleError(f"{name} is {value:g}; it must be at least {least:g}, so that {reason}")


def _at_most(design: Design, name: str, limit: float, reason: str) -> None:
    """Raise an error if a value of the design, by its name, is above a limit."""
    if (value := _value_of(design, name)) > limit + 1e-9:
        most = math.floor(limit * 1e3 + 1e-6) / 1e3
        raise CapsuleError(f"{name} is {value:g}; it must be at most {most:g}, so that {reason}")


def _value_of(design: Design, name: str) -> float:
    part, key = name.split(".")
    if hasattr(design.parts, part):
        return float(getattr(getattr(design.parts, part), key))
    return value_of(design.phantom, name)


def _check_substructure(design: Design) -> None:
    origami, choices = design.phantom.origami, design.parts.choice
    _check_angles_and_tip(design)
    wall = origami.wall_thickness_mm
    shoulder = origami.axis_to_fold_mm + origami.fold_to_shoulder_mm
    _at_most(design, "choice.lower_corner_mm", shoulder - 3 * wall, "B lies below C")
    if choices.folding == "eyelets":
        least = EYELET_AT_MM + EYELET_MM / 2 + wall
        for name in ("origami.axis_to_fold_mm", "choice.lower_corner_mm"):
            _at_least(design, name, least, "the eyelets lie in the flats")
        _at_least(design, "origami.height_mm", 2 * EYELET_MM, "the eyelets lie in the flats")
    for names, margin, reason in _TRIALS:
        _check_by_trial(design, names, margin, reason)


def _check_angles_and_tip(design: Design) -> None:
    origami, choices = design.phantom.origami, design.parts.choice
    nozzle, tilt = design.parts.print.nozzle_mm, origami.awn_tilt_deg
    reason = f"no wall is thinner than the nozzle (print.nozzle_mm = {nozzle:g})"
    _at_least(design, "origami.wall_thickness_mm", nozzle, reason)
    if choices.fold_side == "head":
        _at_most(design, "origami.fold_angle_deg", 85 - tilt, "the wall AC meets the axis")
    else:
        reason = "the wall AC leans from the flat A"
        _at_least(design, "origami.fold_angle_deg", tilt + 5, reason)
    wall, name = origami.wall_thickness_mm, "origami.tip_radius_mm"
    room = origami.shoulder_to_tip_mm - wall
    if choices.tip == "bulb":
        _at_most(design, name, room / 2, "the bulb stands clear of the shoulder C")
        _at_least(design, name, wall / 2, "the bulb is as wide as the wall")
    elif choices.tip == "curl":
        _at_most(design, name, room, "the curl stands clear of the shoulder C")
        _at_least(design, name, 1.5 * wall, "the wall can bend that closely")
    else:
        _at_least(design, "origami.shoulder_to_tip_mm", 2 * wall, "there is an awn")


def _check_by_trial(design: Design, names: Sequence[str], margin: Margin, reason: str) -> None:
    """Raise an error if a margin is negative, with the limit of the first name that can help.

    The limit is found by trying other values of each name in turn.
    """
    choices = design.parts.choice
    if margin(design.phantom, choices) >= 0:
        return
    for name in names:
        value = value_of(design.phantom, name)

        def allowed(tried: float, name: str = name) -> bool:
            phantom = with_values(design.phantom, {name: float(tried)})
            return _is_simple(replace(design, phantom=phantom)) and margin(phantom, choices) >= 0

        tries = [each for each in np.linspace(*design.limits[name], _TRIES) if allowed(each)]
        if tries:
            good, bad = min(tries, key=lambda each: abs(each - value)), value
            for _ in range(_HALVINGS):
                middle = (good + bad) / 2
                good, bad = (middle, bad) if allowed(middle) else (good, middle)
            (_at_least if good > value else _at_most)(design, name, float(good), reason)
    low, high = design.limits[names[0]]
    raise CapsuleError(
        f"{names[0]} is {value_of(design.phantom, names[0]):g}; no value from {low:g} to "
        f"{high:g}, and no value of {', '.join(names[1:])}, is such that {reason}; change several "
        "of them together"
    )


def _is_simple(design: Design) -> bool:
    try:
        _check_angles_and_tip(design)
    except CapsuleError:
        return False
    return True


def _outline_of(phantom: Phantom, choices: Choices) -> tuple[Shape, FloatArray, FloatArray] | None:
    """Return shape and boundaries, or None if lines do not meet."""
    try:
        shape = shape_of(phantom.origami, choices)
        return (shape, *outline(shape))
    except np.linalg.LinAlgError:
        return None


def _room_inside(phantom: Phantom, choices: Choices) -> float:
    """Return the least room inside the hexagon, less a wall; negative if there is none."""
    made = _outline_of(phantom, choices)
    if made is None:
        return -1.0
    shape, outer, inner = made
    if crosses_itself(_upper(outer)) or crosses_itself(inner) or cross(outer, inner):
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


def _room_beside(phantom: Phantom, choices: Choices) -> float:
    """Return the distance to the neighbour, less half the film of adhesive."""
    made = _outline_of(phantom, choices)
    if made is None:
        return -1.0
    shape, outer, _ = made
    adhesive = phantom.origami.adhesive_mm
    return _room_to_next(outer, spacing(shape, adhesive)) - adhesive / 2


def _room_pressed(phantom: Phantom, choices: Choices) -> float:
    """Return the distance to the neighbour when both are pressed to the largest compression."""
    try:
        shape = shape_of(phantom.origami, choices)
        pressed = folded(shape, top_mm(shape) - phantom.contact.fold_limit_mm)
        outer, _ = outline(pressed)
    except (ValueError, np.linalg.LinAlgError):
        return -1.0
    if crosses_itself(_upper(outer)):
        return -1.0
    return _room_to_next(outer, spacing(pressed, phantom.origami.adhesive_mm))


def _room_to_next(outer: FloatArray, pitch_mm: float) -> float:
    """Return the distance to the neighbour's outline."""
    upper = _upper(outer)
    return gap(upper, upper - np.array([pitch_mm, 0.0]))


def _upper(outer: FloatArray) -> FloatArray:
    """Return the upper half of an outline; the lower half is its mirror image."""
    return outer[outer[:, 1] > 0]


# The names of the values that can help, the margin that must not be negative, and the reason.
_TRIALS: tuple[tuple[tuple[str, ...], Margin, str], ...] = (
    (
        ("origami.fold_angle_deg", "origami.fold_to_shoulder_mm", "origami.axis_to_fold_mm"),
        _room_inside,
        "the hexagon does not cross itself",
    ),
    (
        ("origami.tip_radius_mm", "origami.fold_angle_deg", "origami.awn_tilt_deg"),
        _room_beside,
        "tips and walls stay out of the neighbour",
    ),
    (
        ("origami.tip_radius_mm", "origami.fold_angle_deg", "contact.fold_limit_mm"),
        _room_pressed,
        "tips and walls stay out of the neighbour at the phantom's largest compression",
    ),
)


def _check_bench(design: Design) -> None:
    bench, cam, wall = design.parts.bench, design.cam, design.phantom.wall
    printing = design.parts.print
    most = np.tan(np.radians(printing.overhang_deg)) * cam.lead_mm / (2 * np.pi)
    reason = f"the cam overhangs by {printing.overhang_deg:g} degrees at most"
    _at_most(design, "wall.amplitude_mm", float(most), reason)
    reason = "the window touches the cam at its ridge alone"
    _at_least(design, "bench.bevel_deg", steepest_overhang(cam), reason)
    reason = "a section of the cam shaft fits the printer"
    _at_most(design, "wall.wavelength_mm", printing.bed_z_mm, reason)
    room = printing.bed_x_mm - 2 * bench.plate_mm - bench.row_play_mm
    longest = float(np.floor(room / cam.lead_mm) * cam.lead_mm)
    _at_most(design, "bench.length_mm", longest, "platform and slides fit the printer")
    steps = {"wall.wavelength_mm": cam.lead_mm, "bench.follower_mm": bench.follower_mm}
    for name, size in steps.items():
        if abs(bench.length_mm / size - round(bench.length_mm / size)) > 1e-9:
            raise CapsuleError(
                f"bench.length_mm is {bench.length_mm:g}; it must be a multiple of {name} "
                f"({size:g}), at most {longest:g}"
            )
    least = 2 * printing.nozzle_mm + bench.follower_gap_mm
    _at_least(design, "bench.follower_mm", least, "a follower is thicker than two nozzles")
    least = cam.eccentricity_mm + bench.rod_mm / 2 + bench.fit_mm + _LEFT_MM
    _at_least(design, "bench.cam_radius_mm", least, "a wall is left between rod and flank")
    silicone = wall.wall_mm + wall.sheet_mm
    least = 2 * (window(bench, cam).face_mm + 2 * _LEFT_MM + silicone) + wall.lumen_mm
    reason = "a follower's frame closes in front of its window"
    _at_least(design, "bench.shaft_distance_mm", least, reason)
    narrowest = wall.lumen_mm - 2 * wall.amplitude_mm - _LEFT_MM
    reason = "the walls do not touch the platform"
    _at_most(design, "bench.platform_width_mm", narrowest, reason)
    _check_end_plate(design)


def _check_end_plate(design: Design) -> None:
    bench, cam, printing = design.parts.bench, design.cam, design.parts.print
    low, high = slide_levels(bench, cam)
    aside = (bench.shaft_distance_mm - bench.platform_width_mm) / 2 - bench.play_mm
    most = 2 * (min(low - bench.play_mm, aside) - _LEFT_MM - bench.fit_mm)
    reason = "the end plate's openings stay apart"
    _at_most(design, "bench.bearing_mm", most, reason)
    most = low - _LEFT_MM + bench.platform_top_mm - 2 * bench.play_mm
    _at_most(design, "bench.platform_mm", most, reason)
    least: float = teeth_around(bench.rod_mm / 2 + bench.fit_mm + _LEFT_MM)
    _at_least(design, "bench.cam_teeth", least, "a wall is left between rod and teeth")
    # The motor's body is above the upper slide, and the pulleys do not touch each other.
    clear = max(
        high + bench.plate_mm + 10.0,
        outer_radius(bench.cam_teeth) + outer_radius(bench.motor_teeth) + 2 * _LEFT_MM,
        abs(pitch_radius(bench.motor_teeth) - pitch_radius(bench.cam_teeth)) + _LEFT_MM,
    )
    least = belt_length(bench.motor_teeth, bench.cam_teeth, clear)
    _at_least(design, "bench.drive_belt_mm", least, "the motor clears the slides")
    tallest = printing.bed_y_mm - high - 2 * bench.plate_mm - 24.0
    most = belt_length(bench.motor_teeth, bench.cam_teeth, max(tallest, clear))
    _at_most(design, "bench.drive_belt_mm", most, "an end plate fits the printer")
    back = -slide_span(bench, cam, design.front_mm)[0]
    most = printing.bed_x_mm - 2 * (back + bench.plate_mm)
    _at_most(design, "bench.shaft_distance_mm", most, "an end plate fits the printer")


def _edges(polygon: FloatArray) -> tuple[FloatArray, FloatArray]:
    return polygon, np.roll(polygon, -1, axis=0)


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]


def _crossings(first: FloatArray, second: FloatArray) -> BoolArray:
    """Return whether each edge of one polygon crosses each of the other: shape (N, M), of bool."""
    start, end = (each[:, np.newaxis] for each in _edges(first))
    other_start, other_end = (each[np.newaxis] for each in _edges(second))
    way, other_way = end - start, other_end - other_start
    apart = _cross(way, other_start - start) * _cross(way, other_end - start) < 0
    other_apart = _cross(other_way, start - other_start) * _cross(other_way, end - other_start) < 0
    return apart & other_apart


def crosses_itself(polygon: FloatArray) -> bool:
    """Return whether two edges of a polygon cross.

    Parameters
    ----------
    polygon
        The polygon's corners in order, shape (N, 2).
    """
    return bool(_crossings(polygon, polygon).any())


def cross(first: FloatArray, second: FloatArray) -> bool:
    """Return whether an edge of one polygon crosses an edge of the other."""
    return bool(_crossings(first, second).any())


def _to_edges(points: FloatArray, polygon: FloatArray) -> float:
    start, end = _edges(polygon)
    way = end - start
    squared = np.maximum((way**2).sum(axis=1), 1e-18)
    steps = ((points[:, np.newaxis] - start) * way).sum(axis=2) / squared
    nearest = start + np.clip(steps, 0.0, 1.0)[..., np.newaxis] * way
    return float(np.linalg.norm(points[:, np.newaxis] - nearest, axis=2).min())


def contains(polygon: FloatArray, point: FloatArray) -> bool:
    """Return whether a point is inside a polygon (a ray to the right crosses it an odd number)."""
    start, end = _edges(polygon)
    spans = (start[:, 1] > point[1]) != (end[:, 1] > point[1])
    rise = np.where(spans, end[:, 1] - start[:, 1], 1.0)
    at = start[:, 0] + (point[1] - start[:, 1]) / rise * (end[:, 0] - start[:, 0])
    return bool((spans & (at > point[0])).sum() % 2)


def gap(first: FloatArray, second: FloatArray) -> float:
    """Return the distance between two polygons, in mm; -1 if they overlap."""
    overlap = cross(first, second) or contains(first, second[0]) or contains(second, first[0])
    if overlap:
        return -1.0
    return min(_to_edges(first, second), _to_edges(second, first))
