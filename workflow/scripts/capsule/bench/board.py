"""The line to one board, which is kept up: it reconnects a board that was unplugged."""

import time
from collections import deque
from collections.abc import Callable, Generator, Iterator

from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardLostError,
    BoardNotFoundError,
    LineLostError,
    NoAnswerError,
    RefusedError,
)
from capsule.bench.clock import AWAKE, elapsed_s
from capsule.bench.identification import differences, opened
from capsule.bench.line import READ_TIMEOUT_S, Arrival, Line, UsbPort
from capsule.bench.protocol import Acknowledgement, Back, Damaged, Event, Identity, Refusal

# A command is sent again after so long without an answer, or after a refusal.
CONFIRM_S, AGAIN_S = 0.25, 1.0
ANSWERS_WITHIN_S = 3.0
KNOCK_EVERY_S = 0.2
# Opening a port resets its board, and a fold board moves then. So a port whose board has not
# identified itself is not opened again sooner.
REOPEN_AFTER_S = 10.0


class Board:
    """One board: its line, its return when it was unplugged, and commands that it must confirm.

    Attributes
    ----------
    port : str
        Present name of the port.
    identity : Identity
        The board's newest description of itself.
    """

    def __init__(
        self,
        line: Line,
        identity: Identity,
        tell: Callable[[str], None],
        *,
        insists: bool = False,
    ) -> None:
        self._line: Line | None = line
        self._usb_port, self._baud = UsbPort(line.port), line.baud
        # The steps of a port that was opened again, until its board has said what it is.
        self._opening: Generator[tuple[Line, Identity] | None] | None = None
        self._open_s = 0.0
        # What a line that was lost had begun to send.
        self._rest: list[Arrival] = []
        self._first, self._tell, self._insists = identity, tell, insists
        self._told = ""
        self._pending: deque[str] = deque()
        self._refused = ""
        self._due_s = 0.0
        self._heard_s = AWAKE.now_s()
        self.port = line.port
        self.identity = identity

    @property
    def connected(self) -> bool:
        """Return whether the board is connected and identified."""
        return self._line is not None

    @property
    def name(self) -> str:
        """The board and its port, for messages."""
        return f"the {self.identity.device} board at {self.port}"

    @property
    def header(self) -> dict[str, str]:
        """Entries of a recording's header that describe this logger."""
        entries, device = self.identity.entries, self.identity.device
        return {
            "source": f"recorded by the {device} board, firmware {entries['firmware']}",
            "rate_hz": entries["rate_hz"],
            "adc_bits": entries["adc_bits"],
            "vref_v": f"{int(entries['vref_mv']) / 1000:g}",
            "series_ohm": entries["series_ohm"],
        }

    @property
    def line(self) -> Line:
        """The open line; raises `LineLostError` if the board is not connected."""
        if self._line is None:
            raise LineLostError(f"{self.port} is not connected")
        return self._line

    @property
    def silent_s(self) -> float:
        """Seconds since the last whole frame or the board's return, while this program ran."""
        return AWAKE.now_s() - self._heard_s

    def loss(self, patience_s: float) -> BoardLostError | None:
        """Return the error after a silence; None without one."""
        if self.silent_s <= patience_s:
            return None
        return BoardLostError(
            f"{self.name} has sent nothing for {patience_s:.0f} s (--patience); when a lease ends, "
            "the wave stops and the origami unfolds by itself"
        )

    def read(self, timeout_s: float = 0.0) -> Iterator[Arrival]:
        """Yield the events that have arrived; wait up to the timeout for the first.

        Answers to commands are noted, and what is due then is sent. If the board is not connected,
        try to connect it; `Back` says that it is. Another board is not accepted.
        """
        for arrival in self._receive(timeout_s):
            if not isinstance(arrival.event, Damaged):
                self._heard_s = AWAKE.now_s()
            self._note_answer(arrival.event)
            yield arrival
        self._send_pending()

    def _receive(self, timeout_s: float) -> list[Arrival]:
        arrivals: list[Arrival] = []
        try:
            if self._line is not None:
                arrivals = self._line.receive(timeout_s)
            elif found := self.come_back(timeout_s):
                arrivals = self._welcome(*found)
        except LineLostError:
            self._lose()
        except AcquisitionError as reason:
            if not isinstance(reason, BoardNotFoundError):
                self._tell_once(f"still waiting: {reason}")
        rest, self._rest = self._rest, []
        return rest + arrivals

    def send(self, payload: str) -> None:
        """Send a command, if the board is connected."""
        if self._line is not None:
            try:
                self._line.send(payload)
            except LineLostError:
                self._lose()

    def close(self) -> list[Damaged]:
        """Close the port; return the rest of an unfinished frame."""
        rest = [] if self._line is None else self._line.close()
        self._line = None
        if self._opening:
            self._opening.close()
            self._opening = None
        return rest

    def come_back(self, timeout_s: float) -> tuple[Line, Identity] | None:
        """Try to open the port again, or listen to it; return the line once its board is known.

        Raises
        ------
        AcquisitionError
            The port cannot be opened, or the wrong board or none answers. It is opened again when
            its time has come.
        """
        if self._opening is None and time.monotonic() >= self._open_s:
            self._open_s = time.monotonic() + KNOCK_EVERY_S
            opening = opened(self._usb_port.current_name(), self._baud, self.identity.device)
            next(opening)
            self._opening, self._open_s = opening, time.monotonic() + REOPEN_AFTER_S
        found = None
        if self._opening:
            try:
                found = next(self._opening)
            except AcquisitionError:
                self._opening = None
                raise
        if found:
            self._opening = None
        else:
            time.sleep(timeout_s)
        return found

    @property
    def pending(self) -> tuple[str, ...]:
        """Commands that the board has not confirmed."""
        return tuple(self._pending)

    def want(self, *commands: str) -> None:
        """Send these commands instead of all unconfirmed ones; each until the board confirms it."""
        if self.pending != commands:
            self._pending = deque(commands)
            self._due_s = 0.0
        self._send_pending()

    def request(self, command: str) -> None:
        """Send a command until the board confirms it, in place of all unconfirmed ones.

        Raises
        ------
        RefusedError
            The board refuses; the text gives its reason.
        AcquisitionError
            The board does not answer, or was disconnected.
        """
        self._refused = ""
        self.want(command)
        until_s = time.monotonic() + ANSWERS_WITHIN_S
        while self._pending and self.connected and time.monotonic() < until_s:
            for _ in self.read(READ_TIMEOUT_S):
                pass
        if not self.connected:
            raise AcquisitionError(f"{self.name} was disconnected; plug it in, and start again")
        if self._refused:
            raise RefusedError(f"{self.name} refuses {command!r}: {self._refused}")
        if self._pending:
            raise NoAnswerError(
                f"{self.name} does not answer {command!r}; try another cable, or press the reset "
                "button of the board"
            )

    def _send_pending(self) -> None:
        """Send the first unconfirmed command, if it is due."""
        now_s = time.monotonic()
        if self._pending and now_s >= self._due_s:
            self._due_s = now_s + CONFIRM_S
            self.send(self._pending[0])

    def _note_answer(self, event: Event) -> None:
        """Go on with the next command if this event answers the present one."""
        name = self._pending[0].partition(",")[0] if self._pending else None
        match event:
            case Refusal(command=answered) if answered == name and self._insists:
                self._due_s = time.monotonic() + AGAIN_S
            case Acknowledgement(command=answered) | Refusal(command=answered) if answered == name:
                self._refused = event.reason if isinstance(event, Refusal) else ""
                self._pending.popleft()
                self._due_s = 0.0
                self._send_pending()

    def _lose(self) -> None:
        self._tell(
            f"{self.name} was unplugged; plug it back in before --patience ends, or end with Ctrl-C"
        )
        self._told = ""
        self._rest = [Arrival(piece, elapsed_s()) for piece in self.close()]

    def _welcome(self, line: Line, identity: Identity) -> list[Arrival]:
        if differing := differences(self._first, identity):
            line.close()
            self._tell_once(another_board(line.port, differing))
            return []
        self._line = line
        self.identity, self.port = identity, line.port
        self._tell(f"the {identity.device} board is back")
        return [Arrival(Back(identity), elapsed_s())]

    def _tell_once(self, text: str) -> None:
        if text != self._told:
            self._told = text
            self._tell(text)


def another_board(port: str, differing: str) -> str:
    """Return the message that another board answers at a port."""
    return (
        f"the board at {port} is another one ({differing}), so its samples are ignored; plug the "
        "first board back in, or end with Ctrl-C"
    )
