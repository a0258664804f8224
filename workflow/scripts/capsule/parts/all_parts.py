"""Make all parts: those of the capsule, test coupons to print before it, and the bench's."""

from collections.abc import Sequence

import numpy as np

from capsule.arrays import FloatArray
from capsule.errors import CapsuleError
from capsule.parts.bench_parts import Window, bench_parts, bore, window, window_cut
from capsule.parts.cam import relief
from capsule.parts.design import BENCH, CAPSULE, Design, Part, extent
from capsule.parts.outlines import Prism, Solid, circle, polygon, rectangle, reverse
from capsule.parts.substructure import (
    EYELET_AT_MM,
    EYELET_MM,
    awn_end,
    face_to_face,
    loop_length,
    outline,
    wall_area,
)
from capsule.phantom.origami import pitch, sensor_offsets, vertices

# Plays of the gauge's three windows, as multiples of the design's play.
_PLAYS = (0.5, 1.0, 1.5)
_HANDLE_MM = (8.0, 4.0)
_PROBE_MM = 10.0
_DISC_MM = 8.0


def all_parts(design: Design) -> list[Part]:
    """Return all parts; each fits the printer.

    Raises
    ------
    CapsuleError
        If a part is larger than the printer's room; the message names the value to change.
    """
    parts = [substructure(design), assembly(design), *coupons(design), *bench_parts(design)]
    printing = design.parts.print
    room = np.array([printing.bed_x_mm, printing.bed_y_mm, printing.bed_z_mm])
    for part in parts:
        size = extent(part)
        # A part may be turned on the bed, but not tilted.
        turned = size[[1, 0, 2]]
        if (size > room).any() and (turned > room).any():
            box, space = (" x ".join(f"{each:g}" for each in box.round(1)) for box in (size, room))
            raise CapsuleError(
                f"{part.limited_by} makes the {part.name} too large, {box} mm; the printer has "
                f"room for at most {space} mm; reduce {part.limited_by}"
            )
    return parts


def substructure_solid(design: Design, places_mm: Sequence[float] = (0.0,)) -> Solid:
    """Return copies of the substructure, upright on their lower sides."""
    height, boundaries = design.phantom.origami.height_mm, outline(design.shape)
    holes = []
    if design.parts.choice.folding == "eyelets":
        far = float(np.ptp(boundaries[0][:, 0])) + 2.0
        eyelets = [circle(EYELET_MM / 2, (at, height / 2)) for at in (-EYELET_AT_MM, EYELET_AT_MM)]
        holes = [Prism(eyelets, -far, far, "x")]
    return Solid(Prism(boundaries, 0.0, height), holes, places_mm)


def substructure(design: Design) -> Part:
    """Return the substructure, which is printed once per sensor."""
    origami, shape = design.phantom.origami, design.shape
    corner = vertices(origami)
    return Part(
        "substructure",
        substructure_solid(design),
        design.sensors,
        CAPSULE,
        "One sensor: the hexagon with its two awns.",
        "origami.fold_to_shoulder_mm",
        cuts=outline(shape),
        sizes={
            "width_mm": 2 * float(corner["D"][1]),
            "height_mm": origami.height_mm,
            "wall_mm": origami.wall_thickness_mm,
            "fold_angle_deg": origami.fold_angle_deg,
            "awn_tilt_deg": origami.awn_tilt_deg,
            **{
                f"{name}_{axis}_mm": float(value)
                for name, point in corner.items()
                for axis, value in zip("xy", point, strict=True)
            },
            "flat_AA_mm": 2 * float(corner["A"][1]),
            "flat_BB_mm": 2 * float(corner["B"][1]),
            "flats_apart_mm": abs(float(corner["A"][0] - corner["B"][0])),
            "face_to_face_mm": face_to_face(shape),
            "loop_mm": loop_length(shape),
            "wall_area_mm2": wall_area(shape),
        },
    )


def assembly(design: Design) -> Part:
    """Return the row of substructures, with sensor 1 at the head and without the adhesive."""
    step = pitch(design.phantom.origami)
    places = (-sensor_offsets(design.phantom.origami, design.sensors)).tolist()
    return Part(
        "assembly",
        substructure_solid(design, places),
        0,
        CAPSULE,
        "The substructures where they lie once they are glued; to look at, not to print.",
        "origami.fold_to_shoulder_mm",
        sizes={
            "pitch_mm": step,
            "adhesive_mm": design.phantom.origami.adhesive_mm,
            "faces_mm": face_to_face(design.shape) + (design.sensors - 1) * step,
        },
    )


def coupons(design: Design) -> list[Part]:
    """Return all coupons."""
    return [*_bars(design), _strip(design), _tip(design), _glue(design), *_fit(design)]


def _flat_coupon(
    design: Design, name: str, shape: FloatArray, quantity: int, note: str, **sizes: float
) -> Part:
    height = design.phantom.origami.height_mm
    return Part(
        f"coupon-{name}",
        Solid(Prism([shape], 0.0, height)),
        quantity,
        CAPSULE,
        note,
        "origami.height_mm",
        cuts=[shape],
        sizes={**sizes, "height_mm": height},
    )


def _bars(design: Design) -> list[Part]:
    """Return bars as thick as the wall, thinner and thicker, but not thinner than the nozzle."""
    wall, less = design.phantom.origami.wall_thickness_mm, design.parts.coupon.thinner_mm
    length, nozzle = design.parts.coupon.bar_mm, design.parts.print.nozzle_mm
    return [
        _flat_coupon(
            design,
            f"wall-{width:.2f}",
            rectangle(0.0, 0.0, length, width),
            1,
            "A straight wall: measure how thick it came out, and whether it is one line.",
            length_mm=length,
            wall_mm=width,
        )
        for width in (wall - less, wall, wall + less)
        if width >= nozzle - 1e-9
    ]


def _strip(design: Design) -> Part:
    wall, length = design.phantom.origami.wall_thickness_mm, loop_length(design.shape)
    section_mm2 = wall * design.phantom.origami.height_mm
    return _flat_coupon(
        design,
        "strip",
        rectangle(0.0, 0.0, length, wall),
        1,
        "As long as the loop: its resistance from end to end gives the plastic's resistivity.",
        length_mm=length,
        wall_mm=wall,
        resistance_ohm=design.resistivity_ohm_m * 1e3 * length / section_mm2,
    )


def _tip(design: Design) -> Part:
    """Return the awn, from its shoulder to its end, upright on a handle."""
    shape = design.shape
    foot, half = shape.shoulder, shape.wall_mm / 2 * shape.headward
    wide, high = _HANDLE_MM
    handle = np.array([[-wide / 2, 0.0], [-wide / 2, -high], [wide / 2, -high], [wide / 2, 0.0]])
    # The outline runs down the tail side, around the handle, and up the head side.
    sides = np.vstack([foot - half, foot + half])
    sides[:, 1] = foot[1]
    below = polygon(np.vstack([sides[:1], foot + handle, sides[1:]]))
    chain = np.vstack([awn_end(shape), below])
    return _flat_coupon(
        design,
        "awn",
        chain - [*foot, 0.0],
        1,
        "The awn alone: its end has to come out round, without a thread or a gap.",
        length_mm=design.phantom.origami.shoulder_to_tip_mm,
        tip_radius_mm=shape.cap_radius_mm,
    )


def _glue(design: Design) -> Part:
    """Return an angle: a flat to glue to a second angle, and a leg for the meter's probe."""
    shape = design.shape
    wall, flat = shape.wall_mm, 2 * float(shape.fold[1])
    angle = polygon(
        [[0.0, 0.0], [_PROBE_MM, 0.0], [_PROBE_MM, wall], [wall, wall], [wall, flat], [0.0, flat]]
    )
    return _flat_coupon(
        design,
        "glue",
        angle,
        2,
        "Glue two by their flats as the substructures are: between the legs no current may flow.",
        flat_mm=flat,
        adhesive_mm=design.phantom.origami.adhesive_mm,
    )


def _fit(design: Design) -> list[Part]:
    """Return a gauge of three windows, and a piece of the cam for them."""
    bench, cam = design.parts.bench, design.cam
    thickness, frame = bench.thickness_mm, bench.frame_mm
    height = cam.radius_mm + bench.play_mm
    bevel = relief(thickness, bench.bevel_deg)
    ridges = [cam.radius_mm + bench.play_mm * part for part in _PLAYS]
    low, right = -height - frame, frame
    cuts, notches = [], []
    # One, two or three notches in the lower edge number the windows.
    for count, ridge in enumerate(ridges, start=1):
        half = ridge + bevel
        centre = right + half
        cuts.append(window_cut(Window(ridge, half, height), thickness, centre))
        right = centre + half + frame
        for notch in range(count):
            left = centre + 2.0 * (notch - (count - 1) / 2) - 0.5
            notches += [[left, low], [left, low + 1.0], [left + 1.0, low + 1.0], [left + 1.0, low]]
    outer = polygon([[right, -low], [0.0, -low], [0.0, low], *notches, [right, low]])
    round_cam = circle(cam.radius_mm, (cam.eccentricity_mm, 0.0))
    disc = Solid(Prism([round_cam, reverse(bore(bench))], 0.0, _DISC_MM))
    return [
        Part(
            "coupon-fit-window",
            Solid(Prism([outer], 0.0, thickness), cuts),
            1,
            BENCH,
            "Three windows with half, once and one and a half times the play; notches count them.",
            "bench.cam_radius_mm",
            sizes={
                "thickness_mm": thickness,
                **{f"window_{n}_mm": 2 * ridge for n, ridge in enumerate(ridges, start=1)},
                "ridge_mm": 2 * window(design).ridge_mm,
            },
        ),
        Part(
            "coupon-fit-cam",
            disc,
            1,
            BENCH,
            "A piece of the cam for the three windows, and for the rod with its flat.",
            "bench.cam_radius_mm",
            sizes={"radius_mm": cam.radius_mm, "thickness_mm": _DISC_MM},
        ),
    ]
