"""The table of the phantom's parameters, and the arguments of the commands that simulate."""

import argparse
from pathlib import Path

import yaml

from capsule.errors import CapsuleError
from capsule.phantom.parameters import Phantom, phantom_from_table, with_values

CONFIG = Path(__file__).resolve().parents[3] / "config"
DEFAULT_TABLE = CONFIG / "phantom.yaml"


def natural(text: str) -> int:
    """Read a whole number of at least 1."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is less than 1")
    return value


def read_phantom(table: Path, changes: list[str]) -> Phantom:
    """Read the table of parameters and apply the changes ``part.parameter=value``.

    Raises
    ------
    CapsuleError
        The table or a change cannot be used; the text names it.
    """
    try:
        phantom = phantom_from_table(yaml.safe_load(table.read_text(encoding="utf-8")))
    except (yaml.YAMLError, CapsuleError) as error:
        raise CapsuleError(f"{table}: {error}") from error
    values = {}
    for change in changes:
        name, _, text = change.partition("=")
        try:
            values[name] = float(text)
        except ValueError:
            raise CapsuleError(
                f"--set {change}: write part.parameter=number, such as sensor.noise=0.01"
            ) from None
    return with_values(phantom, values)


def phantom_arguments() -> argparse.ArgumentParser:
    """Return a parser of the arguments that choose the phantom."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument(
        "--parameters",
        type=Path,
        default=DEFAULT_TABLE,
        metavar="FILE",
        help="table of the phantom's parameters (default: config/phantom.yaml)",
    )
    parser.add_argument(
        "--set",
        dest="changes",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="change a parameter, such as sensor.noise=0.01; may be repeated",
    )
    return parser
