"""Make the capsule's parts: the substructure, and the assembly of all substructures."""

import numpy as np
from manifold3d import Manifold

from capsule.geometry.open_choices import EYELET_AT_MM, EYELET_MM
from capsule.geometry.stand import circle
from capsule.geometry.substructure import (
    glue_faces,
    loop_length,
    named_corners,
    outline,
    spacing,
    wall_area,
)
from capsule.parts import solids
from capsule.parts.design import Design
from capsule.parts.part import CAPSULE, Flat, Part


def substructure_solid(design: Design) -> Manifold:
    """Return one substructure, upright on its lower side."""
    origami = design.phantom.origami
    solid = solids.prism(outline(design.shape), origami.height_mm)
    if design.parts.choice.folding == "eyelets":
        length = float(np.ptp(outline(design.shape)[0][:, 0])) + 2.0
        for side in (-1.0, 1.0):
            eyelet = circle(EYELET_MM / 2, (side * EYELET_AT_MM, origami.height_mm / 2), points=32)
            hole = solids.crossways([eyelet], 2 * length, "x")
            solid = solid - hole
    return solid


def substructure(design: Design, sensors: int) -> Part:
    """Return the substructure, which is printed once per sensor."""
    origami, choices, shape = design.phantom.origami, design.parts.choice, design.shape
    corner = named_corners(origami, choices)
    faces = glue_faces(shape)
    sizes = {
        "width_mm": 2 * float(corner["D"][1]),
        "height_mm": origami.height_mm,
        "wall_mm": origami.wall_thickness_mm,
        "fold_angle_deg": origami.fold_angle_deg,
        "awn_tilt_deg": origami.awn_tilt_deg,
        **{
            f"{name}_{axis}_mm": float(corner[name][index])
            for name in "ABCD"
            for index, axis in enumerate("xy")
        },
        "flat_AA_mm": 2 * float(corner["A"][1]),
        "flat_BB_mm": 2 * float(corner["B"][1]),
        "flats_apart_mm": abs(float(corner["A"][0] - corner["B"][0])),
        "face_to_face_mm": float(faces["head"][0, 0] - faces["tail"][0, 0]),
        "loop_mm": loop_length(shape),
        "wall_area_mm2": wall_area(shape),
    }
    return Part(
        "substructure",
        *solids.mesh(substructure_solid(design)),
        sensors,
        CAPSULE,
        "One sensor: the hexagon with its two awns.",
        "origami.fold_to_shoulder_mm",
        flat=Flat(outline(shape)),
        sizes=sizes,
    )


def assembly(design: Design, sensors: int) -> Part:
    """Return the row of substructures, with sensor 1 at the head and without the adhesive."""
    pitch = spacing(design.shape, design.phantom.origami.adhesive_mm)
    unit = substructure_solid(design)
    row = Manifold.compose([unit.translate((-pitch * n, 0.0, 0.0)) for n in range(sensors)])
    face = float(glue_faces(design.shape)["head"][0, 0] - glue_faces(design.shape)["tail"][0, 0])
    return Part(
        "assembly",
        *solids.mesh(row),
        0,
        CAPSULE,
        "The substructures where they lie once they are glued; to look at, not to print.",
        "origami.fold_to_shoulder_mm",
        bodies=sensors,
        sizes={
            "pitch_mm": pitch,
            "adhesive_mm": design.phantom.origami.adhesive_mm,
            "faces_mm": face + (sensors - 1) * pitch,
        },
    )
