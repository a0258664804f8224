"""A logger board that plays a simulated run, at a port where the recorder finds it."""

import contextlib
import math
import threading
from collections.abc import Iterator

import numpy as np

from acquisition.cable import SocketCable
from acquisition.stand_in import StandInLogger
from acquisition.workbench import Workbench
from capsule.phantom.sensor import Electronics

# Less than the time between samples: each sample finds its own voltages.
_STRETCH_US = 20_000
# The logger believes in its end stop when two samples in a row have found it pressed.
_PRESSED_FOR = 2


class PlayedRun:
    """A world in which a board's inputs follow a simulated run, a reading a sample.

    Parameters
    ----------
    board : StandInLogger
        The board.
    counts : (S, K) array
        The readings; the last one is at the end stop.
    electronics : Electronics
        Of the simulated bench.
    """

    def __init__(self, board: StandInLogger, counts: np.ndarray, electronics: Electronics) -> None:
        self._board = board
        # The middle of each of the converter's steps.
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
        Of the simulated bench.
    speed : float
        Seconds of the bench in a second.

    Yields
    ------
    str
        The port.
    """
    board = StandInLogger()
    # Nobody uploads a firmware to this board, so a byte that comes early does no harm.
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
