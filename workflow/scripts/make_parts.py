"""Make the parts of capsule and bench to print: meshes, outlines, drawings and lists, in mm.

Needs manifold3d: pip install "origami-capsule[parts]", or pip install manifold3d.
STEP files (--step) also need Open CASCADE, which the extra [cad] installs.
"""

from capsule import files
from capsule.parts.flat_files import dxf_text, svg_text
from capsule.parts.mesh_files import split_bodies, stl_bytes, threemf_bytes
from capsule.parts.part_lists import bill_of_materials, parts_table, title_lines
from capsule.parts.part_options import read_arguments, read_design, read_sensors, step_writer
from capsule.parts.print_profile import profile_text
from capsule.parts.sheets import sheet_files, sheets

try:
    from capsule.parts.all_parts import all_parts
except ModuleNotFoundError as error:
    if error.name != "manifold3d":
        raise
    raise SystemExit("error: the parts need manifold3d; run: pip install manifold3d") from None


def main() -> None:
    """Make all parts, and write their files."""
    arguments = read_arguments(__doc__)
    design, sensors = read_design(arguments.changes, arguments.nozzle), read_sensors()
    step_bytes = step_writer() if arguments.step else None
    parts, out = all_parts(design, sensors), arguments.out
    for part in parts:
        bodies = split_bodies(part.name, part.vertices, part.triangles)
        with files.write_whole(out / f"{part.name}.stl", "wb") as stream:
            stream.write(stl_bytes(part.name, part.vertices, part.triangles))
        with files.write_whole(out / f"{part.name}.3mf", "wb") as stream:
            stream.write(threemf_bytes(bodies))
        if step_bytes is not None:
            with files.write_whole(out / f"{part.name}.step", "wb") as stream:
                stream.write(step_bytes(part))
        if part.flat is not None:
            with files.write_whole(out / f"{part.name}.dxf") as stream:
                stream.write(dxf_text(part.flat))
            with files.write_whole(out / f"{part.name}.svg") as stream:
                stream.write(svg_text(part.name, part.flat))
    for sheet in sheets(design, sensors):
        for kind, content in sheet_files(sheet, title_lines(design)).items():
            with files.write_whole(out / "drawings" / f"{sheet.name}.{kind}", "wb") as stream:
                stream.write(content)
    files.write_json(out / "parts.json", parts_table(design, parts))
    with files.write_whole(out / "bom.csv") as stream:
        stream.write(bill_of_materials(design, parts, sensors))
    with files.write_whole(out / "print-profile.ini") as stream:
        stream.write(profile_text(design.parts.print))
    print(f"{len(parts)} parts in {out}/")


if __name__ == "__main__":
    files.run(main)
