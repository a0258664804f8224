"""Make parts.json (sizes and masses of the parts) and bom.csv (the bill of materials)."""

import csv
import io
from collections.abc import Sequence
from typing import Any

from capsule.geometry.pulley import belt_length
from capsule.geometry.stand import row_length
from capsule.geometry.substructure import loop_length
from capsule.parts.design import Design, resistance
from capsule.parts.part import CAPSULE, Part, extent, volume

# Columns of bom.csv.
_COLUMNS = ("item", "quantity", "unit", "kind", "material", "note")
_SHEET_HEIGHT_MM = 35.0


def parts_table(design: Design, parts: Sequence[Part]) -> dict[str, Any]:
    """Return the content of parts.json."""
    bench = design.parts.bench
    return {
        "unit": "mm",
        "capsule": {
            "loop_mm": round(loop_length(design.shape), 4),
            "resistance_ohm": round(
                resistance(design.resistivity_ohm_m, design.phantom, design.parts.choice), 1
            ),
            "resistivity_ohm_m": round(design.resistivity_ohm_m, 4),
            "current": design.parts.choice.current,
        },
        "bench": {
            "waves": round(bench.length_mm / design.cam.lead_mm),
            "waves_per_motor_turn": bench.motor_teeth / bench.cam_teeth,
            "shaft_belt_mm": round(_shaft_belt(design), 3),
            "drive_belt_mm": bench.drive_belt_mm,
        },
        "parts": {
            part.name: {
                "quantity": part.quantity,
                "material": part.material,
                "box_mm": [round(float(size), 4) for size in extent(part)],
                "volume_mm3": round(volume(part), 3),
                "mass_g": round(mass(design, part), 3),
                "bodies": part.bodies,
                "sizes": {name: round(float(value), 4) for name, value in part.sizes.items()},
                "note": part.note,
            }
            for part in parts
        },
    }


def mass(design: Design, part: Part) -> float:
    """Return the mass of a solid part, in g."""
    material = design.parts.material
    dense = material.capsule_g_cm3 if part.material == CAPSULE else material.bench_g_cm3
    return volume(part) * 1e-3 * dense


def _shaft_belt(design: Design) -> float:
    bench = design.parts.bench
    return belt_length(bench.cam_teeth, bench.cam_teeth, bench.shaft_distance_mm)


def bill_of_materials(design: Design, parts: Sequence[Part], sensors: int) -> str:
    """Return the text of bom.csv: the parts to print, and the items to buy."""
    bench, wall = design.parts.bench, design.phantom.wall
    rod = row_length(bench) + 2 * (bench.plate_mm + 25.0)
    sheet = f"{bench.length_mm:g} x {_SHEET_HEIGHT_MM:g} mm"
    series = design.phantom.electronics.series_ohm
    bought = [
        ("filament, NinjaTek Eel, 1.75 mm", 1, "spool", "Shore 90 A, 18 % carbon black"),
        ("enamelled copper wire, 0.1 mm", 2 * sensors, "lead", "two leads a substructure"),
        ("cyanoacrylate adhesive", 1, "bottle", "cuts and glue faces, fully coated"),
        (f"Ecoflex 00-10 wall, {wall.wall_mm:g} mm", 2, "sheet", sheet),
        (f"Ecoflex 00-10 sheet, {wall.sheet_mm:g} mm", 2, "sheet", sheet),
        ("rubber spheres of 1, 2, 3, 4, 5 mm", 1, "set", "PT Flex 60"),
        (f"steel rod, {bench.rod_mm:g} mm with a flat", 2, "piece", f"{rod:g} mm long"),
        (f"bearing, {bench.rod_mm:g} x {bench.bearing_mm:g} x 6 mm", 4, "piece", "626 for 6 mm"),
        (f"belt GT2, 6 mm, {_shaft_belt(design):.0f} mm", 2, "piece", "joins the shafts"),
        (f"belt GT2, 6 mm, {bench.drive_belt_mm:g} mm", 1, "piece", "motor to cam shaft"),
        ("stepper motor 28BYJ-48 with ULN2003", 1, "piece", "docs/bench.md"),
        ("Arduino UNO", 1, "piece", "turns the motor"),
        ("Arduino Mega 2560", 1, "piece", "reads the sensors"),
        (f"resistor {series:g} ohm, 1 %", sensors, "piece", "in series with each sensor"),
        ("screw M4 x 12 with nut", 2, "piece", "motor"),
    ]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for part in parts:
        if part.quantity:
            grams = f"{mass(design, part):.2f} g each. {part.note}"
            writer.writerow((part.name, part.quantity, "piece", "printed", part.material, grams))
    for item, quantity, unit, note in bought:
        writer.writerow((item, quantity, unit, "bought", "", note))
    return stream.getvalue()


def title_lines(design: Design) -> list[str]:
    """Return the lines with the design's choices that every drawing shows."""
    choices = design.parts.choice
    return [
        f"A at the {choices.fold_side} of BC; corners on the wall's {choices.corners}; "
        f"tip: {choices.tip}",
        f"current: {choices.current}; cut: {choices.cut}; folding: {choices.folding}",
    ]
