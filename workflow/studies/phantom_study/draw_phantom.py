"""Draw the figures of the phantom's documentation, and compute their data.

The study draws three figures as SVG. phantom-signals shows simulated runs. phantom-table shows the
output of study_phantom.py judge. phantom-sensitivity shows how the rates change with the bench. The
data of the first and the last figure are also written as CSV.
"""

import argparse
import functools
import sys
from pathlib import Path

from matplotlib.figure import Figure

from capsule import files
from capsule.arguments import natural
from capsule.phantom.files import read_phantom
from phantom_study import description, drawings, sensitivity, simulated_archive
from phantom_study.arguments import read_detector, read_paper_table

# Sizes of the signals that are shown. One more size would make the page too wide.
SHOWN_MM = (0, 2, 3, 4, 5)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this study."""
    parser.add_argument(
        "--table",
        type=Path,
        required=True,
        metavar="FILE",
        help="the cells, from the output of judge",
    )
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--archives", default=5, help="archives at each level of a disturbance (default: 5)")
    add("--runs", default=20, help="runs of each size in such an archive (default: 20)")
    parser.add_argument(
        "--seed",
        metavar="N",
        type=int,
        default=1,
        help="random seed of the signals shown (default: 1)",
    )
    parser.add_argument(
        "--output", type=Path, required=True, metavar="FOLDER", help="output: folder of the figures"
    )


def run(arguments: argparse.Namespace) -> None:
    """Write the figures and the tables."""
    drawings.repeatable()
    phantom = read_phantom(arguments.parameters, arguments.changes, arguments.bench)
    detector, paper = read_detector(arguments.config), read_paper_table()

    archive = simulated_archive.simulate_archive(phantom, arguments.seed, paper.runs)
    matrices = simulated_archive.archive_matrices(archive, detector)
    window = detector.preprocessing["window"]
    examples = description.examples(archive, matrices, SHOWN_MM, window)
    save(drawings.signals(examples), arguments.output / "phantom-signals.svg")
    templates = simulated_archive.learn(matrices, detector)
    rows = description.describe(archive, matrices, templates, phantom)
    files.write_csv(arguments.output / "phantom-signals.csv", list(rows[0]), rows)

    cells = drawings.cells(files.read_csv(arguments.table))
    save(cells, arguments.output / "phantom-table.svg")

    rows, quick = [], simulated_archive.quick(detector)
    for row in sensitivity.sweep(phantom, quick, paper, arguments.archives, arguments.runs):
        rows.append(row)
        print(f"\rsensitivity: {row['variation']} {row['level']}  ", end="", file=sys.stderr)
    print(file=sys.stderr)
    files.write_csv(arguments.output / "phantom-sensitivity.csv", list(rows[0]), rows)
    save(drawings.sensitivity(rows), arguments.output / "phantom-sensitivity.svg")


def save(figure: Figure, path: Path) -> None:
    """Write a figure as SVG without a date, so that the same figure gives the same bytes."""
    with files.write_whole(path) as stream:
        figure.savefig(stream, format="svg", metadata={"Date": None})
