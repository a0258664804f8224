"""Arguments and inputs of all studies of the phantom: phantom, detector, the paper's numbers."""

import argparse
from pathlib import Path

import yaml

from capsule.configuration import read_config_file
from capsule.phantom.files import add_phantom_arguments
from capsule.project import CONFIG
from phantom_study.paper_table import PaperTable
from phantom_study.simulated_archive import DetectorSettings

DEFAULT_CONFIG = CONFIG / "config.yaml"
PRINTED = CONFIG.parent / "workflow" / "report" / "paper.yaml"


def detector_arguments() -> argparse.ArgumentParser:
    """Return a parser of the arguments that choose phantom and detector."""
    parser = argparse.ArgumentParser(add_help=False)
    add_phantom_arguments(parser)
    parser.add_argument(
        "--config",
        type=Path,
        default=DEFAULT_CONFIG,
        metavar="FILE",
        help="the detector's settings (default: config/config.yaml)",
    )
    return parser


def read_detector(config: Path) -> DetectorSettings:
    """Read the settings of the paper's detector from the project's configuration."""
    settings = read_config_file(config)
    return DetectorSettings(settings["preprocessing"], settings["fit"])


def read_paper_table() -> PaperTable:
    """Read the numbers that the paper prints."""
    return PaperTable.from_printed(yaml.safe_load(PRINTED.read_text(encoding="utf-8")))
