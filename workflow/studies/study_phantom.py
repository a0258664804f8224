"""Study the phantom: find its parameters, compare it with the paper's table, draw its figures."""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from phantom_study import calibrate, draw, judge
from phantom_study.simulated_archive import DEFAULT_CONFIG

from capsule.engine.jobs import run
from capsule.phantom.files import add_phantom_arguments

STUDIES = {"calibrate": calibrate, "judge": judge, "draw": draw}


def build_parser() -> argparse.ArgumentParser:
    """Return the parser, with a subcommand for each study."""
    parser = argparse.ArgumentParser(description=__doc__)
    studies = parser.add_subparsers(dest="study", required=True, metavar="STUDY")
    for name, module in STUDIES.items():
        summary = module.__doc__.partition("\n")[0]
        study = studies.add_parser(name, description=module.__doc__, help=summary)
        add_phantom_arguments(study)
        study.add_argument(
            "--config",
            type=Path,
            default=DEFAULT_CONFIG,
            metavar="FILE",
            help="the detector's settings (default: config/config.yaml)",
        )
        module.add_arguments(study)
    return parser


def main() -> None:
    """Run the named study."""
    arguments = build_parser().parse_args()
    STUDIES[arguments.study].run(arguments)


if __name__ == "__main__":
    run(main)
