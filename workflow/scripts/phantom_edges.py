"""What the scripts about the phantom share: their common arguments and the detector's settings."""

import argparse
from pathlib import Path

import yaml

from capsule.phantom.trial import Detector
from simulate import DEFAULT_TABLE

DEFAULT_CONFIG = Path(__file__).resolve().parents[2] / "config" / "config.yaml"


def phantom_arguments() -> argparse.ArgumentParser:
    """Return a parser of the arguments that choose phantom and detector."""
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
    parser.add_argument(
        "--config",
        type=Path,
        default=DEFAULT_CONFIG,
        help="the detector's settings (default: config/config.yaml)",
    )
    return parser


def detector_of(config: Path) -> Detector:
    """Read the detector's settings from the project's config."""
    settings = yaml.safe_load(config.read_text(encoding="utf-8"))
    return Detector(settings["preprocessing"], settings["fit"])
