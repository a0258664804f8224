"""Calibrate the phantom: try generations of candidates, then finalists on further archives."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from capsule.seeding import generator
from phantom_study.paper_table import PaperTable
from phantom_study.search import Cloud, FreeParameter, Generation, evolve, values_at
from phantom_study.trials import mean_distance, shortfall

# First seed of the search's archives. The archives that judge the winner have seeds from 10 001 on.
FIRST_SEED = 100_000
# Number of seeds of one search. The finalists' archives use those from `_FINAL_SEED` on.
_SEEDS = 1000
_FINAL_SEED = 500


class TrialSource(Protocol):
    """A source of trials; it may look up trials that were made before."""

    def trials(self, stage: str, values: Sequence[Mapping], seeds: Sequence[int]) -> list[dict]:
        """Return the trials of one stage, one for each of the values and its seed.

        Parameters
        ----------
        stage
            Name of the stage, unique in the search.
        values
            A candidate's parameters for each trial, by ``part.parameter``.
        seeds
            Seed of the archive of each trial.
        """


@dataclass(frozen=True)
class Plan:
    """The size of a search, its step sizes and its seed.

    Attributes
    ----------
    generations, candidates, archives
        Numbers of generations, of candidates in each, and of archives for each candidate.
    finalists, final_archives
        Numbers of finalists, and of archives for each finalist.
    spread, rate
        Arguments of `evolve`.
    seed
        Seed of candidates and archives; the same seed gives the same winner.
    """

    generations: int
    candidates: int
    archives: int
    finalists: int
    final_archives: int
    spread: float
    rate: float
    seed: int


@dataclass(frozen=True)
class Finalist:
    """A candidate of the last cloud, with its results on the archives of the final.

    Attributes
    ----------
    stage
        Name of its trials.
    values
        Its parameters, by ``part.parameter``.
    worst, difference
        Differences from `shortfall`: of the worst cell in spreads, and of all cells in points.
    """

    stage: str
    values: dict[str, float]
    worst: float
    difference: float


@dataclass(frozen=True)
class Calibration:
    """A search for the parameters with which the paper's detector gives the paper's table.

    Attributes
    ----------
    free
        The parameters that are searched for.
    source
        Source of the trials.
    paper
        The paper's table.
    plan
        Size of the search.
    """

    free: Sequence[FreeParameter]
    source: TrialSource
    paper: PaperTable
    plan: Plan

    def generations(self) -> Iterator[Generation]:
        """Move the cloud of candidates, and yield each generation after its trials."""
        generations = evolve(
            self.free,
            self._losses,
            self._numbers,
            candidates=self.plan.candidates,
            spread=self.plan.spread,
            rate=self.plan.rate,
        )
        return itertools.islice(generations, self.plan.generations)

    def finalists(self, cloud: Cloud) -> Iterator[Finalist]:
        """Draw the finalists from the last cloud, and yield each finalist after its trials."""
        first = FIRST_SEED + _SEEDS * self.plan.seed + _FINAL_SEED
        seeds = range(first, first + self.plan.final_archives)
        drawn = cloud.draw(self._numbers(self.plan.generations), self.plan.finalists)
        for number, positions in enumerate(drawn, start=1):
            values = values_at(self.free, positions)
            # The log that ships with the project uses these names.
            stage = f"final 1 candidate {number}"
            trials = self.source.trials(stage, [values] * len(seeds), seeds)
            yield Finalist(stage, values, *shortfall(trials, self.paper))

    def _losses(self, candidates: Sequence[Mapping], generation: int) -> list[float]:
        """Return the losses of a generation's candidates; all are tried on the same archives."""
        count = self.plan.archives
        first = FIRST_SEED + _SEEDS * self.plan.seed + generation * count
        seeds = list(range(first, first + count))
        values = [values for values in candidates for _ in seeds]
        stage = f"generation {generation + 1}"
        trials = self.source.trials(stage, values, seeds * len(candidates))
        return [
            mean_distance(trials[start : start + count], self.paper)
            for start in range(0, len(trials), count)
        ]

    def _numbers(self, generation: int) -> np.random.Generator:
        """Return the random numbers of a generation; the finalists use those after the last."""
        return generator(self.plan.seed, "calibration", str(generation))


def winner(finalists: Sequence[Finalist]) -> Finalist:
    """Return the finalist whose worst cell is nearest to the paper; all cells break a tie."""
    return min(finalists, key=lambda finalist: (finalist.worst, finalist.difference))
