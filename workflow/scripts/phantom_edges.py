"""What the scripts about the phantom share: its table, their arguments, the detector's settings."""

import argparse
from pathlib import Path

import yaml

from capsule.errors import CapsuleError
from capsule.phantom import trial
from capsule.phantom.parameters import Phantom, phantom_from_table, with_values

_CONFIG = Path(__file__).resolve().parents[2] / "config"
DEFAULT_TABLE = _CONFIG / "phantom.yaml"
DEFAULT_CONFIG = _CONFIG / "config.yaml"


def read_phantom(table: Path, changes: list[str]) -> Phantom:
    """Read the table of parameters and apply the changes ``part.parameter=value``."""
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


def detector_arguments() -> argparse.ArgumentParser:
    """Return a parser of the arguments that choose phantom and detector."""
    parser = argparse.ArgumentParser(add_help=False, parents=[phantom_arguments()])
    parser.add_argument(
        "--config",
        type=Path,
        default=DEFAULT_CONFIG,
        help="the detector's settings (default: config/config.yaml)",
    )
    return parser


def detector_of(config: Path) -> trial.Detector:
    """Read the detector's settings from the project's config."""
    settings = yaml.safe_load(config.read_text(encoding="utf-8"))
    return trial.Detector(settings["preprocessing"], settings["fit"])
