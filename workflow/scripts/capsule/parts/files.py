"""Read the design from its tables, and write the files of all parts."""

from collections.abc import Sequence
from pathlib import Path

import yaml

from capsule.engine.configuration import read_settings
from capsule.engine.project import CONFIG, config_file
from capsule.kinds import Settings
from capsule.parts.all_parts import all_parts
from capsule.parts.design import Design, design_of
from capsule.parts.formats import (
    BILL_COLUMNS,
    bill_of_materials,
    dxf_text,
    parts_table,
    profile_text,
    stl_bytes,
    svg_text,
    threemf_bytes,
)
from capsule.parts.refusals import check_design
from capsule.parts.sheets import sheet_files, sheets
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.store import files

PARTS_TABLE = CONFIG / "parts.yaml"


def read_parts_table() -> Settings:
    """Read ``config/parts.yaml``: the choices, and the limits of all values."""
    table: Settings = yaml.safe_load(PARTS_TABLE.read_text(encoding="utf-8"))
    return table


def read_design(changes: Sequence[str] = ()) -> Design:
    """Read all tables, apply changes, and raise an error if the design cannot be made.

    Parameters
    ----------
    changes
        As in `capsule.parts.design.design_of`.

    Raises
    ------
    CapsuleError
        A name is unknown or a value is not allowed; the message names it and its limit.
    """
    sensors = read_settings(config_file())["recording"]["sensors"]
    design = design_of(read_parts_table(), changes, read_phantom(DEFAULT_TABLE, []), sensors)
    check_design(design)
    return design


def write_parts(design: Design, out: Path, *, step: bool = False) -> int:
    """Make all parts, write their files into a folder, and return their number.

    With `step`, their STEP files are among them, which need Open CASCADE.
    """
    if step:
        from capsule.parts.step_files import step_bytes
    parts = all_parts(design)

    def write(name: str, content: str | bytes) -> None:
        data = content.encode() if isinstance(content, str) else content
        with files.write_whole(out / name, "wb") as stream:
            stream.write(data)

    for part in parts:
        write(f"{part.name}.stl", stl_bytes(part))
        write(f"{part.name}.3mf", threemf_bytes(part))
        if step:
            write(f"{part.name}.step", step_bytes(part.name, part.solid))
        if part.cuts:
            write(f"{part.name}.dxf", dxf_text(part))
            write(f"{part.name}.svg", svg_text(part))
    for sheet in sheets(design):
        for kind, content in sheet_files(sheet, design).items():
            write(f"drawings/{sheet.name}.{kind}", content)
    files.write_json(out / "parts.json", parts_table(design, parts))
    files.write_cells(out / "bom.csv", BILL_COLUMNS, bill_of_materials(design, parts))
    write("print-profile.ini", profile_text(design.parts.print))
    return len(parts)
