"""Draw figures in the widths of one and of two columns, with their data as CSV."""

import argparse
import json
from functools import partial
from pathlib import Path

from capsule.engine.jobs import run
from capsule.figures.files import write_figure
from capsule.figures.inputs import FigureInputs
from capsule.figures.registry import FIGURES
from capsule.store.results import Results


def main() -> None:
    """Read what the figures show, and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="labelled.csv")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--kind", choices=("svg", "pdf"), required=True, help="format of the files")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of figures")
    arguments = parser.parse_args()
    results = Results.of_table(arguments.results, arguments.recordings)
    inputs = FigureInputs(results, arguments.settings)
    draw = partial(write_figure, inputs=inputs, kind=arguments.kind, folder=arguments.output)
    print("\n".join(map(draw, FIGURES)))


if __name__ == "__main__":
    run(main)
