"""Print the progress of a long computation, and the time that it will still take."""

import sys
import time
from collections.abc import Callable

_SECONDS_BETWEEN = 20.0


class Progress:
    """A printer of progress lines, at intervals of at least 20 s.

    Parameters
    ----------
    whole : float
        Amount of the whole work, in the unit of `tell`.
    clock : callable
        Function that returns the time in seconds.
    """

    def __init__(self, whole: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._whole, self._clock = whole, clock
        self._begin = self._last = clock()

    def tell(self, done: float, text: str) -> None:
        """Print the progress, unless the last line is less than 20 s old."""
        now = self._clock()
        if done <= 0 or now - self._last < _SECONDS_BETWEEN:
            return
        self._last = now
        left_min = (now - self._begin) * (self._whole - done) / done / 60
        print(f"{text}, about {left_min:.1f} min left", file=sys.stderr, flush=True)
