"""Voltages that tell the time: every sample says when it was really taken.

The two upper sensors count the bench's stretches of 5 ms; the two lower ones repeat that in another
form, so that a sample mixed from two would be noticed.
"""

from collections.abc import Sequence

import numpy as np

STRETCH_S = 0.005
_CODES = 1024


def counts_at(stretch: int) -> tuple[int, int, int, int]:
    """Give the ADC counts of that stretch of time."""
    high, low = divmod(stretch, _CODES)
    return high, low, (7 * stretch + 3) % _CODES, (11 * stretch + 5) % _CODES


def voltages_mv(stretch: int) -> np.ndarray:
    """Give the voltages that make these counts, in the middle of each step of the ADC."""
    return (np.array(counts_at(stretch)) + 0.5) * 5000 / _CODES


def taken_at_s(counts: Sequence[float]) -> float:
    """Read from a sample when it was taken.

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
    """A world whose voltages tell the time, for `Workbench`."""

    def __init__(self, board: object) -> None:
        self._board = board

    def __call__(self, start_s: float, end_s: float) -> None:
        """Set the voltages of one stretch."""
        del end_s
        voltages = voltages_mv(round(start_s / STRETCH_S))
        self._board.set_voltages(voltages, voltages)
