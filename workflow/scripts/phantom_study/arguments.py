"""The arguments that all studies of the phantom take: which phantom, and which detector."""

import argparse
from pathlib import Path

import yaml

from edges.phantom import CONFIG, phantom_arguments
from phantom_study import simulated_archive

DEFAULT_CONFIG = CONFIG / "config.yaml"


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


def detector_of(config: Path) -> simulated_archive.Detector:
    """Read the detector's settings from the project's config."""
    settings = yaml.safe_load(config.read_text(encoding="utf-8"))
    return simulated_archive.Detector(settings["preprocessing"], settings["fit"])
