"""Run capsule survey in step with a bench of boards, so that minutes of the bench take a second."""

import atexit
import contextlib
import functools
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar

from support.bench.cable import TerminalCable
from support.bench.clocked_survey import ANSWER, ASK, ENDED
from support.bench.workbench import Workbench

PROGRAM = Path(__file__).with_name("clocked_survey.py")
# Time limit, in s, for the kernel to pass bytes on, and interval between two looks.
_PASSED_ON_WITHIN_S = 1.0
_LOOK_AGAIN_S = 0.0001


@functools.cache
def _server() -> socket.socket:
    """Start the program that forks for each survey, and return its socket."""
    ours, theirs = socket.socketpair()
    with theirs:
        handle = theirs.fileno()
        server = subprocess.Popen([sys.executable, str(PROGRAM), str(handle)], pass_fds=[handle])

    def end() -> None:
        ours.close()
        server.wait()

    atexit.register(end)
    return ours


class SteppedCable(TerminalCable):
    """A cable whose bytes arrive before a step of the bench ends."""

    _inbox = b""
    _written = 0

    def prefetch(self) -> int:
        """Take the bytes that the program has sent, and return their number."""
        received = TerminalCable._read(self) if self.plugged else b""
        self._inbox += received
        return len(received)

    def _read(self) -> bytes:
        received, self._inbox = self._inbox + super()._read(), b""
        return received

    def _is_opened(self) -> bool:
        opened = super()._is_opened()
        if not opened:
            # The last bytes of a program must not reach the boot loader when the next one opens it.
            self._read()
        return opened

    def _write(self, content: bytes) -> bool:
        self._written += len(content)
        return super()._write(content)

    def settle(self) -> None:
        """Wait until the written bytes can be read."""
        if not self._written or not self.plugged:
            return
        deadline = time.monotonic() + _PASSED_ON_WITHIN_S
        end = os.open(self._name, os.O_RDWR | os.O_NOCTTY)
        while self.waiting(end) < self._written and time.monotonic() < deadline:
            time.sleep(_LOOK_AGAIN_S)
        os.close(end)
        self._written = 0

    def wait_until_read(self, limit_s: float = 5.0) -> None:
        """Do nothing: the program stands still, and unread bytes are lost."""


class Surveyor:
    """A running capsule survey, in step with a bench; call `end_all` after each test.

    The boards run for `stretch_us` at most before the world advances.
    """

    started: ClassVar[list["Surveyor"]] = []

    def __init__(
        self,
        folder: Path,
        bench: Workbench,
        cables: Sequence[SteppedCable],
        stretch_us: int,
        *options: object,
    ) -> None:
        self._bench, self._cables, self._stretch_us = bench, cables, stretch_us
        self._asked, ask = os.pipe()
        answer, self._answering = os.pipe()
        number = len(list(folder.glob("printed-*")))
        self._printed = folder / f"printed-{number}"
        self._errors = folder / f"errors-{number}"
        with self._printed.open("w") as printed, self._errors.open("w") as errors:
            handles = [ask, answer, printed.fileno(), errors.fileno()]
            call = {"folder": str(folder), "arguments": [str(option) for option in options]}
            self._server = _server()
            socket.send_fds(self._server, [json.dumps(call).encode()], handles)
        os.close(ask)
        os.close(answer)
        (self._pid,) = ENDED.unpack(self._server.recv(ENDED.size))
        self.returncode: int | None = None
        self._sent = 0
        self._unanswered = False
        self.started.append(self)

    @classmethod
    def end_all(cls) -> None:
        """End the surveys that a test has left running."""
        for surveyor in cls.started:
            surveyor.kill()
            surveyor._let_go()
        cls.started.clear()

    @property
    def printed(self) -> str:
        """The output so far."""
        return self._printed.read_text(encoding="utf-8")

    @property
    def errors(self) -> str:
        """The errors printed so far."""
        return self._errors.read_text(encoding="utf-8")

    def run(self, until: Callable[[], bool] = lambda: False, limit_s: float = 120.0) -> None:
        """Run the survey until a condition holds, or until it has ended.

        Raises
        ------
        TimeoutError
            Neither happened within the time limit.
        """
        deadline = time.monotonic() + limit_s
        if self._unanswered:
            self._answer()
        while True:
            if time.monotonic() > deadline:
                raise TimeoutError(f"after {self._bench.now_s:.1f} s of the bench: {self.printed}")
            content = os.read(self._asked, ASK.size)
            if not content:
                self._wait()
                return
            seconds, sent = ASK.unpack(content)
            self._take_all(sent)
            if seconds:
                stretch_us = min(self._stretch_us, round(seconds * 1e6))
                self._bench.run_for(seconds, stretch_us=stretch_us)
            for cable in self._cables:
                cable.settle()
            if until():
                self._unanswered = True
                return
            self._answer()

    def expect(self, status: int, *words: str) -> None:
        """Run the survey to its end, and check its exit status and its messages."""
        self.run()
        output = f"{self.printed}\n{self.errors}"
        assert self.returncode == status, f"{self.returncode}:\n{output}"
        assert "Traceback" not in output, output
        for word in words:
            assert word in output, f"{word!r} not in:\n{output}"

    def send_signal(self, number: int = signal.SIGINT) -> None:
        """Press Ctrl-C, or send another signal."""
        os.kill(self._pid, number)

    def kill(self) -> None:
        """Kill the survey at once."""
        if self.returncode is None:
            os.kill(self._pid, signal.SIGKILL)
            self._wait()

    def _wait(self) -> None:
        if self.returncode is None:
            (self.returncode,) = ENDED.unpack(self._server.recv(ENDED.size))

    def _answer(self) -> None:
        self._unanswered = False
        with contextlib.suppress(BrokenPipeError):  # it has ended meanwhile
            os.write(self._answering, ANSWER.pack(self._bench.now_s))

    def _take_all(self, sent: int) -> None:
        """Wait until all sent bytes have arrived; those of an unplugged cable are lost."""
        deadline = time.monotonic() + _PASSED_ON_WITHIN_S
        while self._sent < sent and time.monotonic() < deadline:
            arrived = sum(cable.prefetch() for cable in self._cables)
            self._sent += arrived
            if not arrived:
                time.sleep(_LOOK_AGAIN_S)
        self._sent = sent

    def _let_go(self) -> None:
        os.close(self._asked)
        os.close(self._answering)
