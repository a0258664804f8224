"""Draw the figures of the design of the capsule and the bench; these figures show no results."""

import argparse
import json
from pathlib import Path
from types import SimpleNamespace

from edges import files
from edges.figure_files import write_figures
from edges.part_tables import shipped_design


def main() -> None:
    """Read the tables of the design, and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--figures", nargs="+", required=True, help="names of figures")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of figures")
    arguments = parser.parse_args()
    inputs = SimpleNamespace(settings=arguments.settings, design=shipped_design())
    write_figures(arguments.figures, inputs, "svg", arguments.output)


if __name__ == "__main__":
    files.run(main)
