"""Make test coupons: small parts to print and measure before the capsule."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.geometry.cam import relief
from capsule.geometry.stand import bore, circle, rectangle, window
from capsule.geometry.substructure import awn_end, loop_length
from capsule.parts import solids
from capsule.parts.bench_parts import window_cut
from capsule.parts.design import Design
from capsule.parts.part import BENCH, CAPSULE, Flat, Part

# Plays of the gauge's three windows, as multiples of the design's play.
_PLAYS = (0.5, 1.0, 1.5)
_HANDLE_MM = (8.0, 4.0)
_PROBE_MM = 10.0
_DISC_MM = 8.0


def coupons(design: Design) -> list[Part]:
    """Return all coupons."""
    return [*_bars(design), _strip(design), _tip(design), _glue(design), *_fit(design)]


def _flat_coupon(
    design: Design, name: str, shape: FloatArray, quantity: int, note: str, **sizes: float
) -> Part:
    height = design.phantom.origami.height_mm
    return Part(
        f"coupon-{name}",
        *solids.mesh(solids.prism([shape], height)),
        quantity,
        CAPSULE,
        note,
        "origami.height_mm",
        flat=Flat([shape]),
        sizes={**sizes, "height_mm": height},
    )


def _bars(design: Design) -> list[Part]:
    """Return bars as thick as the wall, thinner and thicker, but not thinner than the nozzle."""
    wall, less = design.phantom.origami.wall_thickness_mm, design.parts.coupon.thinner_mm
    length = design.parts.coupon.bar_mm
    nozzle = design.parts.print.nozzle_mm
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
    wall = design.phantom.origami.wall_thickness_mm
    length = loop_length(design.shape)
    return _flat_coupon(
        design,
        "strip",
        rectangle(0.0, 0.0, length, wall),
        1,
        "As long as the loop: its resistance from end to end gives the plastic's resistivity.",
        length_mm=length,
        wall_mm=wall,
        resistance_ohm=design.resistivity_ohm_m
        * 1e3
        * length
        / (wall * design.phantom.origami.height_mm),
    )


def _tip(design: Design) -> Part:
    """Return the awn, from its shoulder to its end, upright on a handle."""
    shape = design.shape
    end = awn_end(shape)
    foot = shape.shoulder
    half = shape.wall_mm / 2 * shape.headward
    wide, high = _HANDLE_MM
    corners = [[-wide / 2, 0.0], [-wide / 2, -high], [wide / 2, -high], [wide / 2, 0.0]]
    handle = foot + np.array(corners)
    # The outline runs down the tail side, around the handle, and up the head side.
    chain = np.vstack([end, foot - half, handle, foot + half])
    chain[len(end), 1] = chain[-1, 1] = foot[1]
    return _flat_coupon(
        design,
        "awn",
        chain - foot,
        1,
        "The awn alone: its end has to come out round, without a thread or a gap.",
        length_mm=design.phantom.origami.shoulder_to_tip_mm,
        tip_radius_mm=shape.cap_radius_mm,
    )


def _glue(design: Design) -> Part:
    """Return an angle: a flat to glue to a second angle, and a leg for the meter's probe."""
    shape = design.shape
    wall, flat = shape.wall_mm, 2 * float(shape.fold[1])
    angle = np.array(
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
    bench, cam = design.parts.bench, design.cam
    opening = window(bench, cam)
    thickness = bench.follower_mm - bench.follower_gap_mm
    high = 2 * (cam.radius_mm + bench.play_mm)
    bevel = relief(thickness, bench.bevel_deg)
    widths = [cam.radius_mm + bench.play_mm * part for part in _PLAYS]
    frame, at, centres = bench.frame_mm, 0.0, []
    for half in widths:
        centres.append(at + frame + half + bevel)
        at += frame + 2 * (half + bevel)
    right = at + frame
    outer = rectangle(0.0, -high / 2 - frame, right, high / 2 + frame)
    gauge = solids.prism([outer], thickness)
    holes = []
    for centre, half in zip(centres, widths, strict=True):
        cut = window_cut(half, half + bevel, high / 2, thickness)
        gauge = gauge - cut.translate((centre, 0.0, 0.0))
        face = half + bevel
        holes.append(rectangle(centre - face, -high / 2, centre + face, high / 2)[::-1])
    # One, two or three notches in the lower edge number the windows.
    for count, centre in enumerate(centres, start=1):
        for notch in range(count):
            left = centre + 2.0 * (notch - (count - 1) / 2) - 0.5
            low = -high / 2 - frame
            notched = rectangle(left, low - 1.0, left + 1.0, low + 1.0)
            gauge = gauge - solids.prism([notched], thickness + 2.0, -1.0)
    disc = solids.prism(
        [circle(cam.radius_mm, (cam.eccentricity_mm, 0.0)), bore(bench)[::-1]], _DISC_MM
    )
    return [
        Part(
            "coupon-fit-window",
            *solids.mesh(gauge),
            1,
            BENCH,
            "Three windows with half, once and one and a half times the play; notches count them.",
            "bench.cam_radius_mm",
            sizes={
                "thickness_mm": thickness,
                **{f"window_{n}_mm": 2 * half for n, half in enumerate(widths, start=1)},
                "ridge_mm": 2 * opening.ridge_mm,
            },
        ),
        Part(
            "coupon-fit-cam",
            *solids.mesh(disc),
            1,
            BENCH,
            "A piece of the cam for the three windows, and for the rod with its flat.",
            "bench.cam_radius_mm",
            sizes={"radius_mm": cam.radius_mm, "thickness_mm": _DISC_MM},
        ),
    ]
