"""A simulated logger board that plays a run at a port of this computer."""

import contextlib
import math
import threading
from collections.abc import Iterator

import numpy as np

from capsule.bench.cable import SocketCable
from capsule.bench.stand_in import StandInLogger
from capsule.bench.workbench import Workbench
from capsule.phantom.sensor import Electronics

# Shorter than the time between samples, so that each sample gets its own voltages.
_STRETCH_US = 20_000
# The logger reports the end stop after two samples in a row at which it was pressed.
_PRESSED_FOR = 2


class PlayedRun:
    """A world that sets a board's inputs to one reading of a simulated run per sample.

    Parameters
    ----------
    board : StandInLogger
        The board.
    counts : (S, K) array
        The readings; the last one is at the end stop.
    electronics : Electronics
        Electronics of the simulated bench.
    """

    def __init__(self, board: StandInLogger, counts: np.ndarray, electronics: Electronics) -> None:
        self._board = board
        # The voltage in the middle of each step of the converter.
        self._mv = (counts + 0.5) * 1000 * electronics.vref_v / 2**electronics.adc_bits

    def __call__(self, start_s: float, end_s: float) -> None:
        """Set the inputs for the next sample."""
        del start_s, end_s
        last = self._mv.shape[1] - 1
        sample = min(self._board.samples_sent, last)
        voltages_mv = self._mv[:, sample].tolist()
        self._board.set_voltages(voltages_mv, voltages_mv)
        self._board.set_end_stop(sample > last - _PRESSED_FOR)


@contextlib.contextmanager
def played_board(counts: np.ndarray, electronics: Electronics, speed: float) -> Iterator[str]:
    """Plug in a board that plays a run while the context lasts.

    Parameters
    ----------
    counts : (S, K) array
        The readings.
    electronics : Electronics
        Electronics of the simulated bench.
    speed : float
        Seconds of the bench per second of the wall clock.

    Yields
    ------
    str
        Name of the port.
    """
    board = StandInLogger()
    # An early byte cannot block this board, because it has no real boot loader.
    cable = SocketCable(board, sticks=False)
    bench = Workbench(cable, world=PlayedRun(board, counts, electronics), speed=speed)
    over = threading.Event()
    player = threading.Thread(
        target=bench.run, args=(over.is_set, math.inf, _STRETCH_US), daemon=True
    )
    player.start()
    try:
        yield cable.port
    finally:
        over.set()
        player.join()
        cable.unplug()
