"""Search for the phantom's free parameters, so that the paper's detector gives the paper's table.

The search covers every parameter with a range in the table. It starts in the middle of each range
and does not use the present values. One trial is one simulated archive of 120 runs with short fits.
All candidates of a generation use the same archives. After the last generation, the search draws
finalists and tries them on further archives. The log keeps all trials: the search simulates none of
them again, so an interrupted search continues. The same seed gives the same winner. The defaults
suit narrow ranges; wide ranges need about twelve generations. Check the winner on new archives with
study_phantom.py judge.
"""

import argparse
import functools
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields
from pathlib import Path

import numpy as np
import yaml

from capsule import files
from capsule.arguments import natural
from capsule.phantom.files import bench_file, read_phantom
from capsule.phantom.parameters import bench_parts, rewritten
from phantom_study import simulated_archive, trials
from phantom_study.arguments import read_detector, read_paper_table
from phantom_study.calibration import Calibration, Plan, winner
from phantom_study.search import free_parameters
from phantom_study.trial_log import TrialLog


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this study."""
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--generations", default=1, help="number of generations (default: 1)")
    add("--candidates", default=24, help="candidates in a generation (default: 24)")
    add("--archives", default=3, help="simulated archives for each candidate (default: 3)")
    add("--finalists", default=10, help="candidates in the final (default: 10)")
    add("--final-archives", default=20, help="simulated archives for each finalist (default: 20)")
    add("--jobs", default=1, help="parallel processes (default: 1)")
    add = functools.partial(parser.add_argument, metavar="X", type=float)
    add("--spread", default=0.2, help="first spread, as a share of each range (default: 0.2)")
    share = "share of the way to each generation's best, 0 to 1 (default: 0.5)"
    add("--rate", default=0.5, help=share)
    add = functools.partial(parser.add_argument, metavar="FILE", type=Path, required=True)
    add("--log", help="CSV file of the trials; an existing file is continued")
    add("--output", help="output: the table with the winner's values")
    parser.add_argument("--seed", metavar="N", type=int, default=1, help="random seed (default: 1)")


def run(arguments: argparse.Namespace) -> None:
    """Run the search, print its progress, and write the winner."""
    phantom = read_phantom(arguments.parameters, arguments.changes, arguments.bench)
    # For a bench, the search uses the ranges in its file, and the output is a copy of this file.
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
                f"generation {number} of {plan.generations}: difference from the paper, in spreads:"
                f" median {np.median(generation.losses):.2f},"
                f" centre {generation.losses[0]:.2f}",
                flush=True,
            )
        finalists = []
        for finalist in calibration.finalists(generation.cloud):
            finalists.append(finalist)
            print(
                f"{finalist.stage}: difference from the paper: worst cell {finalist.worst:.2f}"
                f" spreads, mean of all cells {finalist.difference:.1f} points",
                flush=True,
            )
    with files.write_whole(arguments.output) as stream:
        stream.write(rewritten(table, winner(finalists).values))
