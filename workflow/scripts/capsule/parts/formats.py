"""Make the content of the parts' files: STL and 3MF, DXF and SVG, lists and print profile.

The same part always gives the same bytes.
"""

import io
import zipfile
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from capsule.parts.bench_parts import belt_length
from capsule.parts.design import CAPSULE, Design, Part, Printing, extent, resistance, volume
from capsule.parts.outlines import points, radii
from capsule.parts.substructure import loop_length

# A facet of binary STL: normal, three corners, two unused bytes.
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
_HEADER_BYTES = 80
_EPOCH = (1980, 1, 1, 0, 0, 0)
_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)
# Layers of the files: colour numbers of DXF, white (black on paper) and red, and colours of SVG.
_LAYERS = {"CUT": (7, "#000000"), "ENGRAVE": (1, "#c00000")}
_MARGIN_MM = 1.0
# Columns of bom.csv.
BILL_COLUMNS = ("item", "quantity", "unit", "kind", "material", "note")
_SHEET_HEIGHT_MM = 35.0


def stl_bytes(part: Part) -> bytes:
    """Return a part's mesh as binary STL, in mm."""
    corners = part.corners
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets = np.zeros(len(corners), _FACET)
    facets["normal"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    facets["corners"] = corners
    header = f"{part.name}, mm".encode("ascii").ljust(_HEADER_BYTES)
    return header + np.uint32(len(corners)).tobytes() + facets.tobytes()


def threemf_bytes(part: Part) -> bytes:
    """Return a part's mesh as 3MF, in mm; each body is one object."""
    objects = [
        f'<object id="{number}" name="{name}" type="model"><mesh>\n<vertices>\n'
        + "".join(f'<vertex x="{x:.6f}" y="{y:.6f}" z="{z:.6f}"/>\n' for x, y, z in vertices)
        + "</vertices>\n<triangles>\n"
        + "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in triangles)
        + "</triangles>\n</mesh></object>\n"
        for number, (name, vertices, triangles) in enumerate(part.bodies, start=1)
    ]
    items = "".join(f'<item objectid="{number}"/>\n' for number in range(1, len(objects) + 1))
    model = (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xmlns="{_CORE}">\n'
        f"<resources>\n{''.join(objects)}</resources>\n<build>\n{items}</build>\n</model>\n"
    )
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as package:
        for path, text in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", model),
        ):
            # A fixed date and system: the bytes must depend only on the mesh.
            entry = zipfile.ZipInfo(path, _EPOCH)
            entry.create_system, entry.compress_type = 3, zipfile.ZIP_DEFLATED
            package.writestr(entry, text, compresslevel=6)
    return stream.getvalue()


def dxf_text(part: Part) -> str:
    """Return a flat part as DXF (release 12, in mm, a layer for each kind).

    Each is a closed polyline of lines and arcs.
    """
    layers = "".join(
        _groups((0, "LAYER"), (2, name), (70, 0), (62, colour), (6, "CONTINUOUS"))
        for name, (colour, _) in _LAYERS.items()
    )
    drawn = "".join(
        _polyline(outline, layer) for layer, outlines in _by_layer(part) for outline in outlines
    )
    return (
        _groups((0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"))
        + _groups((9, "$INSUNITS"), (70, 4), (9, "$MEASUREMENT"), (70, 1), (0, "ENDSEC"))
        + _groups((0, "SECTION"), (2, "TABLES"), (0, "TABLE"), (2, "LTYPE"), (70, 1))
        + _groups((0, "LTYPE"), (2, "CONTINUOUS"), (70, 0), (3, "Solid line"), (72, 65), (73, 0))
        + _groups((40, "0.0"), (0, "ENDTAB"))
        + _groups((0, "TABLE"), (2, "LAYER"), (70, len(_LAYERS)))
        + layers
        + _groups((0, "ENDTAB"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES"))
        + drawn
        + _groups((0, "ENDSEC"), (0, "EOF"))
    )


def _groups(*pairs: tuple[int, object]) -> str:
    return "".join(f"{code}\n{value}\n" for code, value in pairs)


def _polyline(outline: np.ndarray, layer: str) -> str:
    head = _groups((0, "POLYLINE"), (8, layer), (66, 1), (70, 1), (10, 0.0), (20, 0.0), (30, 0.0))
    corners = "".join(
        _groups((0, "VERTEX"), (8, layer), (10, f"{x:.9f}"), (20, f"{y:.9f}"), (30, "0.0"))
        + (_groups((42, f"{bulge:.12f}")) if bulge else "")
        for x, y, bulge in outline
    )
    return head + corners + _groups((0, "SEQEND"), (8, layer))


def _by_layer(part: Part) -> list[tuple[str, Sequence[np.ndarray]]]:
    return list(zip(_LAYERS, (part.cuts, part.marks), strict=True))


def svg_text(part: Part) -> str:
    """Return a flat part as SVG at true size; as in the DXF, y points upwards."""
    corners = np.vstack([points(each) for each in part.cuts])
    low, high = corners.min(axis=0) - _MARGIN_MM, corners.max(axis=0) + _MARGIN_MM
    width, height = high - low
    groups = "".join(
        f'<g id="{layer}" fill="none" stroke="{_LAYERS[layer][1]}" stroke-width="0.1">'
        f'<path d="{" ".join(_path(each, low[0], high[1]) for each in outlines)}"/></g>\n'
        for layer, outlines in _by_layer(part)
        if outlines
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.6f}mm" height="{height:.6f}mm" '
        f'viewBox="0 0 {width:.6f} {height:.6f}">\n<title>{part.name}, 1 : 1</title>\n'
        f"{groups}</svg>\n"
    )


def _path(outline: np.ndarray, left: float, top: float) -> str:
    """Return an outline as the data of an SVG path, whose y points downwards."""
    ends = [f"{x - left:.6f},{top - y:.6f}" for x, y in outline[:, :2]]
    drawn = [f"M{ends[0]}"]
    for bulge, radius, end in zip(outline[:, 2], radii(outline), ends[1:] + ends[:1], strict=True):
        # An arc: two radii, rotation, whether it is more than half a circle, and its direction.
        to = f"A{radius:.6f} {radius:.6f} 0 {abs(bulge) > 1:d} {bulge < 0:d} " if bulge else "L"
        drawn.append(to + end)
    return " ".join(drawn) + " Z"


def parts_table(design: Design, parts: Sequence[Part]) -> dict[str, Any]:
    """Return the content of parts.json."""
    bench, resistivity = design.parts.bench, design.resistivity_ohm_m
    ohm = resistance(resistivity, design.phantom, design.parts.choice)
    return {
        "unit": "mm",
        "capsule": {
            "loop_mm": round(loop_length(design.shape), 4),
            "resistance_ohm": round(ohm, 1),
            "resistivity_ohm_m": round(resistivity, 4),
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
                "bodies": len(part.bodies),
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


def bill_of_materials(design: Design, parts: Sequence[Part]) -> Iterator[tuple[object, ...]]:
    """Yield the rows of bom.csv: the parts to print, and the items to buy."""
    bench, wall, sensors = design.parts.bench, design.phantom.wall, design.sensors
    rod = bench.row_mm + 2 * (bench.plate_mm + 25.0)
    sheet = f"{bench.length_mm:g} x {_SHEET_HEIGHT_MM:g} mm"
    series, pulley = design.phantom.electronics.series_ohm, "pulley GT2"
    joined = "a belt joins the rods at both ends, and the motor drives one"
    bought = [
        ("filament, NinjaTek Eel, 1.75 mm", 1, "spool", "Shore 90 A, 18 % carbon black"),
        ("enamelled copper wire, 0.1 mm", 2 * sensors, "lead", "two leads a substructure"),
        ("cyanoacrylate adhesive", 1, "bottle", "cuts and glue faces, fully coated"),
        (f"Ecoflex 00-10 wall, {wall.wall_mm:g} mm", 2, "sheet", sheet),
        (f"Ecoflex 00-10 sheet, {wall.sheet_mm:g} mm", 2, "sheet", sheet),
        ("rubber spheres of 1, 2, 3, 4, 5 mm", 1, "set", "PT Flex 60"),
        (f"steel rod, {bench.rod_mm:g} mm with a flat", 2, "piece", f"{rod:g} mm long"),
        (f"bearing, {bench.rod_mm:g} x {bench.bearing_mm:g} x 6 mm", 4, "piece", "626 for 6 mm"),
        (f"{pulley}, {bench.cam_teeth:g} teeth, bore {bench.rod_mm:g} mm", 5, "piece", joined),
        (f"{pulley}, {bench.motor_teeth:g} teeth, bore 5 mm", 1, "piece", "on the motor's shaft"),
        (f"belt GT2, 6 mm, {_shaft_belt(design):.0f} mm", 2, "piece", "joins the shafts"),
        (f"belt GT2, 6 mm, {bench.drive_belt_mm:g} mm", 1, "piece", "motor to cam shaft"),
        ("stepper motor 28BYJ-48 with ULN2003", 1, "piece", "docs/bench.md"),
        ("Arduino UNO", 1, "piece", "turns the motor"),
        ("Arduino Mega 2560", 1, "piece", "reads the sensors"),
        (f"resistor {series:g} ohm, 1 %", sensors, "piece", "in series with each sensor"),
        ("screw M4 x 12 with nut", 2, "piece", "motor"),
    ]
    for part in parts:
        if part.quantity:
            note = f"{mass(design, part):.2f} g each. {part.note}"
            yield part.name, part.quantity, "piece", "printed", part.material, note
    for item, quantity, unit, note in bought:
        yield item, quantity, unit, "bought", "", note


def profile_text(printing: Printing) -> str:
    """Return a profile that prints a wall of up to twice the nozzle's width as one line.

    The generator Arachne makes a line as wide as its wall. The classic generator would print two
    lines, or leave a gap. Support is off, since no part needs it.
    """
    x, y, z = printing.bed_x_mm, printing.bed_y_mm, printing.bed_z_mm
    nozzle, layer = printing.nozzle_mm, printing.layer_mm
    line = 1.125 * nozzle
    return f"""\
# PrusaSlicer: prusa-slicer --load print-profile.ini --export-gcode PART.stl
bed_shape = 0x0,{x:g}x0,{x:g}x{y:g},0x{y:g}
max_print_height = {z:g}
nozzle_diameter = {nozzle:g}
filament_diameter = 1.75
layer_height = {layer:g}
first_layer_height = {layer:g}
perimeter_generator = arachne
perimeters = 2
extrusion_width = {line:g}
external_perimeter_extrusion_width = {line:g}
perimeter_extrusion_width = {line:g}
first_layer_extrusion_width = {line:g}
wall_transition_length = {nozzle:g}
min_bead_width = 85%
min_feature_size = 25%
fill_density = 20%
support_material = 0
brim_width = 0
skirts = 0
elefant_foot_compensation = 0
resolution = 0
gcode_resolution = 0.0125
gcode_comments = 0
temperature = 230
bed_temperature = 50
max_print_speed = 30
perimeter_speed = 20
external_perimeter_speed = 15
"""
