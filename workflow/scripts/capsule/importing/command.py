"""Write recordings from other programs' files into raw/."""

import argparse
from pathlib import Path
from typing import Any

from capsule.arguments import recording_name, size_folder
from capsule.importing.import_run import Importer, tell
from capsule.importing.lab_yaml import lab_schema
from capsule.project import config_file

_TYPES = {"number": float, "integer": int}

EXAMPLES = """
examples:
  %(prog)s monday/*.csv --size 3          guess the format, and write lab.yaml
  %(prog)s tuesday/*.csv --size 0 --map lab.yaml
  %(prog)s log.txt --size 3 --dry-run     only show what would be done
  %(prog)s patient.xlsx --unlabelled --sheet "Run 2" --unit V

exit status:
  0 every file was imported, or was in the archive   1 a file was refused   2 wrong option
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options; each key of lab.yaml is one."""
    parser.epilog = EXAMPLES
    add = parser.add_argument
    add(
        "files",
        nargs="*",
        type=Path,
        metavar="FILE",
        help="text, CSV, .csv.gz, .npy, .mat, .xlsx, HDF5, NWB, "
        "TDMS, XDF or .bag file, or the folder of a bag of ROS 2",
    )
    condition = parser.add_mutually_exclusive_group(required=True)
    condition.add_argument(
        "--size", type=size_folder, metavar="MM", help="nodule size of these runs; 0: no nodule"
    )
    condition.add_argument("--unlabelled", action="store_true", help="runs whose nodule is unknown")
    add("--map", type=Path, metavar="FILE", help="lab.yaml, which describes these files")
    add(
        "--write-map",
        type=Path,
        default=Path("lab.yaml"),
        metavar="FILE",
        help="file for the guessed description (default: %(default)s)",
    )
    add("--name", type=recording_name, help="name of the recording (default: the file's)")
    add("--dry-run", action="store_true", help="show what would be done, and write nothing")
    add("--raw", type=Path, default=Path("raw"), help="archive (default: raw/)")
    add(
        "--config",
        type=Path,
        default=config_file(),
        help="the workflow's configuration (default: config/config.yaml here, or the shipped one)",
    )
    keys = parser.add_argument_group("keys of lab.yaml; an option overrides the file")
    for key, part in lab_schema()["properties"].items():
        _add_key(keys, key, part)


def main(arguments: argparse.Namespace) -> int:
    """Import the given files and print their number; return 1 if a file was refused."""
    importer = Importer(arguments)
    importer.run()
    tell(importer.summary())
    return int(importer.refused > 0)


def _add_key(group: argparse._ArgumentGroup, key: str, part: dict[str, Any]) -> None:
    option, text = f"--{key.replace('_', '-')}", part["description"].replace("%", "%%")
    if part.get("type") == "boolean":
        group.add_argument(option, action="store_true", default=None, help=text)
    elif "enum" in part:
        group.add_argument(option, choices=part["enum"], help=text)
    elif part["type"] == "array":
        word = "TEXT" if key == "missing" else "COLUMN"
        group.add_argument(option, nargs="+", metavar=word, help=text)
    else:
        kind = _TYPES.get(part["type"] if isinstance(part["type"], str) else "", str)
        word = part.get("unit", "COLUMN" if isinstance(part["type"], list) else "X").upper()
        group.add_argument(option, type=kind, metavar=word, help=text)
