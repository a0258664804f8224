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
import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from capsule.commands.options import natural
from capsule.errors import CapsuleError
from capsule.phantom.files import bench_file, read_phantom
from capsule.phantom.parameters import Phantom, bench_parts, with_values
from capsule.seeding import generator
from capsule.store import files
from phantom_study import paper_table
from phantom_study.paper_table import PaperTable, read_paper_table
from phantom_study.simulated_archive import (
    DetectorSettings,
    quick,
    read_detector,
    simulate_and_judge,
)

# First seed of the search's archives. The archives that judge the winner have seeds from 10 001 on.
FIRST_SEED = 100_000
# Number of seeds of one search. The finalists' archives use those from `_FINAL_SEED` on.
_SEEDS = 1000
_FINAL_SEED = 500
# Smallest spread, in points. With 20 runs, a rate changes in steps of 5 points, so a mean that is
# closer than this fits.
_LEAST_SPREAD = 1.5


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that is searched for: its ``part.parameter`` and its range.

    If the low end is positive, the search steps in the logarithm of the value.
    """

    name: str
    low: float
    high: float

    def at(self, position: float) -> float:
        """Return the value at a position in the range: 0 is the low end, 1 the high end."""
        if self.low > 0:
            return float(self.low * (self.high / self.low) ** position)
        return float(self.low + (self.high - self.low) * position)


def free_parameters(table: Mapping) -> list[FreeParameter]:
    """Return the parameters with a ``range: [low, high]`` of a table like config/phantom.yaml."""
    return [
        FreeParameter(f"{part}.{key}", *map(float, entry["range"]))
        for part, entries in table.items()
        for key, entry in entries.items()
        if "range" in entry
    ]


@dataclass(frozen=True)
class Cloud:
    """A cloud of candidates: a normal distribution of each parameter's position in its range."""

    centre: np.ndarray  # mean of each position, shape (D,)
    spread: np.ndarray  # standard deviation of each position, shape (D,)

    def draw(self, numbers: np.random.Generator, count: int) -> np.ndarray:
        """Return candidate positions in 0..1, shape (count, D); the first is the centre."""
        steps = numbers.standard_normal((count, self.centre.size))
        positions = self.centre + self.spread * steps
        positions[0] = self.centre
        # The absolute value of mod(x + 1, 2) - 1 folds the line onto 0..1.
        return np.abs(np.mod(positions + 1, 2) - 1)

    def moved(self, candidates: np.ndarray, losses: Sequence[float], rate: float) -> "Cloud":
        """Return the cloud moved towards the best quarter of the candidates.

        Parameters
        ----------
        candidates : (count, D) array
            The positions of the candidates.
        losses
            The loss of each candidate; smaller is better.
        rate
            Share of the way to move, 0..1. Small steps average out the noise of single archives.
        """
        best = candidates[np.argsort(losses)[: max(len(losses) // 4, 2)]]
        # The spread shrinks more slowly than the centre moves, so that chance does not decide too
        # early.
        spread = (1 - rate / 2) * self.spread + rate / 2 * best.std(axis=0)
        return Cloud((1 - rate) * self.centre + rate * best.mean(axis=0), spread)


def search(
    free: Sequence[FreeParameter],
    trials_of: Callable[[str, Sequence[Mapping], Sequence[int]], list[dict]],
    paper: PaperTable,
    plan: argparse.Namespace,
) -> dict[str, float]:
    """Search for the values with which the detector gives the paper's table; print the progress.

    The first cloud lies in the middle of all ranges, so the search does not depend on earlier
    results. It draws the finalists from the last cloud. The winner is the finalist whose worst cell
    is nearest to the paper; all cells break a tie.

    Parameters
    ----------
    free
        The parameters that are searched for.
    trials_of
        Function such as `TrialLog.trials`.
    paper
        The paper's table.
    plan
        The arguments of `add_arguments`: the size of the search, its step sizes and its seed.

    Returns
    -------
    dict of str to float
        The winner's values by ``part.parameter``.
    """

    def drawn(number: int, count: int) -> np.ndarray:
        return cloud.draw(generator(plan.seed, "calibration", str(number)), count)

    def values_at(positions: np.ndarray) -> dict[str, float]:
        return {each.name: each.at(one) for each, one in zip(free, positions, strict=True)}

    first = FIRST_SEED + _SEEDS * plan.seed
    cloud = Cloud(np.full(len(free), 0.5), np.full(len(free), plan.spread))
    for number in range(plan.generations):
        positions = drawn(number, plan.candidates)
        # All candidates of a generation are tried on the same archives.
        seeds = [first + number * plan.archives + archive for archive in range(plan.archives)]
        values = [values_at(candidate) for candidate in positions for _ in seeds]
        trials = trials_of(f"generation {number + 1}", values, seeds * len(positions))
        losses = [
            mean_distance(trials[start : start + len(seeds)], paper)
            for start in range(0, len(trials), len(seeds))
        ]
        print(
            f"generation {number + 1} of {plan.generations}: difference from the paper, in spreads:"
            f" median {np.median(losses):.2f}, centre {losses[0]:.2f}",
            flush=True,
        )
        cloud = cloud.moved(positions, losses, plan.rate)
    seeds = [first + _FINAL_SEED + archive for archive in range(plan.final_archives)]
    finalists = []
    for number, positions in enumerate(drawn(plan.generations, plan.finalists), start=1):
        # The log that ships with the project uses these names.
        stage, values = f"final 1 candidate {number}", values_at(positions)
        worst, difference = shortfall(trials_of(stage, [values] * len(seeds), seeds), paper)
        finalists.append((worst, difference, values))
        print(
            f"{stage}: difference from the paper: worst cell {worst:.2f} spreads, mean of all"
            f" cells {difference:.1f} points",
            flush=True,
        )
    return min(finalists, key=lambda finalist: finalist[:2])[2]


def try_out(
    phantom: Phantom,
    detector: DetectorSettings,
    paper: PaperTable,
    values: Mapping[str, float],
    seed: int,
) -> dict:
    """Make one trial: simulate an archive with as many runs as in the paper, and judge it.

    Parameters
    ----------
    phantom, detector, paper
        Inputs that all trials share.
    values
        The candidate's parameters, by ``part.parameter``.
    seed
        Seed of the archive.

    Returns
    -------
    dict
        ``archive_seed``, ``confusion`` (JSON), the motion and the values.
    """
    candidate = with_values(phantom, values)
    confusion, motion = simulate_and_judge(candidate, detector, paper, paper.runs, seed)
    result = {"archive_seed": seed, "confusion": json.dumps(confusion.tolist())}
    return result | motion | dict(values)


def mean_distance(trials: Sequence[Mapping], paper: PaperTable) -> float:
    """Return the distance of the means of a candidate's trials from the paper, in spreads."""
    rates = [_rates(trial, paper) for trial in trials]
    means = {name: float(np.mean([each[name] for each in rates])) for name in rates[0]}
    return paper_table.distance(means, paper)


def shortfall(trials: Sequence[Mapping], paper: PaperTable) -> tuple[float, float]:
    """Return a candidate's differences from the paper over several archives.

    Parameters
    ----------
    trials
        Trials from `try_out`, or from a file.
    paper
        The paper's table.

    Returns
    -------
    worst : float
        Difference of the paper from the mean in the worst cell, in standard deviations of the
        archives. If it is well below 2, the paper's value lies inside the central 95 %.
    difference : float
        Mean absolute difference of the cells' means from the paper, in points.
    """
    rates = [_rates(trial, paper) for trial in trials]
    worst, differences = 0.0, []
    for name, printed in paper.cells.items():
        values = np.nan_to_num([each[name] for each in rates])
        difference = abs(values.mean() - printed)
        worst = max(worst, difference / max(values.std(), _LEAST_SPREAD))
        differences.append(difference)
    return float(worst), float(np.mean(differences))


def _rates(trial: Mapping, paper: PaperTable) -> dict[str, float]:
    """Return the cells and the motion of a trial in percent; its numbers may be text."""
    motion = {name: float(trial[name]) for name in paper.motion}
    return paper_table.cells(np.array(json.loads(trial["confusion"])), paper) | motion


class TrialLog:
    """A source of trials that keeps them in a file, so that an interrupted search can continue.

    Parameters
    ----------
    path
        The CSV file with one row for each trial; it need not exist.
    make
        Function ``make(values, seeds)`` that makes one trial for each candidate and seed, in order.

    Raises
    ------
    CapsuleError
        The file is not a log of trials.
    """

    def __init__(
        self, path: Path, make: Callable[[Sequence[Mapping], Sequence[int]], Iterable[dict]]
    ) -> None:
        self._path, self._make = path, make
        self._rows = files.read_csv(path) if path.exists() else []
        if self._rows and not {"stage", "archive_seed"} <= set(self._rows[0]):
            raise CapsuleError(f"{path}: this is not a log of trials; choose another --log")

    def trials(self, stage: str, values: Sequence[Mapping], seeds: Sequence[int]) -> list[dict]:
        """Return the trials of one stage; write each new trial before the next is made.

        Parameters
        ----------
        stage
            Name of the stage, unique in the search.
        values
            A candidate's parameters for each trial, by ``part.parameter``.
        seeds
            Seed of the archive of each trial.

        Raises
        ------
        CapsuleError
            The file holds trials of other candidates for this stage.
        """
        known = [row for row in self._rows if row["stage"] == stage]
        if len(known) > len(seeds) or any(
            row.get(name) != str(value)
            for row, candidate, seed in zip(known, values, seeds, strict=False)
            for name, value in {"archive_seed": seed, **candidate}.items()
        ):
            raise CapsuleError(
                f"{self._path}: {stage} has other candidates than this search; choose another"
                " --log, or use the seed, numbers and ranges of that log"
            )
        made = self._make(values[len(known) :], seeds[len(known) :])
        return known + [self._append({"stage": stage} | trial) for trial in made]

    def _append(self, row: dict) -> dict:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        first = not self._path.exists()
        table = pd.DataFrame([row])
        table.to_csv(self._path, mode="a", header=first, index=False, lineterminator="\n")
        return row


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
    detector, paper = quick(read_detector(arguments.config)), read_paper_table()
    with ProcessPoolExecutor(arguments.jobs) as pool:
        make = functools.partial(pool.map, functools.partial(try_out, phantom, detector, paper))
        winner = search(free, TrialLog(arguments.log, make).trials, paper, arguments)
    with files.write_whole(arguments.output) as stream:
        stream.write(rewritten(table, winner))


def rewritten(text: str, values: Mapping[str, float]) -> str:
    """Return a table's text with new values; comments and order stay.

    Parameters
    ----------
    text
        The YAML text, with parts at the margin and one line per parameter:
        ``key: {value: 1.0, ...}``.
    values
        New values by ``part.parameter``.

    Raises
    ------
    CapsuleError
        If a parameter has no such line.
    """
    pending, lines, part = dict(values), [], ""
    for line in text.splitlines(keepends=True):
        if heading := re.match(r"(\w+):", line):
            part = heading[1]
        entry = re.match(r"(  (\w+): \{value: )[^,]+(,.*)", line, re.DOTALL)
        if entry and f"{part}.{entry[2]}" in pending:
            line = f"{entry[1]}{pending.pop(f'{part}.{entry[2]}'):.4g}{entry[3]}"
        lines.append(line)
    if pending:
        raise CapsuleError(f"the table has no line '{next(iter(pending))}: {{value: ...'")
    return "".join(lines)
