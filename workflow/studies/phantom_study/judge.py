"""Compare the phantom with the paper's table, over independent archives and with the full fit."""

import argparse
import functools
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from capsule.commands.options import natural
from capsule.phantom.files import read_phantom
from capsule.store import files
from phantom_study import paper_table
from phantom_study.paper_table import read_paper_table
from phantom_study.simulated_archive import quick, read_detector, simulate_and_judge


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this study."""
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--archives", default=20, help="number of simulated archives (default: 20)")
    add("--runs", default=20, help="runs of each size in an archive (default: 20)")
    add("--jobs", default=1, help="parallel processes (default: 1)")
    seed = "random seed of the first archive (default: 10001)"
    add("--first-seed", type=int, default=10_001, help=seed)
    parser.add_argument("--quick", action="store_true", help="use the short fits of calibrate")
    output = "output: the cells of the table, CSV"
    parser.add_argument("--output", type=Path, metavar="FILE", help=output)


def run(arguments: argparse.Namespace) -> None:
    """Write the paper's value, the mean and the central 95 % of each cell."""
    phantom = read_phantom(arguments.parameters, arguments.changes, arguments.bench)
    detector, paper = read_detector(arguments.config), read_paper_table()
    detector = quick(detector) if arguments.quick else detector
    judge = functools.partial(simulate_and_judge, phantom, detector, paper, arguments.runs)
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.archives)
    tables, motions = [], []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for confusion, motion in pool.map(judge, seeds):
            tables.append(confusion)
            motions.append(motion)
            rows = paper_table.summary([paper_table.cells(each, paper) for each in tables], paper)
            if arguments.output:
                # The table is written after each archive, so that an interrupted study still has a
                # result from fewer archives.
                files.write_csv(arguments.output, list(rows[0]), rows)
            print(f"\rarchive {len(tables)} of {arguments.archives}", end="", file=sys.stderr)
    print(file=sys.stderr)
    print_cells(rows)
    for name in paper.motion:
        print(f"{name}: {np.mean([motion[name] for motion in motions]):.1f} %")
    print("mean confusion table, rows true 0..5 mm:")
    print(np.round(np.mean(tables, axis=0), 1))


def print_cells(rows: Sequence[dict]) -> None:
    """Print the cells from `paper_table.summary`, and the mean difference from the paper."""
    print(f"{'cell, %':22}{'paper':>7}{'mean':>7}{'central 95 %':>15}")
    for row in rows:
        remark = "" if row["inside"] else "  the paper's value is outside"
        print(
            f"{row['cell']:22}{row['paper']:7.1f}{row['mean']:7.1f}"
            f"{row['low']:9.1f}{row['high']:6.1f}{remark}"
        )
    print(f"mean absolute difference of the means: {paper_table.mean_difference(rows):.1f} points")
