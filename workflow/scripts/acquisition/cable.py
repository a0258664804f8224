"""The cable between a simulated board and a program, on every system a socket on this machine.

The cable behaves as a USB port with an Arduino behind it: opening the port resets the board, which
then waits in its boot loader; closing it throws away what the board sends; pulled out, the
port is gone. It can spoil bytes, and it knows which frames came through whole.
"""

import contextlib
import socket
import time
from collections.abc import Callable
from typing import Protocol

BOOT_LOADER_US = 1_000_000
# A Mega's boot loader takes a byte that comes while it waits for an upload, and is stuck.
STUCK_BOOT_LOADER_US = 7_000_000
BAUD_TOLERANCE = 0.04


class Board(Protocol):
    """What a cable needs of a board; times in microseconds since the bench began."""

    baud: int

    def advance(self, until_us: int) -> None:
        """Run to a point in time."""

    def skip(self, until_us: int) -> None:
        """Let time pass without the firmware."""

    def reset(self) -> None:
        """Restart the firmware."""

    def take_sent(self) -> bytes:
        """Take what the board has sent."""

    def deliver(self, received: bytes) -> None:
        """Hand bytes to the board."""


class Cable:
    """A plugged-in board, as the program on the other side sees it.

    Parameters
    ----------
    board : Board
        The board at the end of the cable.
    spoil : callable, optional
        Makes from one frame of the board what arrives of it.
    resets : bool
        Opening the port resets the board, and the port feeds it.
    sticks : bool
        A byte that comes too early leaves its boot loader stuck, as on a Mega.

    Attributes
    ----------
    whole : list of bytes
        The frames that the program was handed unspoilt.
    spoilt : int
        How many frames were not.
    """

    def __init__(
        self,
        board: Board,
        spoil: Callable[[bytes], bytes] | None = None,
        resets: bool = True,
        sticks: bool = True,
    ) -> None:
        self.board = board
        self.spoil = spoil
        self.resets = resets
        self.sticks = sticks
        self.whole: list[bytes] = []
        self.spoilt = 0
        self.plugged = False
        self.boot_loader_stuck = False
        self._opened = False
        self._boot_ends_us = 0
        self._unfinished = b""
        self.plug()

    @property
    def port(self) -> str:
        """The port's name, as a user types it."""
        raise NotImplementedError

    def plug(self) -> None:
        """Put the cable in; a board without other power starts."""
        self._open_port()
        self.plugged = True
        if self.resets:
            self._boot_ends_us = -1

    def unplug(self, after_bytes: bytes = b"") -> None:
        """Pull the cable, maybe in the middle of a frame; what was sent before has been read."""
        if after_bytes:
            self._write(after_bytes)
        self.wait_until_read()
        self._close_port()
        self.plugged = self._opened = False
        self._unfinished = b""

    def press_reset(self) -> None:
        """Press the board's reset button, maybe in the middle of a frame."""
        self._boot_ends_us = -1

    @property
    def opened(self) -> bool:
        """A program has the port open."""
        return self._opened

    def step(self, now_us: int, until_us: int) -> None:
        """Let the board run from now to a point in time, and pass on what both sides said."""
        opened = self.plugged and self._is_opened()
        if opened and not self._opened:
            # Opening throws away what has come in; it is done within milliseconds.
            time.sleep(0.03)
            self._unfinished = b""
            if self.resets:
                self._boot_ends_us = now_us + BOOT_LOADER_US
        self._opened = opened
        if self._boot_ends_us < 0:
            self._boot_ends_us = now_us + BOOT_LOADER_US
        received = self._read() if opened else b""
        if not self.plugged and self.resets:
            self.board.skip(until_us)
        elif self._boot_ends_us:
            self._wait_in_boot_loader(received, until_us)
        else:
            self.board.deliver(self._as_heard(received))
            self.board.advance(until_us)
        self._pass_on(self.board.take_sent())

    def _wait_in_boot_loader(self, received: bytes, until_us: int) -> None:
        if received and self.sticks and not self.boot_loader_stuck:
            self.boot_loader_stuck = True
            self._boot_ends_us += STUCK_BOOT_LOADER_US
        self.board.skip(until_us)
        if until_us >= self._boot_ends_us:
            self._boot_ends_us = 0
            self.board.reset()

    def _as_heard(self, content: bytes) -> bytes:
        """Scramble what is sent at one rate and heard at another."""
        if content and abs(self._host_baud() / self.board.baud - 1) > BAUD_TOLERANCE:
            return bytes((byte >> 1) ^ 0xA5 for byte in content)
        return content

    def _pass_on(self, sent: bytes) -> None:
        if not self._opened:
            return  # nobody listens: the port's chip throws it away
        *frames, self._unfinished = (self._unfinished + sent).split(b"\n")
        for frame in (content + b"\n" for content in frames):
            heard = self._as_heard(self.spoil(frame) if self.spoil else frame)
            if self._write(heard) and frame in heard:
                self.whole.append(frame)
            else:
                self.spoilt += 1

    def _open_port(self) -> None:
        raise NotImplementedError

    def _close_port(self) -> None:
        raise NotImplementedError

    def _is_opened(self) -> bool:
        raise NotImplementedError

    def _read(self) -> bytes:
        raise NotImplementedError

    def _write(self, content: bytes) -> bool:
        raise NotImplementedError

    def _host_baud(self) -> int:
        return self.board.baud

    def wait_until_read(self, limit_s: float = 5.0) -> None:
        """Wait until the program has read what lies in the port."""


class SocketCable(Cable):
    """A socket on this machine, which every system has."""

    _server: socket.socket
    _connection: socket.socket | None = None
    _number = 0

    @property
    def port(self) -> str:
        """The port's name, as a user types it."""
        return f"socket://127.0.0.1:{self._number}"

    def _open_port(self) -> None:
        self._server = socket.create_server(("127.0.0.1", self._number), backlog=1)
        self._number = self._server.getsockname()[1]
        self._server.setblocking(False)

    def _close_port(self) -> None:
        self._hang_up()
        self._server.close()

    def _hang_up(self) -> None:
        if self._connection:
            self._connection.close()
            self._connection = None

    def _is_opened(self) -> bool:
        if self._connection is None:
            with contextlib.suppress(BlockingIOError):
                self._connection, _ = self._server.accept()
                self._connection.setblocking(False)
        return self._connection is not None

    def _read(self) -> bytes:
        if self._connection is None:
            return b""
        try:
            received = self._connection.recv(4096)
        except BlockingIOError:
            return b""
        except ConnectionError:
            received = b""
        if not received:
            self._hang_up()
        return received

    def _write(self, content: bytes) -> bool:
        if self._connection is None:
            return False
        try:
            self._connection.setblocking(True)
            self._connection.sendall(content)
            self._connection.setblocking(False)
        except OSError:
            self._hang_up()
            return False
        return True

    def wait_until_read(self, limit_s: float = 5.0) -> None:
        """Wait until the program has read what lies in the port."""
        # What is in flight arrives after the other side has shut down.
        if self._connection:
            with contextlib.suppress(OSError):
                self._connection.shutdown(socket.SHUT_WR)
            time.sleep(0.1)
