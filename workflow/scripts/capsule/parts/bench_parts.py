"""Make the bench's parts: cam shafts, followers, slides, platform, end plates."""

import numpy as np
from manifold3d import Manifold

from capsule.geometry import stand
from capsule.geometry.cam import Cam, phase_step, steepest_overhang
from capsule.geometry.stand import Bench, scale_marks
from capsule.parts import solids
from capsule.parts.design import BENCH, Design, Flat, Part, Spiral

# Steps along a cam shaft's section, and corners of its circle: within 0.01 mm of the exact cam.
_STEPS, _CORNERS = 160, 96
_ENGRAVED_MM = 0.4


def bench_parts(design: Design) -> list[Part]:
    """Return all parts of the bench."""
    return [
        *cam_sections(design),
        follower(design),
        slide(design),
        platform(design),
        end_plate(design),
    ]


def cam_solid(bench: Bench, cam: Cam, turned: bool = False) -> Manifold:
    """Return one section of a cam shaft, which is one turn, printed upright.

    A belt joins both shafts, so they turn in the same direction. For the mirrored wave, the second
    shaft has the same hand and is half a turn ahead: its key is turned, and its cam not mirrored.
    """
    circle = stand.circle(cam.radius_mm, (cam.eccentricity_mm, 0.0), points=_CORNERS)
    body = solids.twisted([circle], cam.lead_mm, -360.0, _STEPS)
    return body - solids.prism([stand.bore(bench, turned)], cam.lead_mm + 2.0, -1.0)


def cam_sections(design: Design) -> list[Part]:
    """Return the sections of both cam shafts."""
    bench, cam = design.parts.bench, design.cam
    sizes = {
        "radius_mm": cam.radius_mm,
        "eccentricity_mm": cam.eccentricity_mm,
        "lead_mm": cam.lead_mm,
        "overhang_deg": steepest_overhang(cam),
    }
    made = []
    for side, turned in (("left", False), ("right", True)):
        made.append(
            Part(
                f"cam-{side}",
                *solids.mesh(cam_solid(bench, cam, turned)),
                round(bench.length_mm / cam.lead_mm),
                BENCH,
                f"A section of the {side} cam shaft, one wave long; the flat of the rod keys it.",
                "wall.wavelength_mm",
                spiral=Spiral(cam, stand.bore(bench, turned)),
                sizes={**sizes, "key_deg": 180.0 if turned else 0.0},
            )
        )
    return made


def window_cut(ridge_mm: float, face_mm: float, height_mm: float, thickness_mm: float) -> Manifold:
    """Return the solid to cut for a window, which is narrowest at the middle of the plate.

    Parameters
    ----------
    ridge_mm, face_mm, height_mm
        Half width at the middle, half width at the faces, and half height.
    thickness_mm
        Thickness of the plate, which lies on z = 0.
    """
    right = [
        [face_mm, -1.0],
        [face_mm, 0.0],
        [ridge_mm, thickness_mm / 2],
        [face_mm, thickness_mm],
        [face_mm, thickness_mm + 1.0],
    ]
    profile = np.array([*right, *[[-x, z] for x, z in reversed(right)]])
    return solids.crossways([profile], 2 * height_mm, "y")


def follower_solid(design: Design) -> Manifold:
    """Return a follower that lies on its face, with u as x and z as y."""
    bench, cam = design.parts.bench, design.cam
    outer, _ = stand.follower_outline(bench, cam, design.front_mm)
    thickness = bench.follower_mm - bench.follower_gap_mm
    opening = stand.window(bench, cam)
    cut = window_cut(opening.ridge_mm, opening.face_mm, opening.height_mm, thickness)
    return solids.prism([outer], thickness) - cut


def follower(design: Design) -> Part:
    """Return the follower; both rows consist of followers."""
    bench, cam = design.parts.bench, design.cam
    opening = stand.window(bench, cam)
    return Part(
        "follower",
        *solids.mesh(follower_solid(design)),
        2 * round(bench.length_mm / bench.follower_mm),
        BENCH,
        "Pushes the silicone; the ridge in its window rides on the cam.",
        "bench.shaft_distance_mm",
        flat=Flat(stand.follower_outline(bench, cam, design.front_mm)),
        sizes={
            "thickness_mm": bench.follower_mm - bench.follower_gap_mm,
            "pitch_mm": bench.follower_mm,
            "phase_step_deg": phase_step(cam, bench.follower_mm),
            "ridge_mm": 2 * opening.ridge_mm,
            "window_height_mm": 2 * opening.height_mm,
            "front_mm": design.front_mm,
        },
    )


def slide(design: Design) -> Part:
    """Return a slide; each row has one above and one below it."""
    bench = design.parts.bench
    outline = stand.slide_outline(bench, design.cam, design.front_mm)
    return Part(
        "slide",
        *solids.mesh(solids.prism([outline], bench.slide_mm)),
        4,
        BENCH,
        "Lies above or below a row, so that followers slide across the gut alone.",
        "bench.length_mm",
        flat=Flat([outline]),
        sizes={
            "thickness_mm": bench.slide_mm,
            "between_plates_mm": stand.row_length(bench),
        },
    )


def platform(design: Design) -> Part:
    """Return the platform with its scale, which begins at the row's left end."""
    bench = design.parts.bench
    # Its ends stand in the end plates.
    length, width = stand.row_length(bench) + 2 * bench.plate_mm, bench.platform_width_mm
    outline = stand.rectangle(-length / 2, -width / 2, length / 2, width / 2)
    marks = scale_marks(bench.length_mm, bench.platform_width_mm)
    body = solids.prism([outline], bench.platform_mm)
    engraved = solids.prism(marks, 1.0, bench.platform_mm - _ENGRAVED_MM)
    return Part(
        "platform",
        *solids.mesh(body - engraved),
        1,
        BENCH,
        "Carries the capsule between the walls; the scale tells how far it has moved.",
        "bench.length_mm",
        flat=Flat([outline], marks),
        sizes={
            "width_mm": bench.platform_width_mm,
            "thickness_mm": bench.platform_mm,
            "scale_mm": bench.length_mm,
        },
    )


def end_plate(design: Design) -> Part:
    """Return an end plate, which holds bearings, slides and platform; one also holds the motor."""
    bench = design.parts.bench
    outline, holes = stand.end_plate(bench, design.cam, design.front_mm)
    return Part(
        "end-plate",
        *solids.mesh(solids.prism([outline, *holes], bench.plate_mm)),
        2,
        BENCH,
        "Holds both shafts, the slides, the platform and the motor.",
        "bench.drive_belt_mm",
        flat=Flat([outline, *holes]),
        sizes={
            "thickness_mm": bench.plate_mm,
            "shaft_distance_mm": bench.shaft_distance_mm,
            "motor_height_mm": stand.motor_height(bench),
        },
    )
