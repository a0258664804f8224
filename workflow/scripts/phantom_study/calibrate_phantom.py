"""Search for the phantom's free parameters, so that the paper's detector gives the paper's table.

Every parameter with a range in the table is searched for, from the middle of its range on; its
present value plays no part. One trial is one simulated archive of 120 runs with cheap fits. All
candidates of a generation meet the same archives; where the search ends, finalists are drawn and
meet on further ones. All trials are appended to the log; what it holds already is not simulated
again, so a search that was interrupted goes on. The same seed gives the same winner. The defaults
settle a range that is narrow already; for wide ones ask for a dozen generations. Then let
study_phantom.py judge try the winner on archives that it has never met.
"""

import argparse
import functools
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields
from pathlib import Path

import numpy as np
import yaml

from capsule.phantom.parameters import bench_parts, rewritten
from edges import files
from edges.phantom import bench_file, natural, read_phantom
from phantom_study import simulated_archive, trials
from phantom_study.arguments import read_detector, read_paper_table
from phantom_study.calibration import Calibration, Plan, winner
from phantom_study.search import free_parameters
from phantom_study.trial_log import TrialLog


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what this study takes."""
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--generations", default=1, help="number of generations (default: 1)")
    add("--candidates", default=24, help="candidates in a generation (default: 24)")
    add("--archives", default=3, help="archives that each candidate meets (default: 3)")
    add("--finalists", default=10, help="candidates in the final (default: 10)")
    add("--final-archives", default=20, help="archives that each finalist meets (default: 20)")
    add("--jobs", default=1, help="processes that work at the same time (default: 1)")
    add = functools.partial(parser.add_argument, metavar="X", type=float)
    add("--spread", default=0.2, help="of the first cloud, in parts of the ranges (default: 0.2)")
    add("--rate", default=0.5, help="of a generation towards its best, 0..1 (default: 0.5)")
    add = functools.partial(parser.add_argument, metavar="FILE", type=Path, required=True)
    add("--log", help="CSV file of the trials; it is made, or gone on with")
    add("--output", help="output: the table with the winner's values")
    parser.add_argument(
        "--seed", metavar="N", type=int, default=1, help="of all that is drawn (default: 1)"
    )


def run(arguments: argparse.Namespace) -> None:
    """Run the search, say how it goes, and write the winner."""
    phantom = read_phantom(arguments.parameters, arguments.changes, arguments.bench)
    # A bench's own ranges are searched, and its file is what the winner is written into.
    source = bench_file(arguments.bench) if arguments.bench else arguments.parameters
    table = source.read_text(encoding="utf-8")
    free = free_parameters(bench_parts(yaml.safe_load(table)))
    detector = simulated_archive.quick(read_detector(arguments.config))
    paper = read_paper_table()
    plan = Plan(**{field.name: getattr(arguments, field.name) for field in fields(Plan)})
    try_out = functools.partial(trials.try_out, phantom, detector, paper)
    with ProcessPoolExecutor(arguments.jobs) as pool:
        log = TrialLog(arguments.log, functools.partial(pool.map, try_out))
        calibration = Calibration(free, log, paper, plan)
        for number, generation in enumerate(calibration.generations(), start=1):
            print(
                f"generation {number} of {plan.generations}: off by"
                f" {np.median(generation.losses):.2f} spreads in the middle,"
                f" {generation.losses[0]:.2f} at the centre",
                flush=True,
            )
        finalists = []
        for finalist in calibration.finalists(generation.cloud):
            finalists.append(finalist)
            print(
                f"{finalist.stage}: the worst cell off by {finalist.worst:.2f} spreads, all by"
                f" {finalist.difference:.1f} points",
                flush=True,
            )
    with files.write_whole(arguments.output) as stream:
        stream.write(rewritten(table, winner(finalists).values))
