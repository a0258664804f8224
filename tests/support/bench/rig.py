"""Make a complete bench: three boards, their cables, a capsule in a gut, and what drives them.

Commands run in the process of the test, by the bench's clock: instead of waiting for the boards,
they let them run, so that a minute of the bench takes a second.
"""

import json
from collections import deque
from collections.abc import Callable, Iterable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import serial

from capsule.bench import (
    board,
    clock,
    fold,
    line,
    loop,
    recorder,
    survey_bench,
    survey_command,
    survey_run,
    wave,
)
from support.bench import emulated
from support.bench.emulated import HALF_STEPS_PER_MM, EmulatedBoard
from support.bench.folding import FoldingOrigami
from support.command import parsers

WAVELENGTH_MM, PITCH_MM = 80.0, 6.3
# Way of the capsule for a mm of the wave, unfolded and folded.
ONWARD, BACK = 0.02, -0.006
# Time that the boards run before the world advances: no motor moves through a switch in it.
STRETCH_US = 50_000
# Interval at which the boards are read; a shorter one only takes longer.
LOOK_EVERY_S = 0.2
BOOT_LOADER_US = 1_000_000


class Gut:
    """A world by formula: the wave carries a capsule on, and back while the origami is folded.

    `head_mm` is the true place of the head.
    """

    def __init__(
        self, motor: EmulatedBoard, origami: FoldingOrigami, logger: EmulatedBoard
    ) -> None:
        self._motor, self._origami, self._logger = motor, origami, logger
        # The cam shaft on the peristalsis board's motor, whose index closes a switch.
        turn = WAVELENGTH_MM * HALF_STEPS_PER_MM
        motor.set_cam(turn, turn / 3, turn / 20)
        self._wave_mm = self.head_mm = 0.0

    def __call__(self) -> None:
        """Move thread and capsule according to the motors in the last stretch of time."""
        self._origami()
        before_mm, self._wave_mm = self._wave_mm, self._motor.half_steps / HALF_STEPS_PER_MM
        pace = np.interp(self._origami.folded, [0, 1], [ONWARD, BACK])
        self.head_mm += pace * (self._wave_mm - before_mm)
        behind_mm = self.head_mm - PITCH_MM * np.arange(4)
        angle = 2 * np.pi * (behind_mm - self._wave_mm) / WAVELENGTH_MM
        self._logger.set_voltages(*2500 - 300 * np.cos(angle))


class Killed(BaseException):
    """The end of a program that is killed: it sends and writes nothing any more."""


class Port:
    """An open serial port in memory, which resets its board: who waits lets the bench run."""

    timeout = 0.0

    def __init__(self, cable: "Cable", rig: "Rig") -> None:
        self._cable, self._rig = cable, rig
        self.content = b""
        if not cable.plugged:
            raise FileNotFoundError
        cable.end, cable.boots_for_us = self, BOOT_LOADER_US

    def close(self) -> None:
        """Close it."""
        if self._cable.end is self:
            self._cable.end = None

    @property
    def in_waiting(self) -> int:
        """Number of bytes that have arrived."""
        if self._rig.killed:
            raise Killed
        if self._cable.end is not self:
            raise serial.SerialException("the port has disappeared")
        return len(self.content)

    def read(self, size: int) -> bytes:
        """Return bytes that have arrived, and let the bench run if there are none."""
        if not self.content and self.timeout:
            self._rig.rest(self.timeout)
        content, self.content = self.content[:size], self.content[size:]
        return content

    def write(self, content: bytes) -> None:
        """Send bytes."""
        if not self._rig.killed and self.in_waiting >= 0:
            self._cable.sent += content


class Cable:
    """A board on a cable, whose other end is a `Port` if a program has opened it.

    An opened port resets the board, which waits in its boot loader; a Mega's hangs if it hears
    a byte. While the port is closed, the board's bytes are lost.
    """

    def __init__(self, board: EmulatedBoard) -> None:
        self._board, self.end, self.sent = board, None, b""
        self.boot_loader_heard = False
        self.plug()

    def plug(self) -> None:
        """Plug the cable in; a board that the port powers starts."""
        self.plugged, self.boots_for_us = True, BOOT_LOADER_US

    def unplug(self) -> None:
        """Unplug the cable; bytes that the program has not read are lost."""
        self.plugged, self.end = False, None

    def step(self, now_us: int, until_us: int) -> None:
        """Run the board from now to a point in time, and transfer the bytes of both sides."""
        received, self.sent = self.sent, b""
        if not self.plugged:
            self._board.skip(until_us)
        elif self.boots_for_us > 0:
            self.boot_loader_heard |= bool(received)
            self._board.skip(until_us)
            self.boots_for_us -= until_us - now_us
            if self.boots_for_us <= 0:
                self._board.reset()
        else:
            self._board.deliver(received)
            self._board.advance(until_us)
        sent = self._board.take_sent()
        if self.end:
            self.end.content += sent


# What a test does while a command runs: as soon as the condition holds, the act, and then the next.
Then = Iterable[tuple[Callable[[], bool], Callable[[], object]]]


class Rig:
    """A bench of boards; their firmware runs in the emulator."""

    def __init__(self, folder: Path, monkeypatch: object) -> None:
        self.folder, self.killed, self._now_us = folder / "tuesday", False, 0
        kinds = {"logger": emulated.LOGGER, "wave": emulated.PERISTALSIS, "fold": emulated.FOLD}
        boards = {name: EmulatedBoard(kind) for name, kind in kinds.items()}
        self._wave_board, self.origami = boards["wave"], FoldingOrigami(boards["fold"])
        cables = {name: Cable(board) for name, board in boards.items()}
        self.cables = SimpleNamespace(**cables)
        self.gut = Gut(self._wave_board, self.origami, boards["logger"])
        self._then: deque = deque()
        self.stop = SimpleNamespace(reason="", close=lambda: None)
        # Commands get the bench's ports and its clock in place of the computer's.
        replace = monkeypatch.setattr
        replace(serial, "serial_for_url", lambda port, *_, **__: Port(cables[port], self))
        time = SimpleNamespace(monotonic=lambda: self.now_s, sleep=self.rest)
        for module in (board, clock, line, loop, wave):
            replace(module, "time", time)
        dates = SimpleNamespace(now=self._date, fromisoformat=datetime.fromisoformat)
        for module in (recorder, survey_command, survey_run):
            replace(module, "datetime", dates)
        for module in (recorder, survey_command):
            replace(module, "StopRequest", lambda: self.stop)
        # The main thread waits for the bench, by the computer's clock.
        replace(wave.Drive, "_renew", lambda drive: None)
        for module, name in ((survey_bench, "LOOK_EVERY_S"), (fold, "READ_TIMEOUT_S")):
            replace(module, name, LOOK_EVERY_S)
        monkeypatch.chdir(folder)
        clock.AWAKE.__init__()

    @property
    def now_s(self) -> float:
        """The bench's time in seconds."""
        return self._now_us / 1e6

    def _date(self, _zone: object) -> datetime:
        return datetime(2026, 1, 1, tzinfo=UTC) + timedelta(seconds=self.now_s)

    def run(self, words: str, then: Then) -> None:
        """Run capsule record or capsule survey on these boards to its end."""
        self._then, self.stop.reason, self.killed = deque(then), "", False
        command, *options = words.split()
        options = parsers()[command].parse_args(options)
        try:
            if command == "record":
                recorder.record(options)
            else:
                survey_command.check(options)
                survey_command.survey(options)
        finally:
            assert not self._then, "the command ended before what the test waits for"

    def rest(self, seconds: float) -> None:
        """Run the bench for this time, and do what is next if its condition holds."""
        length_us = round(seconds * 1e6)
        end_us, stretch_us = self._now_us + length_us, min(STRETCH_US, length_us)
        while self._now_us < end_us:
            until_us = self._now_us + stretch_us
            self.gut()
            for cable in vars(self.cables).values():
                cable.step(self._now_us, until_us)
            self._now_us = until_us
        if self._then and self._then[0][0]():
            self._then.popleft()[1]()

    def kill(self) -> None:
        """Kill the program at once."""
        self.killed = True
        raise Killed

    def at_rest(self) -> bool:
        """Return whether origami and wave rest, unfolded, after a program has ended."""
        self.rest(2.0)
        return self.origami.folded == 0.0 and self._wave_board.coils == 0

    def events(self) -> list[dict]:
        """Read the session's log of events."""
        (path,) = self.folder.glob("events.jsonl*")
        return [json.loads(line) for line in path.read_text().splitlines()]

    def stream(self) -> list[list[str]]:
        """Read the rows of the session's stream."""
        (path,) = self.folder.glob("stream.csv*")
        return [line.split(",") for line in path.read_text().splitlines()[1:]]
