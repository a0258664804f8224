"""Judge the phantom: the paper's table over independent archives, with the paper's full fit."""

import argparse
import functools
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from capsule.phantom.parameters import Phantom
from edges import files
from edges.phantom import read_phantom
from phantom_study import paper_table, simulated_archive
from phantom_study.arguments import detector_of


def judge(
    phantom: Phantom, detector: simulated_archive.Detector, runs: int, seed: int
) -> tuple[np.ndarray, dict[str, float]]:
    """Return the table of one archive, and how its capsule moves."""
    archive = simulated_archive.simulate_archive(phantom, seed, runs)
    matrices = simulated_archive.archive_matrices(archive, detector)
    return simulated_archive.resubstitution(matrices, detector), simulated_archive.archive_motion(
        archive, phantom
    )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what this study takes."""
    parser.add_argument("--archives", type=int, default=20, help="default: 20")
    parser.add_argument("--runs", type=int, default=20, help="of each size (default: 20)")
    parser.add_argument(
        "--first-seed", type=int, default=10_001, help="of the archives (default: 10001)"
    )
    parser.add_argument("--quick", action="store_true", help="the search's cheap fit")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default: 1)")
    parser.add_argument("--output", type=Path, help="CSV file of the cells")


def run(arguments: argparse.Namespace) -> None:
    """Write each cell's paper value, mean and central 95 %."""
    phantom = read_phantom(arguments.parameters, arguments.changes)
    detector = detector_of(arguments.config)
    detector = simulated_archive.quick(detector) if arguments.quick else detector
    judging = functools.partial(judge, phantom, detector, arguments.runs)
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.archives)
    tables, motions = [], []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for table, motion in pool.map(judging, seeds):
            tables.append(table)
            motions.append(motion)
            rows = paper_table.summary([paper_table.cells(each) for each in tables])
            if arguments.output:
                # After each archive: an interrupted judgement is still one over fewer archives.
                files.write_csv(arguments.output, list(rows[0]), rows)
            print(f"\rarchive {len(tables)} of {arguments.archives}", end="", file=sys.stderr)
    print(f"\n{'cell, %':22}{'paper':>7}{'mean':>7}{'central 95 %':>15}")
    for row in rows:
        remark = "" if row["inside"] else "  the paper's value is outside"
        print(
            f"{row['cell']:22}{row['paper']:7.1f}{row['mean']:7.1f}"
            f"{row['low']:9.1f}{row['high']:6.1f}{remark}"
        )
    print(f"mean absolute difference of the means: {paper_table.mean_difference(rows):.1f} points")
    for name in paper_table.MOTION:
        print(f"{name}: {np.mean([motion[name] for motion in motions]):.1f} %")
    print("mean confusion table, rows true 0..5 mm:")
    print(np.round(np.mean(tables, axis=0), 1))
