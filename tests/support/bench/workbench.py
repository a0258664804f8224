"""A simulated bench: several boards on cables share one clock, and a function sets their inputs."""

import contextlib
import os
import select
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from support.bench.emulated import EmulatedBoard, World

with contextlib.suppress(ImportError):  # Windows has no pseudo-terminals
    import tty

STRETCH_S = 0.005
BOOT_LOADER_US = 1_000_000
# A byte that reaches a Mega's boot loader while it waits for an upload blocks the boot loader.
STUCK_BOOT_LOADER_US = 7_000_000


class TerminalCable:
    """A board on a cable, which is a pseudo-terminal, as the program at the other end sees it.

    If a program opens the port, the board resets and waits in its boot loader. While the port is
    closed, the board's bytes are lost.

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


class Workbench:
    """A clock that runs the boards on their cables, at `speed` times real time or without a limit.

    The world sets voltages and switches: it is called before each stretch of time, with the
    stretch's start and end in seconds.
    """

    def __init__(
        self, *cables: TerminalCable, world: World | None = None, speed: float | None = None
    ) -> None:
        self._cables = cables
        self._world = world
        self.speed = speed
        self.now_us = 0

    @property
    def now_s(self) -> float:
        """The bench's time in seconds."""
        return self.now_us / 1e6

    def run(self, until: Callable[[], bool], limit_s: float = 30.0, stretch_us: int = 5000) -> None:
        """Run until a condition holds.

        Raises
        ------
        TimeoutError
            The condition does not hold after `limit_s` seconds of the wall clock.
        """
        started, started_us = time.monotonic(), self.now_us
        while not until():
            passed = time.monotonic() - started
            if passed > limit_s:
                raise TimeoutError(
                    f"the condition did not hold within {limit_s} s ({self.now_s} s of the bench)"
                )
            if self.speed:
                ahead = (self.now_us - started_us) / 1e6 / self.speed - passed
                if ahead > 0:
                    time.sleep(min(ahead, 0.01))
                    continue
            end_us = self.now_us + stretch_us
            if self._world:
                self._world(self.now_us / 1e6, end_us / 1e6)
            for cable in self._cables:
                cable.step(self.now_us, end_us)
            self.now_us = end_us

    def run_for(self, seconds: float, stretch_us: int = 5000) -> None:
        """Run for this many seconds of the bench's time."""
        end_us = self.now_us + int(seconds * 1e6)
        self.run(lambda: self.now_us >= end_us, stretch_us=stretch_us)


class Clock:
    """A world whose voltages encode the number of the stretch, so each sample tells its true time.

    It is in two counts of 10 bits and in their complements, so that no two samples can be mixed.
    """

    def __init__(self, board: EmulatedBoard) -> None:
        self._board = board

    def __call__(self, start_s: float, end_s: float) -> None:
        """Set the voltages of one stretch, in the middle of each step of the ADC."""
        del end_s
        told = np.array(divmod(round(start_s / STRETCH_S), 1024))
        voltages_mv = (np.concatenate([told, 1023 - told]) + 0.5) * 5000 / 1024
        self._board.set_voltages(voltages_mv, voltages_mv)
