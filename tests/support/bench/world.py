"""Set voltages that encode the time, so that every sample contains its true time.

The two upper sensors count the bench's stretches of 5 ms. The two lower sensors repeat this number
in another form, so that a mixture of two samples is detected.
"""

from collections.abc import Sequence

import numpy as np

STRETCH_S = 0.005
_CODES = 1024


def counts_at(stretch: int) -> tuple[int, int, int, int]:
    """Return the ADC counts of a stretch of time."""
    high, low = divmod(stretch, _CODES)
    return high, low, (7 * stretch + 3) % _CODES, (11 * stretch + 5) % _CODES


def voltages_mv(stretch: int) -> np.ndarray:
    """Return the voltages for these counts, in the middle of each step of the ADC."""
    return (np.array(counts_at(stretch)) + 0.5) * 5000 / _CODES


def taken_at_s(counts: Sequence[float]) -> float:
    """Return the time at which a sample was taken, in s.

    Raises
    ------
    AssertionError
        No moment of the bench gives these counts.
    """
    stretch = int(counts[0]) * _CODES + int(counts[1])
    if tuple(int(count) for count in counts) != counts_at(stretch):
        raise AssertionError(f"{counts} was never measured")
    return stretch * STRETCH_S


class Clock:
    """A world whose voltages encode the time, for `Workbench`."""

    def __init__(self, board: object) -> None:
        self._board = board

    def __call__(self, start_s: float, end_s: float) -> None:
        """Set the voltages of one stretch."""
        del end_s
        voltages = voltages_mv(round(start_s / STRETCH_S))
        self._board.set_voltages(voltages, voltages)
