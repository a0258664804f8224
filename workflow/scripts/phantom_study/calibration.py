"""The calibration of the phantom: generations of candidates, then finalists on further archives."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from capsule.seeding import generator
from phantom_study.paper_table import PaperTable
from phantom_study.search import Cloud, FreeParameter, Generation, evolve, values_at
from phantom_study.trials import mean_distance, shortfall

# Archives of the search have seeds from here on; those that judge the winner count from 10 001.
FIRST_SEED = 100_000
# A search has so many seeds, of which the finalists' archives have those from `_FINAL_SEED` on.
_SEEDS = 1000
_FINAL_SEED = 500


class TrialSource(Protocol):
    """Where trials come from: made, or looked up where they were made before."""

    def trials(self, stage: str, values: Sequence[Mapping], seeds: Sequence[int]) -> list[dict]:
        """Return the trials of one stage, one for each of the values and its seed.

        Parameters
        ----------
        stage
            Name of the stage, which no other stage of the search has.
        values
            A candidate's parameters for each trial, by ``part.parameter``.
        seeds
            The archive of each trial.
        """


@dataclass(frozen=True)
class Plan:
    """How long a search is, and how it moves.

    Attributes
    ----------
    generations, candidates, archives
        Number of generations, of candidates in each, and of archives that each candidate meets.
    finalists, final_archives
        Number of finalists, and of archives that each of them meets.
    spread, rate
        Of `evolve`.
    seed
        Of candidates and archives: the same seed gives the same winner.
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
    """A candidate of the last cloud, and how it does on the final's archives.

    Attributes
    ----------
    stage
        Name of its trials.
    values
        Its parameters, by ``part.parameter``.
    worst, difference
        From `shortfall`: of the worst cell in spreads, and of all cells in points.
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
        What is searched for.
    source
        Where the trials come from.
    paper
        The paper's table.
    plan
        How long the search is.
    """

    free: Sequence[FreeParameter]
    source: TrialSource
    paper: PaperTable
    plan: Plan

    def generations(self) -> Iterator[Generation]:
        """Move the cloud of candidates, and yield each generation when it was tried."""
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
        """Draw the finalists from the last generation's cloud, and yield each when it was tried."""
        first = FIRST_SEED + _SEEDS * self.plan.seed + _FINAL_SEED
        seeds = range(first, first + self.plan.final_archives)
        drawn = cloud.draw(self._numbers(self.plan.generations), self.plan.finalists)
        for number, positions in enumerate(drawn, start=1):
            values = values_at(self.free, positions)
            # As the stages of the log that ships are called.
            stage = f"final 1 candidate {number}"
            trials = self.source.trials(stage, [values] * len(seeds), seeds)
            yield Finalist(stage, values, *shortfall(trials, self.paper))

    def _losses(self, candidates: Sequence[Mapping], generation: int) -> list[float]:
        """Try the candidates of a generation, all of them on the same archives."""
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
        """Return the source of a generation's candidates; the finalists come after the last."""
        return generator(self.plan.seed, "calibration", str(generation))


def winner(finalists: Sequence[Finalist]) -> Finalist:
    """Return the finalist whose worst cell is nearest to the paper; of equal ones, all cells."""
    return min(finalists, key=lambda finalist: (finalist.worst, finalist.difference))
