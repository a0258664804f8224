"""Make the parts of capsule and bench to print: meshes, outlines, drawings and lists, in mm."""

import argparse
from pathlib import Path

from capsule.engine.project import not_installed

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
    nozzle = [] if arguments.nozzle is None else [f"{_NOZZLE}={arguments.nozzle}"]
    # Only here, the command imports its large libraries.
    try:
        from capsule.parts.files import read_design, write_parts

        design = read_design([*arguments.changes, *nozzle])
        count = write_parts(design, arguments.out, step=arguments.step)
    except ModuleNotFoundError as error:
        # Older releases of Open CASCADE lack some of its modules.
        package = (error.name or "").partition(".")[0]
        if package not in _MISSING:
            raise
        raise _MISSING[package] from None
    print(f"{count} parts in {arguments.out}/")
