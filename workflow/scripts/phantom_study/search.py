"""A plain evolutionary search for the free parameters of the phantom."""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that is searched for.

    Attributes
    ----------
    name
        ``part.parameter``.
    low, high
        Its range.
    logarithmic
        Whether steps are in its logarithm (for scales) or in itself.
    """

    name: str
    low: float
    high: float
    logarithmic: bool

    def at(self, position: float) -> float:
        """Return the value at a position in the range: 0 is its low end, 1 its high one."""
        if self.logarithmic:
            return float(self.low * (self.high / self.low) ** position)
        return float(self.low + (self.high - self.low) * position)


@dataclass(frozen=True)
class Cloud:
    """Where the search looks: a normal distribution for each parameter's position in its range.

    Attributes
    ----------
    centre, spread
        Mean and standard deviation of each position, shape (D,).
    """

    centre: np.ndarray
    spread: np.ndarray

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """Return candidates' positions, shape (count, D), in 0..1; the first is the centre."""
        steps = generator.standard_normal((count, self.centre.size))
        positions = self.centre + self.spread * steps
        positions[0] = self.centre
        # The absolute value of mod(x + 1, 2) - 1 folds the line onto 0..1.
        return np.abs(np.mod(positions + 1, 2) - 1)

    def moved(self, candidates: np.ndarray, losses: Sequence[float], rate: float) -> "Cloud":
        """Return the cloud drawn towards the best quarter of the candidates.

        Parameters
        ----------
        candidates : (count, D) array
            The positions that were tried.
        losses
            What each gave; smaller is better.
        rate
            How far to move, 0..1. Slow moves average the noise of single archives out.
        """
        best = candidates[np.argsort(losses)[: max(len(losses) // 4, 2)]]
        # The spread shrinks more slowly than the centre moves, lest chance decide too early.
        spread = (1 - rate / 2) * self.spread + rate / 2 * best.std(axis=0)
        return Cloud((1 - rate) * self.centre + rate * best.mean(axis=0), spread)


@dataclass(frozen=True)
class Generation:
    """One step of the search.

    Attributes
    ----------
    values
        The parameters of each candidate; the first is the centre of the cloud.
    losses
        What each gave.
    cloud
        Where to look next.
    """

    values: list[dict[str, float]]
    losses: list[float]
    cloud: Cloud


def evolve(
    free: Sequence[FreeParameter],
    losses_of: Callable[[Sequence[Mapping[str, float]], int], Sequence[float]],
    draw: Callable[[int], np.random.Generator],
    *,
    candidates: int,
    spread: float,
    rate: float,
) -> Iterator[Generation]:
    """Search without end: try a cloud of candidates, move it towards the best, try again.

    The first cloud lies in the middle of all ranges, so nothing depends on earlier results.

    Parameters
    ----------
    free
        What is searched for.
    losses_of
        ``losses_of(candidates, number)``: how bad each candidate of generation ``number`` is. All
        candidates of a generation should meet the same random numbers: a fair comparison.
    draw
        ``draw(number)``: source of the candidates of generation ``number``.
    candidates
        Number of candidates in a generation.
    spread
        Standard deviation of the first cloud, in parts of the ranges.
    rate
        How far the cloud moves in a generation, 0..1.
    """
    cloud = Cloud(np.full(len(free), 0.5), np.full(len(free), spread))
    for number in itertools.count():
        positions = cloud.draw(draw(number), candidates)
        values = [values_at(free, candidate) for candidate in positions]
        losses = list(losses_of(values, number))
        cloud = cloud.moved(positions, losses, rate)
        yield Generation(values, losses, cloud)


def values_at(free: Sequence[FreeParameter], positions: np.ndarray) -> dict[str, float]:
    """Return the parameters' values at the given positions in their ranges, shape (D,)."""
    return {
        parameter.name: parameter.at(position)
        for parameter, position in zip(free, positions, strict=True)
    }


def free_parameters(table: Mapping) -> list[FreeParameter]:
    """Return the parameters that a table marks with a ``range`` to search.

    Parameters
    ----------
    table
        As in ``config/phantom.yaml``: ``range: [low, high]``; a positive lower end means steps
        in the logarithm.
    """
    return [
        FreeParameter(f"{part}.{key}", *map(float, entry["range"]), entry["range"][0] > 0)
        for part, entries in table.items()
        for key, entry in entries.items()
        if "range" in entry
    ]
