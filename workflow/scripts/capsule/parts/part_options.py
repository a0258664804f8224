"""Read the options of `make_parts.py`, and the design that they describe."""

import argparse
import difflib
from collections.abc import Callable
from pathlib import Path

from capsule.configuration_files import read_config_file
from capsule.errors import CapsuleError
from capsule.parts.design import LIMITS, Design, design_of, entries
from capsule.parts.files import read_parts_table
from capsule.parts.part import Part
from capsule.parts.refusals import check_design
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.project import CONFIG

_NOZZLE = "print.nozzle_mm"


def read_arguments(description: str | None) -> argparse.Namespace:
    """Read the command line: the changes of the design and the output folder."""
    parser = argparse.ArgumentParser(description=description)
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
    add("--step", action="store_true", help="also write STEP (needs the extra [cad])")
    return parser.parse_args()


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
    own: dict[str, str | float] = {}
    of_phantom = []
    for change in changes:
        name, _, text = change.partition("=")
        if name in rows:
            own[name] = text if "allowed" in rows[name] else _number(change, text)
        elif name in table[LIMITS]:
            _number(change, text)
            of_phantom.append(change)
        else:
            known = [*rows, *table[LIMITS]]
            nearest = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
            raise CapsuleError(f"there is no value {name}; did you mean {nearest[0]}?")
    unchanged = read_phantom(DEFAULT_TABLE, [])
    design = design_of(table, own, read_phantom(DEFAULT_TABLE, of_phantom), unchanged)
    check_design(design)
    return design


def step_writer() -> Callable[[Part], bytes]:
    """Return the function that writes a part as STEP; only this function imports its large library.

    Raises
    ------
    CapsuleError
        The library is not installed; the message names the extra.
    """
    try:
        from capsule.parts.step_files import step_bytes
    except ModuleNotFoundError as error:
        # Older releases of the library lack some of these modules.
        if (error.name or "").partition(".")[0] != "OCP":
            raise
        raise CapsuleError(
            '--step needs the extra [cad]; run: pip install "cadquery-ocp-novtk>=8.0,<9"'
        ) from None
    return step_bytes


def read_sensors() -> int:
    """Read the number of substructures of a capsule."""
    sensors: int = read_config_file(CONFIG / "config.yaml")["recording"]["sensors"]
    return sensors


def _number(change: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise CapsuleError(
            f"--set {change}: write part.name=number, such as origami.fold_angle_deg=40"
        ) from None
