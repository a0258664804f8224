"""The link to one of several boards; it reconnects an unplugged board while the others run."""

import time
from collections.abc import Callable

from acquisition.bench_errors import AcquisitionError, BoardNotFoundError, LineLostError
from acquisition.boards import Introduction, connect
from acquisition.line import BAUD, Arrival, Line
from acquisition.protocol import Identity
from acquisition.usb import UsbPort

KNOCK_EVERY_S = 0.2


class BoardLink:
    """The line to one board.

    Parameters
    ----------
    line : Line
        The open line.
    identity : Identity
        The board's description of itself.
    tell : callable
        Function that shows a message to the user.

    Attributes
    ----------
    identity : Identity
        The board's description at its last connection.
    connections : int
        Number of connections; opening a port resets an Arduino.
    """

    def __init__(self, line: Line, identity: Identity, tell: Callable[[str], None]) -> None:
        self._line: Line | None = line
        self._port, self._baud = UsbPort(line.port), line.baud
        self._tell = tell
        self._introduction: Introduction | None = None
        self._knocked_s = 0.0
        self._told = ""
        self.port = line.port
        self.identity = identity
        self.connections = 1

    @property
    def connected(self) -> bool:
        """Return whether the board is connected and identified."""
        return self._line is not None and self._introduction is None

    @property
    def line(self) -> Line:
        """The open line; raises `LineLostError` if the board is not connected."""
        if self._line is None or self._introduction is not None:
            raise LineLostError(f"{self.port} is not connected")
        return self._line

    def receive(self, timeout_s: float = 0.0) -> list[Arrival]:
        """Read the events that have arrived; wait up to the timeout for the first.

        If the board is not connected, try to connect it.
        """
        try:
            if self._line is None:
                self._knock(timeout_s)
                return []
            arrivals = self._line.receive(timeout_s)
            if self._introduction is None:
                return arrivals
            if identity := self._introduction.step(arrivals):
                self._welcome(identity, self._line.port)
        except LineLostError:
            self._lose()
        except AcquisitionError as reason:
            self._keep_waiting(reason)
        return []

    def send(self, payload: str) -> None:
        """Send a command, if the board is connected."""
        if self._line is None or self._introduction is not None:
            return
        try:
            self._line.send(payload)
        except LineLostError:
            self._lose()

    def close(self) -> None:
        """Close the port."""
        if self._line is not None:
            self._line.close()
        self._line = self._introduction = None

    def _lose(self) -> None:
        if self.connected:
            self._tell(
                f"the {self.identity.device} board at {self.port} was unplugged; plug it back in"
            )
            self._told = ""
        self.close()

    def _knock(self, timeout_s: float) -> None:
        """Try to open the port, at most every `KNOCK_EVERY_S` seconds."""
        if time.monotonic() - self._knocked_s < KNOCK_EVERY_S:
            time.sleep(timeout_s)
            return
        self._knocked_s = time.monotonic()
        self._line = Line(self._port.current_name(), self._baud)
        self._introduction = Introduction(self._line, self.identity.device)

    def _welcome(self, identity: Identity, port: str) -> None:
        self._introduction = None
        self.identity, self.port = identity, port
        self.connections += 1
        self._tell(f"the {identity.device} board is back")

    def _keep_waiting(self, reason: AcquisitionError) -> None:
        """Close the port, and show the user once why its board cannot be used."""
        self.close()
        if not isinstance(reason, BoardNotFoundError) and str(reason) != self._told:
            self._told = str(reason)
            self._tell(f"still waiting: {reason}")


def linked(port: str, wanted: str, tell: Callable[[str], None], baud: int = BAUD) -> BoardLink:
    """Open a port and check which board is behind it; raise `AcquisitionError` if it is wrong."""
    return BoardLink(*connect(port, baud, wanted), tell)
