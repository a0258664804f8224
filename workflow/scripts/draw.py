"""Draw figures in the widths of one and of two columns, with their data as CSV."""

import argparse
import json
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from capsule.engine.jobs import run
from capsule.figures.inputs import FigureInputs
from capsule.figures.registry import FIGURES
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, Drawing, render_figure
from capsule.store import files
from capsule.store.results import Results

# By the end of a file's name. The page shows the wider drawing.
WIDTHS_IN = {
    "svg": {"": PAGE_WIDTH_IN},
    "pdf": {"": PAGE_WIDTH_IN, "_column": COLUMN_WIDTH_IN},
}


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
    for name in FIGURES:
        print(write_figure(name, inputs, arguments.kind, arguments.output))


def write_figure(name: str, inputs: FigureInputs, kind: str, folder: Path) -> str:
    """Draw one of `FIGURES`, write it with its data, and return a line for the log."""
    module = import_module(FIGURES[name])
    make: Callable[[FigureInputs], Drawing] = getattr(module, f"{name}_drawing")
    table, draw = make(inputs)
    with files.write_whole(folder / f"{name}.csv") as stream:
        table.to_csv(stream, index=False, lineterminator="\n")
    for suffix, width_in in WIDTHS_IN[kind].items():
        picture = render_figure(draw(width_in), kind, name + suffix)
        with files.write_whole(folder / f"{name}{suffix}.{kind}", "wb") as stream:
            stream.write(picture)
    return f"{name}: {len(table)} rows of data"


if __name__ == "__main__":
    run(main)
