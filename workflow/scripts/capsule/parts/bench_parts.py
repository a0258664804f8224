"""Make the bench's parts: cam shafts, followers, slides, platform, end plates."""

import numpy as np

from capsule.parts import stand
from capsule.parts.cam import Cam, phase_step, steepest_overhang
from capsule.parts.design import BENCH, Design, Flat, Part
from capsule.parts.outlines import Prism, Solid, polygon, rectangle
from capsule.parts.solids import exact, united
from capsule.parts.stand import Bench, scale_marks

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


def cam_solid(bench: Bench, cam: Cam, turned: bool = False) -> Solid:
    """Return one section of a cam shaft, which is one turn, printed upright.

    A belt joins both shafts, so they turn in the same direction. For the mirrored wave, the second
    shaft has the same hand and is half a turn ahead: its key is turned, and its cam not mirrored.
    """
    return Solid(cam, [Prism([stand.bore(bench, turned)], -1.0, cam.lead_mm + 1.0)])


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
                *exact(cam_solid(bench, cam, turned)),
                round(bench.length_mm / cam.lead_mm),
                BENCH,
                f"A section of the {side} cam shaft, one wave long; the flat of the rod keys it.",
                "wall.wavelength_mm",
                sizes={**sizes, "key_deg": 180.0 if turned else 0.0},
            )
        )
    return made


def window_cut(
    ridge_mm: float, face_mm: float, height_mm: float, thickness_mm: float, centre_mm: float = 0.0
) -> Prism:
    """Return the prism to cut for a window, which is narrowest at the middle of the plate.

    Parameters
    ----------
    ridge_mm, face_mm, height_mm
        Half width at the middle, half width at the faces, and half height.
    thickness_mm
        Thickness of the plate, which lies on z = 0.
    centre_mm
        Position of the window's middle along x.
    """
    right = [
        [face_mm, -1.0],
        [face_mm, 0.0],
        [ridge_mm, thickness_mm / 2],
        [face_mm, thickness_mm],
        [face_mm, thickness_mm + 1.0],
    ]
    profile = np.array([*right, *[[-x, z] for x, z in reversed(right)]])
    return Prism([polygon(profile + np.array([centre_mm, 0.0]))], -height_mm, height_mm, "y")


def follower_solid(design: Design) -> Solid:
    """Return a follower that lies on its face, with u as x and z as y."""
    bench, cam = design.parts.bench, design.cam
    outer, _ = stand.follower_outline(bench, cam, design.front_mm)
    thickness = bench.follower_mm - bench.follower_gap_mm
    opening = stand.window(bench, cam)
    cut = window_cut(opening.ridge_mm, opening.face_mm, opening.height_mm, thickness)
    return Solid(Prism([outer], 0.0, thickness), [cut])


def follower(design: Design) -> Part:
    """Return the follower; both rows consist of followers."""
    bench, cam = design.parts.bench, design.cam
    opening = stand.window(bench, cam)
    return Part(
        "follower",
        *exact(follower_solid(design)),
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
        *exact(Solid(Prism([outline], 0.0, bench.slide_mm))),
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
    outline = rectangle(-length / 2, -width / 2, length / 2, width / 2)
    marks = united(scale_marks(bench.length_mm, bench.platform_width_mm))
    top = bench.platform_mm
    engraved = Prism(marks, top - _ENGRAVED_MM, top + 1.0)
    return Part(
        "platform",
        *exact(Solid(Prism([outline], 0.0, top), [engraved])),
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
        *exact(Solid(Prism([outline, *holes], 0.0, bench.plate_mm))),
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
