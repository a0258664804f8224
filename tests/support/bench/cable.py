"""The cable between a simulated board and a program: a pseudo-terminal.

The cable behaves as a USB port with an Arduino behind it. If a program opens the port, the board
resets and waits in its boot loader. While the port is closed, the board's bytes are lost. If the
cable is unplugged, the port disappears.
"""

import contextlib
import os
import select
import time
from pathlib import Path

from support.bench.emulated import EmulatedBoard

with contextlib.suppress(ImportError):  # Windows has no pseudo-terminals
    import tty

BOOT_LOADER_US = 1_000_000
# A byte that reaches a Mega's boot loader while it waits for an upload blocks the boot loader.
STUCK_BOOT_LOADER_US = 7_000_000


class TerminalCable:
    """A board on a cable, as the program at the other end sees it.

    `link` is the permanent name of its pseudo-terminal, like one in /dev/serial/by-id.
    `sticks`: a byte that comes too early blocks the boot loader, as on a Mega. `samples` that the
    board has sent to the program are counted.
    """

    def __init__(self, board: EmulatedBoard, link: Path, sticks: bool = True) -> None:
        self.board, self.link = board, link
        self.sticks = sticks
        self.samples = 0
        self.plugged = False
        self.boot_loader_stuck = False
        self._opened = False
        self._boot_ends_us = 0
        self.plug()

    @property
    def port(self) -> str:
        """The port's name for the command line."""
        return str(self.link)

    def plug(self) -> None:
        """Plug the cable in; a board that the port powers starts."""
        self._open_port()
        self.plugged = True
        self._boot_ends_us = -1

    def unplug(self) -> None:
        """Unplug the cable; bytes that the program has not read are lost."""
        self._close_port()
        self.plugged = self._opened = False

    def step(self, now_us: int, until_us: int) -> None:
        """Run the board from now to a point in time, and transfer the bytes of both sides."""
        opened = self.plugged and self._is_opened()
        if opened and not self._opened:
            # Opening discards the bytes that have arrived; it takes milliseconds.
            time.sleep(0.03)
            self._boot_ends_us = now_us + BOOT_LOADER_US
        self._opened = opened
        if self._boot_ends_us < 0:
            self._boot_ends_us = now_us + BOOT_LOADER_US
        received = self._read() if opened else b""
        if not self.plugged:
            self.board.skip(until_us)
        elif self._boot_ends_us:
            self._wait_in_boot_loader(received, until_us)
        else:
            self.board.deliver(received)
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

    def _pass_on(self, sent: bytes) -> None:
        if not self._opened:
            return  # the port is closed, so its chip discards the bytes
        self._write(sent)
        self.samples += sent.count(b"$D,")

    def _open_port(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.link.symlink_to(os.ttyname(slave))
        os.close(slave)
        os.set_blocking(self._master, False)

    def _close_port(self) -> None:
        os.close(self._master)
        self.link.unlink()

    def _is_opened(self) -> bool:
        poll = select.poll()
        poll.register(self._master, select.POLLIN)
        return not dict(poll.poll(0)).get(self._master, 0) & select.POLLHUP

    def _read(self) -> bytes:
        with contextlib.suppress(OSError):  # nothing there, or closed a moment ago
            return os.read(self._master, 4096)
        return b""

    def _write(self, content: bytes) -> None:
        with contextlib.suppress(OSError):  # closed meanwhile
            while content:
                # A program that is slower than this board is waited for; a real board is slower.
                select.select([], [self._master], [], 5)
                content = content[os.write(self._master, content) :]
