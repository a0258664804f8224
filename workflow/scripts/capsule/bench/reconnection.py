"""Connect a board that was unplugged, in short steps, so that the program does not wait for it."""

import time

from capsule.bench.bench_errors import AcquisitionError, LineLostError, NoAnswerError
from capsule.bench.boards import Introduction
from capsule.bench.line import Line
from capsule.bench.protocol import Identity
from capsule.bench.usb import UsbPort

KNOCK_EVERY_S = 0.2
# Opening a port resets its board, and a fold board moves then. So a port whose board has not
# identified itself is not opened again sooner.
REOPEN_AFTER_S = 10.0


class Reconnection:
    """The wait for one board to come back.

    Parameters
    ----------
    port : UsbPort
        The board's port.
    baud : int
        Bits per second.
    wanted : str
        The expected board.
    """

    def __init__(self, port: UsbPort, baud: int, wanted: str) -> None:
        self._port, self._baud, self._wanted = port, baud, wanted
        self._line: Line | None = None
        self._introduction: Introduction | None = None
        self._next_s = 0.0

    def step(self, timeout_s: float = 0.0) -> tuple[Line, Identity] | None:
        """Try to open the port, or listen to it; return the line once its board is known.

        Parameters
        ----------
        timeout_s : float
            Longest wait.

        Raises
        ------
        AcquisitionError
            The port cannot be opened, or the wrong board or none answers. The caller tells the
            user, and calls again: the port is opened again when its time has come.
        """
        if self._line is None or self._introduction is None:
            if time.monotonic() < self._next_s:
                time.sleep(timeout_s)
                return None
            self._next_s = time.monotonic() + KNOCK_EVERY_S
            self._line = Line(self._port.current_name(), self._baud)
            self._introduction = Introduction(self._line, self._wanted)
        line = self._line
        try:
            identity = self._introduction.step(line.receive(timeout_s))
        except LineLostError as fault:
            self.reject()
            raise NoAnswerError(
                f"the board at {line.port} was disconnected before it identified itself: {fault}"
            ) from fault
        except AcquisitionError:
            self.reject()
            raise
        if identity is None:
            return None
        self._line = self._introduction = None
        return line, identity

    def reject(self, line: Line | None = None) -> None:
        """Close the port, also that of a returned line, and do not open it again at once."""
        for each in (self._line, line):
            if each is not None:
                each.close()
        self._line = self._introduction = None
        self._next_s = time.monotonic() + REOPEN_AFTER_S

    def close(self) -> None:
        """Close the port."""
        if self._line is not None:
            self._line.close()
        self._line = self._introduction = None
