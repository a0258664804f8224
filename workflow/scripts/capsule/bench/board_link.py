"""The link to one of several boards; it reconnects an unplugged board while the others run."""

from collections.abc import Callable

from capsule.bench.bench_errors import AcquisitionError, BoardNotFoundError, LineLostError
from capsule.bench.boards import connect
from capsule.bench.line import Arrival, Line
from capsule.bench.protocol import Identity
from capsule.bench.reconnection import Reconnection
from capsule.bench.usb import UsbPort


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
        self._return = Reconnection(UsbPort(line.port), line.baud, identity.device)
        self._tell = tell
        self._told = ""
        self.port = line.port
        self.identity = identity
        self.connections = 1

    @property
    def connected(self) -> bool:
        """Return whether the board is connected and identified."""
        return self._line is not None

    @property
    def line(self) -> Line:
        """The open line; raises `LineLostError` if the board is not connected."""
        if self._line is None:
            raise LineLostError(f"{self.port} is not connected")
        return self._line

    def receive(self, timeout_s: float = 0.0) -> list[Arrival]:
        """Read the events that have arrived; wait up to the timeout for the first.

        If the board is not connected, try to connect it.
        """
        try:
            if self._line is not None:
                return self._line.receive(timeout_s)
            if found := self._return.step(timeout_s):
                self._welcome(*found)
        except LineLostError:
            self._lose()
        except AcquisitionError as reason:
            self._keep_waiting(reason)
        return []

    def send(self, payload: str) -> None:
        """Send a command, if the board is connected."""
        if self._line is None:
            return
        try:
            self._line.send(payload)
        except LineLostError:
            self._lose()

    def close(self) -> None:
        """Close the port."""
        if self._line is not None:
            self._line.close()
        self._line = None
        self._return.close()

    def _lose(self) -> None:
        self._tell(
            f"the {self.identity.device} board at {self.port} was unplugged; plug it back in"
        )
        self._told = ""
        self.close()

    def _welcome(self, line: Line, identity: Identity) -> None:
        self._line = line
        self.identity, self.port = identity, line.port
        self.connections += 1
        self._tell(f"the {identity.device} board is back")

    def _keep_waiting(self, reason: AcquisitionError) -> None:
        """Show the user once why the board cannot be used."""
        if not isinstance(reason, BoardNotFoundError) and str(reason) != self._told:
            self._told = str(reason)
            self._tell(f"still waiting: {reason}")


def linked(
    port: str, wanted: str, tell: Callable[[str], None], baud: int, stopped: Callable[[], bool]
) -> BoardLink:
    """Open a port and check which board is behind it; parameters as in `boards.connect`."""
    return BoardLink(*connect(port, baud, wanted, stopped), tell)
