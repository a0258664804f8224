"""A board at a serial port: found, identified, commanded, and connected again when unplugged."""

import contextlib
import os
import re
import time
from collections.abc import Callable, Generator, Iterable, Iterator

from serial.tools import list_ports

from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardLostError,
    BoardNotFoundError,
    LineLostError,
    NoAnswerError,
    RefusedError,
    WrongBaudError,
    WrongBoardError,
)
from capsule.bench.clock import AWAKE, elapsed_s
from capsule.bench.line import BAUD, READ_TIMEOUT_S, Arrival, Line, UsbPort
from capsule.bench.protocol import VERSION, Acknowledgement, Damaged, Event, Identity, Refusal

# Opening a port restarts an Arduino. A Mega's boot loader then waits for up to two seconds. A byte
# that arrives meanwhile makes it wait for an upload. So the program sends nothing at first, and a
# board that the opening has restarted says by itself who it is.
QUIET_S = 3.0
ASK_EVERY_S = 0.1
ANSWER_S = 2.0  # 20 questions: with 1 % of bytes damaged, one answer in four is whole
LOOK_EVERY_S = 0.02
_ENOUGH = 20  # bytes that tell text from garbage
# USB numbers (vendor, product) of Arduino's own Mega 2560 and UNO. Clones have the numbers of a
# general USB serial chip, which lab devices have too; the user names their ports.
USB_IDS = {
    (vendor, product)
    for vendor in (0x2341, 0x2A03)
    for product in (0x0001, 0x0010, 0x0042, 0x0043, 0x0242, 0x0243)
}
# Numbers that a board must report, by its kind, with their smallest and largest values; those with
# whole limits are whole.
_NUMBERS: dict[str, dict[str, tuple[float, float]]] = {
    "logger": {
        "protocol": (VERSION, VERSION),
        "rate_hz": (1, 10_000),
        "channels": (1, 64),
        "adc_bits": (1, 32),
        "vref_mv": (1, 100_000),
        "series_ohm": (1, 1_000_000_000),
    },
    "peristalsis": {"protocol": (VERSION, VERSION), "wavelength_mm": (1.0, 10_000.0)},
    "fold": {"protocol": (VERSION, VERSION)},
}
PURPOSES = {
    "logger": "record with it (--port)",
    "peristalsis": "drive the wave with it (--drive)",
    "fold": "fold the origami with it (capsule survey --fold)",
}
# A command is sent again after so long without an answer, or after a refusal.
CONFIRM_S, AGAIN_S = 0.25, 1.0
ANSWERS_WITHIN_S = 3.0
KNOCK_EVERY_S = 0.2
# Opening a port resets its board, and a fold board moves then. So a port whose board has not
# identified itself is not opened again sooner.
REOPEN_AFTER_S = 10.0
# A board that is reset more often in a survey has a weak supply: no wave is started again, and none
# folds the origami, which each reset lets go.
MOST_RESETS = 3


class Board:
    """One board: its line, its return when it was unplugged, and commands that it must confirm.

    Making one opens the port, and waits until the board has said what it is.

    Attributes
    ----------
    port : str
        Present name of the port.
    line : Line, optional
        The open line; None if the board is not connected.
    identity : Identity
        The board's newest description of itself.
    pending : tuple of str
        Commands that the board has not confirmed.
    insists : bool
        Whether a command that the board refuses is sent again.

    Raises
    ------
    AcquisitionError
        The port cannot be opened; another board answers, or none, or the baud rate is wrong.
    """

    def __init__(self, port: str, baud: int, wanted: str, tell: Callable[[str], None]) -> None:
        self.port, self._baud, self._usb_port = port, baud, UsbPort(port)
        self._tell, self._told, self.insists = tell, "", False
        self.line: Line | None = None
        self.identity = Identity(wanted, {})
        # What has arrived, but was not read yet.
        self._rest: list[Arrival] = []
        self.pending: tuple[str, ...] = ()
        self._refused = ""
        self._due_s = self._heard_s = 0.0
        # The steps of a port that is opened, until its board has said what it is.
        self._opening = self._open()
        with contextlib.closing(self._opening):
            for _ in self._opening:
                time.sleep(LOOK_EVERY_S)
        self._open_s = 0.0  # a board that is lost can be back at once

    def _open(self) -> Generator[None]:
        """Open the port and identify its board in short steps, so that others are served meanwhile.

        The port is closed if this fails, or is given up before the board has answered.
        """
        line = Line(self._usb_port.current_name(), self._baud)
        opened_s = time.monotonic()
        self._open_s = opened_s + REOPEN_AFTER_S
        heard: list[Arrival] = []
        try:
            while True:
                heard += line.receive(0)
                told = [each.event for each in heard if isinstance(each.event, Identity)]
                if told:
                    break
                yield
                now_s = time.monotonic()
                if now_s - opened_s < QUIET_S:
                    continue
                # What sends text without frames is no board of this bench, so it is not even asked.
                stranger = len(line.first_bytes) >= _ENOUGH and b"$" not in line.first_bytes
                if stranger or now_s - opened_s > QUIET_S + ANSWER_S:
                    raise _silence_of(line, heard)
                if now_s - line.sent_s >= ASK_EVERY_S:
                    line.send("identify")
            _check(line.port, self.identity, told[-1])
        except BaseException as fault:
            line.close()
            if isinstance(fault, LineLostError):
                told_by = f"the board at {line.port} was disconnected before it identified itself"
                raise NoAnswerError(f"{told_by}: {fault}") from fault
            raise
        if self.identity.entries:
            self._tell(f"the {self.identity.device} board is back")
            self._rest.append(Arrival(told[-1], elapsed_s(), fresh=True))
        # A running board sends samples meanwhile.
        self._rest += [each for each in heard if each.event != told[-1]]
        self.line, self.port, self.identity = line, line.port, told[-1]
        self._heard_s = AWAKE.now_s()

    @property
    def connected(self) -> bool:
        """Return whether the board is connected and identified."""
        return self.line is not None

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
        try to connect it; then its identity is fresh. Another board is not accepted.
        """
        try:
            if self.line:
                self._rest += self.line.receive(timeout_s)
            else:
                self._come_back(timeout_s)
        except LineLostError:
            self._lose()
        except AcquisitionError as reason:
            if not isinstance(reason, BoardNotFoundError) and str(reason) != self._told:
                self._told = str(reason)
                self._tell(f"still waiting: {reason}")
        arrivals, self._rest = self._rest, []
        for arrival in arrivals:
            if not isinstance(arrival.event, Damaged):
                self._heard_s = AWAKE.now_s()
            self._note_answer(arrival.event)
            yield arrival
        self._send_pending()

    def _come_back(self, timeout_s: float) -> None:
        """Open the port again when its time has come, or look at it; errors as at first."""
        now_s = time.monotonic()
        if now_s >= self._open_s:
            self._opening.close()
            self._open_s = now_s + KNOCK_EVERY_S
            self._opening = self._open()
        next(self._opening, None)
        if not self.line:
            time.sleep(timeout_s)

    def send(self, payload: str) -> None:
        """Send a command, if the board is connected."""
        if self.line:
            try:
                self.line.send(payload)
            except LineLostError:
                self._lose()

    def close(self) -> list[Damaged]:
        """Close the port; return the rest of an unfinished frame."""
        self._opening.close()
        line, self.line = self.line, None
        return line.close() if line else []

    def _lose(self) -> None:
        self._tell(
            f"{self.name} was unplugged; plug it back in before --patience ends, or end with Ctrl-C"
        )
        self._told = ""
        self._rest += [Arrival(piece, elapsed_s()) for piece in self.close()]

    def want(self, *commands: str) -> None:
        """Send these commands instead of all unconfirmed ones; each until the board confirms it."""
        if self.pending != commands:
            self.pending = commands
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
        while self.pending and self.connected and time.monotonic() < until_s:
            for _ in self.read(READ_TIMEOUT_S):
                pass
        if not self.connected:
            raise AcquisitionError(f"{self.name} was disconnected; plug it in, and start again")
        if self._refused:
            raise RefusedError(f"{self.name} refuses {command!r}: {self._refused}")
        if self.pending:
            raise NoAnswerError(
                f"{self.name} does not answer {command!r}; try another cable, or press the reset "
                "button of the board"
            )

    def _send_pending(self) -> None:
        """Send the first unconfirmed command, if it is due."""
        now_s = time.monotonic()
        if self.pending and now_s >= self._due_s:
            self._due_s = now_s + CONFIRM_S
            self.send(self.pending[0])

    def _note_answer(self, event: Event) -> None:
        """Go on with the next command if this event answers the present one."""
        name = self.pending[0].partition(",")[0] if self.pending else None
        match event:
            case Refusal(command=answered) if answered == name and self.insists:
                self._due_s = time.monotonic() + AGAIN_S
            case Acknowledgement(command=answered) | Refusal(command=answered) if answered == name:
                self._refused = event.reason if isinstance(event, Refusal) else ""
                self.pending = self.pending[1:]
                self._due_s = 0.0
                self._send_pending()


def connect(
    port: str | None,
    baud: int,
    wanted: str,
    tell: Callable[[str], None],
    skip: Iterable[str] = (),
) -> Board:
    """Return the board at a port, or find it at any port but those to `skip`.

    Opening a port restarts many devices, and a command can do anything to a device that is no board
    of this bench. So a search opens only ports with the USB numbers of the boards. For three
    seconds it only listens to them, before it asks.

    Raises
    ------
    AcquisitionError
        As of `Board`. A search finds no board, or more than one: the text says what each port
        answered, and which ports were left alone.
    """
    if port is not None:
        return Board(port, baud, wanted, tell)
    left = {os.path.realpath(port) for port in skip}
    found = sorted(list_ports.comports(), key=lambda port: str(port.device))
    ports = [port for port in found if os.path.realpath(port.device) not in left]
    candidates = [port.device for port in ports if (port.vid, port.pid) in USB_IDS]
    # Built-in ports and Bluetooth have no USB vendor number, so they are no Arduino.
    foreign = [
        f"{port.device} ({port.product or port.description}, {port.vid:04X}:{port.pid:04X})"
        for port in ports
        if port.vid is not None and port.device not in candidates
    ]
    if len(candidates) > 1:
        print(f"looking for the {wanted} at {', '.join(candidates)}")
    boards: list[Board] = []
    answers: list[AcquisitionError] = []
    with contextlib.ExitStack() as opened:
        for candidate in candidates:
            try:
                boards.append(Board(candidate, baud, wanted, tell))
                opened.callback(boards[-1].close)
            except AcquisitionError as answer:
                answers.append(answer)
        if len(boards) == 1:
            opened.pop_all()
            return boards[0]
    if boards:
        names = ", ".join(board.port for board in boards)
        raise BoardNotFoundError(
            f"found {len(boards)} boards of the kind {wanted}: {names}; choose one with --port"
        )
    told = [f"no {wanted} found at any USB port of an Arduino; plug it in, or name it with --port"]
    told += [f"  {answer}" for answer in answers]
    if foreign:
        told.append(
            f"not opened, since they can be other devices: {', '.join(foreign)}; if one of them "
            f"is the {wanted} (a clone of an Arduino), name it with --port"
        )
    raise BoardNotFoundError("\n".join(told))


def _silence_of(line: Line, heard: Iterable[Arrival]) -> AcquisitionError:
    """Return why a board has not said what it is, by what else it has sent."""
    content, port = line.first_bytes, line.port
    if not content:
        return NoAnswerError(
            f"nothing answers at {port}; check that this is the right port, and that the firmware "
            "is on the board (workflow/firmware)"
        )
    if not all(isinstance(arrival.event, Damaged) for arrival in heard):
        return NoAnswerError(
            f"the board at {port} sends frames but does not answer 'identify'; try another cable, "
            "or press the reset button of the board"
        )
    # Mere noise leaves most bytes printable.
    printable = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in content)
    if len(content) >= _ENOUGH and printable < 0.8 * len(content):
        return WrongBaudError(
            f"{port} sent bytes but no frame; this is probably the wrong baud rate (--baud is "
            f"{line.baud}, the firmware uses {BAUD})"
        )
    return WrongBoardError(
        f"the board at {port} runs another program: it sends {content[:40]!r}; upload the firmware "
        "(workflow/firmware)"
    )


def _check(port: str, first: Identity, identity: Identity) -> None:
    """Raise an error if another board answers than the first, or does not say all that it must."""
    if identity.device != first.device:
        purpose = PURPOSES.get(identity.device, "it does not belong to this bench")
        raise WrongBoardError(
            f"the board at {port} is the {identity.device} board, not the {first.device}: {purpose}"
        )
    if fault := _fault_of(identity):
        raise WrongBoardError(
            f"the {first.device} at {port} reports {fault}; upload the firmware of this version "
            "(workflow/firmware)"
        )
    if first.entries and (another := another_board(port, first, identity)):
        raise WrongBoardError(another)


def another_board(port: str, first: Identity, identity: Identity) -> str:
    """Return the message that a board differs in kind or electronics from the first one there."""
    before, now = ({"board": each.device, **each.entries} for each in (first, identity))
    differing = ", ".join(
        f"{key}={now.get(key)} instead of {before.get(key)}"
        for key in ("board", *_NUMBERS[first.device])
        if now.get(key) != before.get(key)
    )
    return differing and (
        f"the board at {port} is another one ({differing}), so its samples are ignored; plug the "
        "first board back in, or end with Ctrl-C"
    )


def _fault_of(identity: Identity) -> str:
    """Return the first fault in a board's description of itself; empty if there is none."""
    if "firmware" not in identity.entries:
        return "no firmware"
    for key, (least, most) in _NUMBERS[identity.device].items():
        value = identity.entries.get(key, "")
        form = r"[0-9]{1,10}" if isinstance(least, int) else r"[0-9]{1,10}(\.[0-9]{1,6})?"
        if not re.fullmatch(form, value) or not least <= float(value) <= most:
            return f"{key}={value}" if value else f"no {key}"
    return ""
