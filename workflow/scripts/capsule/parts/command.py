"""Make the parts of capsule and bench to print: meshes, outlines, drawings and lists, in mm."""

import argparse
from pathlib import Path

from capsule.engine.configuration import read_settings
from capsule.engine.project import config_file, not_installed
from capsule.errors import CapsuleError
from capsule.parts.design import LIMITS, Design, design_of, entries
from capsule.parts.files import read_parts_table
from capsule.parts.formats import (
    bill_of_materials,
    dxf_text,
    parts_table,
    profile_text,
    stl_bytes,
    svg_text,
    threemf_bytes,
    title_lines,
)
from capsule.parts.sheets import sheet_files, sheets
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.parameters import (
    nearest,
    number_of,
    parameter_names,
    parsed,
    with_values,
    words_of,
)
from capsule.store import files

_NOZZLE = "print.nozzle_mm"
# The error if a package is missing.
_MISSING = {
    "manifold3d": not_installed("the parts need manifold3d", "parts"),
    "OCP": not_installed("--step needs Open CASCADE", "cad"),
}

EPILOG = """
The solids need the package manifold3d, which the extra parts installs. STEP files (--step) also
need Open CASCADE, which the extra cad installs.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: the changes of the design and the output folder."""
    parser.epilog = EPILOG
    add = parser.add_argument
    output = Path("parts")
    add("--out", type=Path, default=output, metavar="FOLDER", help="output folder (default: parts)")
    add(
        "--set",
        dest="changes",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="change a value of config/parts.yaml, or an origami.* or wall.* of "
        "config/phantom.yaml, such as origami.fold_angle_deg=40; may be repeated",
    )
    add("--nozzle", metavar="MM", help=f"diameter of the nozzle (the same as --set {_NOZZLE}=MM)")
    add("--step", action="store_true", help="also write STEP")


def main(arguments: argparse.Namespace) -> None:
    """Make all parts, and write their files.

    Raises
    ------
    CapsuleError
        The design cannot be made, or a package is missing.
    """
    # Only here and in `read_design`, the command imports its large libraries.
    try:
        from capsule.parts.all_parts import all_parts

        if arguments.step:
            from capsule.parts.step_files import step_bytes
    except ModuleNotFoundError as error:
        # Older releases of Open CASCADE lack some of its modules.
        package = (error.name or "").partition(".")[0]
        if package not in _MISSING:
            raise
        raise _MISSING[package] from None
    design, sensors = read_design(arguments.changes, arguments.nozzle), read_sensors()
    parts, out = all_parts(design, sensors), arguments.out

    def write(name: str, content: str | bytes) -> None:
        data = content.encode() if isinstance(content, str) else content
        with files.write_whole(out / name, "wb") as stream:
            stream.write(data)

    for part in parts:
        write(f"{part.name}.stl", stl_bytes(part.name, part.vertices, part.triangles))
        write(f"{part.name}.3mf", threemf_bytes(part.bodies))
        if arguments.step:
            write(f"{part.name}.step", step_bytes(part.name, part.solid))
        if part.flat is not None:
            write(f"{part.name}.dxf", dxf_text(part.flat))
            write(f"{part.name}.svg", svg_text(part.name, part.flat))
    for sheet in sheets(design, sensors):
        for kind, content in sheet_files(sheet, title_lines(design)).items():
            write(f"drawings/{sheet.name}.{kind}", content)
    files.write_json(out / "parts.json", parts_table(design, parts))
    write("bom.csv", bill_of_materials(design, parts, sensors))
    write("print-profile.ini", profile_text(design.parts.print))
    print(f"{len(parts)} parts in {out}/")


def read_design(changes: list[str], nozzle: str | None = None) -> Design:
    """Read both tables, apply the changes, and raise an error if the design cannot be made.

    Parameters
    ----------
    changes
        Texts of the form ``part.name=value``; a value is a number or a word.
    nozzle
        Diameter of the nozzle in mm, as text.

    Raises
    ------
    CapsuleError
        A name is unknown or a value is not allowed; the message names it and its limit.
    """
    if nozzle is not None:
        changes = [*changes, f"{_NOZZLE}={nozzle}"]
    table = read_parts_table()
    rows = dict(entries(table))
    theirs = [*table[LIMITS], *filter(words_of, parameter_names())]
    own: dict[str, str | float] = {}
    of_phantom = []
    for change in changes:
        name, _, text = change.partition("=")
        if name in rows:
            own[name] = text if "allowed" in rows[name] else number_of(change)
        elif name in theirs:
            of_phantom.append(change)
        else:
            near = nearest(name, [*rows, *theirs])
            hint = f"did you mean {near}?" if near else "config/parts.yaml lists all"
            raise CapsuleError(f"the parts have no value {name}; {hint}")
    unchanged = read_phantom(DEFAULT_TABLE, [])
    phantom = with_values(unchanged, dict(map(parsed, of_phantom)))
    # It uses the library of the solids.
    from capsule.parts.refusals import check_design

    design = design_of(table, own, phantom, unchanged)
    check_design(design)
    return design


def read_sensors() -> int:
    """Read the number of substructures of a capsule."""
    sensors: int = read_settings(config_file())["recording"]["sensors"]
    return sensors
