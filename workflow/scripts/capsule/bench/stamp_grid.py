"""Assign time stamps to the periods of an even grid; a lost sample leaves its period empty."""

# Share of a stamp's deviation by which the grid moves: it follows drift, but hardly jitter.
_GAIN = 0.1


class StampGrid:
    """An even grid that numbers time stamps by periods and follows a clock that drifts.

    A stamp may jitter by less than half a period. The grid moves with the stamps. So a clock that
    is wrong by a part in a thousand neither adds nor loses a sample.

    Parameters
    ----------
    period_s : float
        Time between two samples.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last_s: float | None = None  # time of the last stamp's grid point
        self._number = 0

    def number(self, stamp_s: float) -> int:
        """Return the number of a stamp's period, from 0; it can be lower than the last one.

        Parameters
        ----------
        stamp_s : float
            Time stamp in seconds.
        """
        if self._last_s is None:
            self._last_s = stamp_s
            return 0
        passed = (stamp_s - self._last_s) / self._period_s
        steps = round(passed)
        self._last_s += (steps + _GAIN * (passed - steps)) * self._period_s
        self._number += steps
        return self._number
