"""Which period of an even grid a time stamp belongs to: a lost sample leaves its period empty."""

# Of what a stamp is off the grid, how much moves it: a clock may drift, one stamp may jitter.
_GAIN = 0.1


class StampGrid:
    """Numbers time stamps by periods from the first one; follows a clock that drifts.

    A stamp may jitter by less than half a period. The grid moves with the stamps, so that a source
    whose clock is off by a part in a thousand neither gains nor loses a sample.

    Parameters
    ----------
    period_s : float
        Between two samples.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last_s: float | None = None  # where the grid puts the last stamp
        self._number = 0

    def number(self, stamp_s: float) -> int:
        """Give the number of a stamp's period, from 0; it need not be higher than the last one.

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
