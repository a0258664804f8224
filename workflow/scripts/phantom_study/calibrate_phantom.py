"""Search for the phantom's free parameters, so that the paper's detector gives the paper's table.

Every parameter with a range in the table is searched for, from the middle of its range on; its
present value plays no part. One trial is one simulated archive of 120 runs with cheap fits, and
each candidate has some. Where the search ends, finalists are drawn and meet on further archives;
a second round of them would lie around the winner of the first. All trials are appended to the log;
what it holds already is not simulated again, so a search that was interrupted goes on. The same
seed gives the same winner. The defaults settle a range that is narrow already; for wide ones ask
for a dozen generations. Then the study ``judge`` judges the winner on archives
that it has never seen.
"""

import argparse
import csv
import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import yaml

from capsule.errors import CapsuleError
from capsule.phantom.parameters import rewritten
from edges import files
from edges.phantom import read_phantom
from phantom_study import search, simulated_archive, trials
from phantom_study.arguments import detector_of


class TrialLog:
    """The trials of a search in a CSV file: looked up where they are known, made where not."""

    def __init__(self, path: Path, attempt: Callable[[Mapping, int], dict], jobs: int) -> None:
        self.path, self.attempt, self.pool = path, attempt, ProcessPoolExecutor(jobs)
        self.known = files.read_csv(path) if path.exists() else []

    def trials(self, stage: str, values: Sequence[Mapping], seeds: Sequence[int]) -> list[dict]:
        """Give the trials of one stage, one for each of the values and its seed."""
        logged = [row for row in self.known if row["stage"] == stage]
        wanted = [(str(s), *map(str, v.values())) for v, s in zip(values, seeds, strict=True)]
        for row, keys in zip(logged, wanted, strict=False):
            if (row["archive_seed"], *(row[name] for name in values[0])) != keys:
                raise CapsuleError(
                    f"{self.path}: {stage} has other candidates than this search; choose another"
                    " --log, or the seed and ranges that it was made with"
                )
        rest = len(logged)
        made = self.pool.map(self.attempt, values[rest:], seeds[rest:])
        return logged + [self.append({"stage": stage} | row) for row in made]

    def append(self, row: dict) -> dict:
        """Append a row to the file."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, list(row), lineterminator="\n")
            if stream.tell() == 0:
                writer.writeheader()
            writer.writerow(row)
        return row


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what this study takes."""
    parser.add_argument("--generations", type=int, default=1, help="default: 1")
    parser.add_argument("--candidates", type=int, default=24, help="a generation (default: 24)")
    parser.add_argument("--finalists", type=int, default=10, help="default: 10")
    parser.add_argument("--archives", type=int, default=3, help="a candidate (default: 3)")
    parser.add_argument("--finals", type=int, default=1, help="rounds, each closer (default: 1)")
    parser.add_argument("--final-archives", type=int, default=20, help="a finalist (default: 20)")
    parser.add_argument("--spread", type=float, default=0.2, help="of the first (default: 0.2)")
    parser.add_argument("--rate", type=float, default=0.5, help="of movement (default: 0.5)")
    parser.add_argument("--seed", type=int, default=1, help="default: 1")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default: 1)")
    parser.add_argument("--log", type=Path, required=True, help="CSV file of the trials")
    parser.add_argument("--output", type=Path, required=True, help="table with the winner's values")


def run(arguments: argparse.Namespace) -> None:
    """Move a cloud of candidates, generation by generation, and let finalists compete."""
    phantom = read_phantom(arguments.parameters, arguments.changes)
    text = arguments.parameters.read_text(encoding="utf-8")
    detector = simulated_archive.quick(detector_of(arguments.config))
    free = search.free_parameters(yaml.safe_load(text))
    attempt = functools.partial(trials.try_out, phantom, detector)
    log = TrialLog(arguments.log, attempt, arguments.jobs)

    def losses_of(candidates: Sequence[Mapping], number: int) -> list[float]:
        seeds = trials.generation_seeds(arguments.seed, number, arguments.archives)
        met = [values for values in candidates for _ in seeds]
        rows = log.trials(f"generation {number + 1}", met, seeds * len(candidates))
        return [
            trials.mean_distance(rows[start : start + len(seeds)])
            for start in range(0, len(rows), len(seeds))
        ]

    generations = search.evolve(
        free,
        losses_of,
        functools.partial(trials.candidate_numbers, arguments.seed),
        candidates=arguments.candidates,
        spread=arguments.spread,
        rate=arguments.rate,
    )
    for number, step in enumerate(itertools.islice(generations, arguments.generations), start=1):
        print(
            f"generation {number} of {arguments.generations}: off by {np.median(step.losses):.2f}"
            f" spreads in the middle, {step.losses[0]:.2f} at the centre",
            flush=True,
        )
    cloud = step.cloud
    for final in range(arguments.finals):
        numbers = trials.candidate_numbers(arguments.seed, arguments.generations + final)
        seeds = trials.finalist_seeds(arguments.seed, final, arguments.final_archives)
        results = []
        for place, where in enumerate(cloud.draw(numbers, arguments.finalists), start=1):
            values = search.values_at(free, where)
            stage = f"final {final + 1} candidate {place}"
            rows = log.trials(stage, [values] * len(seeds), seeds)
            results.append((*trials.shortfall(rows), place, where, values))
            worst, difference, *_ = results[-1]
            print(
                f"{stage}: the worst cell off by {worst:.2f} spreads, all by {difference:.1f}"
                " points",
                flush=True,
            )
        *_, where, winner = min(results, key=lambda result: result[:3])
        cloud = trials.closer(cloud, where)
    with files.write_whole(arguments.output) as stream:
        stream.write(rewritten(text, winner))
