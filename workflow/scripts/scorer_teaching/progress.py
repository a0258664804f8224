"""How far a long work is, and how long it will still take."""

import sys
import time
from collections.abc import Callable

_SECONDS_BETWEEN = 20.0


class Progress:
    """Prints a line now and then.

    Parameters
    ----------
    whole : float
        What is done at the end, in the unit of `tell`.
    clock : callable
        Seconds; the clock of the computer.
    """

    def __init__(self, whole: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._whole, self._clock = whole, clock
        self._begin = self._last = clock()

    def tell(self, done: float, text: str) -> None:
        """Print what is done, unless a line stands there since a moment ago."""
        now = self._clock()
        if done <= 0 or now - self._last < _SECONDS_BETWEEN:
            return
        self._last = now
        left_min = (now - self._begin) * (self._whole - done) / done / 60
        print(f"{text}, about {left_min:.1f} min left", file=sys.stderr, flush=True)
