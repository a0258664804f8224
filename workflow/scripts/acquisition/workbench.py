"""The bench as a whole: several boards share one clock, and a world moves their inputs."""

import time
from collections.abc import Callable

from acquisition.cable import Cable

World = Callable[[float, float], None]


class Workbench:
    """Lets time pass for the boards on their cables.

    Parameters
    ----------
    *cables : Cable
        The boards.
    world : callable, optional
        Called with the start and the end in seconds of each stretch of time before it is run: sets
        voltages and switches.
    speed : float, optional
        Seconds of the bench per second of the wall clock; as fast as it goes if left out.
    """

    def __init__(
        self, *cables: Cable, world: World | None = None, speed: float | None = None
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
        """Run until something holds.

        Raises
        ------
        TimeoutError
            It does not hold after `limit_s` of the wall clock.
        """
        started, started_us = time.monotonic(), self.now_us
        while not until():
            passed = time.monotonic() - started
            if passed > limit_s:
                raise TimeoutError(
                    f"nothing came of it in {limit_s} s ({self.now_s} s of the bench)"
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
        """Run for some time of the bench."""
        end_us = self.now_us + int(seconds * 1e6)
        self.run(lambda: self.now_us >= end_us, stretch_us=stretch_us)
