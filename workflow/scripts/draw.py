"""Draw figures for one and for two columns, with their data as CSV."""

import argparse
import json
from pathlib import Path

from capsule.figures.inputs import make_drawing
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, render_figure
from edges import files
from edges.figure_inputs import StoredResults


def main() -> None:
    """Read the tables and templates, write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--paper", type=Path, required=True, help="paper.yaml")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--figures", nargs="+", required=True, help="names of figures")
    parser.add_argument("--kind", choices=("svg", "pdf"), required=True, help="format of the files")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of figures")
    arguments = parser.parse_args()
    output, kind = arguments.output, arguments.kind
    inputs = StoredResults(arguments.results, arguments.paper, arguments.settings)
    for name in arguments.figures:
        table, draw = make_drawing(name, inputs)
        with files.write_whole(output / f"{name}.csv") as stream:
            table.to_csv(stream, index=False, lineterminator="\n")
        for width, suffix in ((PAGE_WIDTH_IN, ""), (COLUMN_WIDTH_IN, "_column")):
            content = render_figure(draw(width), kind, name + suffix)
            with files.write_whole(output / f"{name}{suffix}.{kind}", "wb") as stream:
                stream.write(content)
        print(f"{name}: {len(table)} rows of data")


if __name__ == "__main__":
    files.run(main)
