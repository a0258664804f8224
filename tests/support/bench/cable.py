"""Connect a board to a pseudo-terminal, which a program opens like a USB port."""

import contextlib
import os
import select
import time
from pathlib import Path

from capsule.bench.cable import Board, Cable

try:
    import fcntl
    import struct
    import tty
except ImportError:  # Windows: the socket serves there
    fcntl = None


class TerminalCable(Cable):
    """A pseudo-terminal; `link` is its permanent name, like one in /dev/serial/by-id."""

    def __init__(self, board: Board, link: Path, **settings: object) -> None:
        self.link = link
        super().__init__(board, **settings)

    @property
    def port(self) -> str:
        """The port's name for the command line."""
        return str(self.link)

    def _open_port(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self._name = os.ttyname(slave)
        os.close(slave)
        os.set_blocking(self._master, False)
        self.link.symlink_to(self._name)

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

    def _write(self, content: bytes) -> bool:
        while content:
            try:
                content = content[os.write(self._master, content) :]
            except BlockingIOError:
                # The program is slower than this board. A real board would not wait, but is slower.
                if not select.select([], [self._master], [], 5)[1]:
                    return False
            except OSError:  # closed meanwhile
                return False
        return True

    def _host_baud(self) -> int:
        tcgets2 = 0x802C542A
        return struct.unpack("4I20B2I", fcntl.ioctl(self._master, tcgets2, bytes(44)))[-1]

    @staticmethod
    def waiting(end: int) -> int:
        """Return the number of bytes in the port, given its open end."""
        count_waiting = 0x541B
        return struct.unpack("i", fcntl.ioctl(end, count_waiting, bytes(4)))[0]

    def wait_until_read(self, limit_s: float = 5.0) -> None:
        """Wait until the program has read all bytes in the port."""
        # Closing a pseudo-terminal discards unread bytes. The kernel passes bytes on with a delay,
        # so the port counts as empty only after it has been empty for a while.
        end = os.open(self._name, os.O_RDWR | os.O_NOCTTY)
        empty_since = started = time.monotonic()
        while (now := time.monotonic()) - empty_since < 0.05:
            if self.waiting(end):
                empty_since = now
            if now - started > limit_s:
                raise RuntimeError("the program does not read its port")
            time.sleep(0.002)
        os.close(end)
