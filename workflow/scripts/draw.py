"""Draw figures in the widths of one and of two columns, with their data as CSV."""

import argparse
import json
from pathlib import Path

from edges import files
from edges.figure_files import write_figures
from edges.figure_inputs import StoredResults


def main() -> None:
    """Read what the figures show, and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--paper", type=Path, required=True, help="paper.yaml")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--figures", nargs="+", required=True, help="names of figures")
    parser.add_argument("--kind", choices=("svg", "pdf"), required=True, help="format of the files")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of figures")
    arguments = parser.parse_args()
    inputs = StoredResults(arguments.results, arguments.paper, arguments.settings)
    write_figures(arguments.figures, inputs, arguments.kind, arguments.output)


if __name__ == "__main__":
    files.run(main)
