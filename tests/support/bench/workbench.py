"""A simulated bench: several boards share one clock, and a function sets their inputs."""

import time
from collections.abc import Callable, Sequence

import numpy as np

from support.bench.cable import TerminalCable
from support.bench.emulated import EmulatedBoard, World

STRETCH_S = 0.005


class Workbench:
    """A clock that runs the boards on their cables, at `speed` times real time or without a limit.

    The world sets voltages and switches: it is called before each stretch of time, with the
    stretch's start and end in seconds.
    """

    def __init__(
        self, *cables: TerminalCable, world: World | None = None, speed: float | None = None
    ) -> None:
        self._cables = cables
        self._world = world
        self.speed = speed
        self.now_us = 0

    @property
    def now_s(self) -> float:
        """The bench's time in seconds."""
        return self.now_us / 1e6

    def run(self, until: Callable[[], bool], limit_s: float = 30.0, stretch_us: int = 5000) -> None:
        """Run until a condition holds.

        Raises
        ------
        TimeoutError
            The condition does not hold after `limit_s` seconds of the wall clock.
        """
        started, started_us = time.monotonic(), self.now_us
        while not until():
            passed = time.monotonic() - started
            if passed > limit_s:
                raise TimeoutError(
                    f"the condition did not hold within {limit_s} s ({self.now_s} s of the bench)"
                )
            if self.speed:
                ahead = (self.now_us - started_us) / 1e6 / self.speed - passed
                if ahead > 0:
                    time.sleep(min(ahead, 0.01))
                    continue
            end_us = self.now_us + stretch_us
            if self._world:
                self._world(self.now_us / 1e6, end_us / 1e6)
            for cable in self._cables:
                cable.step(self.now_us, end_us)
            self.now_us = end_us

    def run_for(self, seconds: float, stretch_us: int = 5000) -> None:
        """Run for this many seconds of the bench's time."""
        end_us = self.now_us + int(seconds * 1e6)
        self.run(lambda: self.now_us >= end_us, stretch_us=stretch_us)


def counts_at(stretch: int) -> tuple[int, int, int, int]:
    """Return ADC counts that tell a stretch of time twice, so that no two samples can be mixed."""
    high, low = divmod(stretch, 1024)
    return high, low, (7 * stretch + 3) % 1024, (11 * stretch + 5) % 1024


def taken_at_s(counts: Sequence[float]) -> float:
    """Return the time at which a sample was taken, in s."""
    stretch = int(counts[0]) * 1024 + int(counts[1])
    assert tuple(counts) == counts_at(stretch), f"{counts} was never measured"
    return stretch * STRETCH_S


class Clock:
    """A world whose voltages encode the time, so that every sample contains its true time."""

    def __init__(self, board: EmulatedBoard) -> None:
        self._board = board

    def __call__(self, start_s: float, end_s: float) -> None:
        """Set the voltages of one stretch, in the middle of each step of the ADC."""
        del end_s
        voltages_mv = (np.array(counts_at(round(start_s / STRETCH_S))) + 0.5) * 5000 / 1024
        self._board.set_voltages(voltages_mv, voltages_mv)
