"""Search for the free parameters of the phantom with a simple evolutionary method."""

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
        Name of the form ``part.parameter``.
    low, high
        Ends of its range.
    logarithmic
        Whether the search steps in the logarithm of the value.
    """

    name: str
    low: float
    high: float
    logarithmic: bool

    def at(self, position: float) -> float:
        """Return the value at a position in the range: 0 is the low end, 1 the high end."""
        if self.logarithmic:
            return float(self.low * (self.high / self.low) ** position)
        return float(self.low + (self.high - self.low) * position)


@dataclass(frozen=True)
class Cloud:
    """A cloud of candidates: a normal distribution of each parameter's position in its range.

    Attributes
    ----------
    centre, spread
        Mean and standard deviation of each position, shape (D,).
    """

    centre: np.ndarray
    spread: np.ndarray

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """Return candidate positions in 0..1, shape (count, D); the first is the centre."""
        steps = generator.standard_normal((count, self.centre.size))
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


@dataclass(frozen=True)
class Generation:
    """One step of the search.

    Attributes
    ----------
    values
        The parameters of each candidate; the first is the centre of the cloud.
    losses
        The loss of each candidate.
    cloud
        The next cloud.
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
    """Yield generations without end; each cloud of candidates moves towards its best ones.

    The first cloud lies in the middle of all ranges, so the search does not depend on earlier
    results.

    Parameters
    ----------
    free
        The parameters that are searched for.
    losses_of
        Function ``losses_of(candidates, number)`` that returns the losses of generation
        ``number``. For a fair comparison, all candidates should use the same random numbers.
    draw
        Function ``draw(number)`` that returns the random numbers of generation ``number``.
    candidates
        Number of candidates in a generation.
    spread
        Standard deviation of the first cloud, as a part of each range.
    rate
        Share of the way that the cloud moves in a generation, 0..1.
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
    """Return the parameters of a table that have a ``range``.

    Parameters
    ----------
    table
        A table such as ``config/phantom.yaml``, with entries ``range: [low, high]``. If the low
        end is positive, the search steps in the logarithm.
    """
    return [
        FreeParameter(f"{part}.{key}", *map(float, entry["range"]), entry["range"][0] > 0)
        for part, entries in table.items()
        for key, entry in entries.items()
        if "range" in entry
    ]
