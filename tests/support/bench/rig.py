"""Make a complete bench for surveys: three boards, their cables, a capsule in a gut, a survey.

The survey runs in the process of the test, by the bench's clock: instead of waiting for the boards,
it lets them run, so that a minute of the bench takes a second.
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
    survey_bench,
    survey_command,
    survey_run,
    wave,
)
from support.bench import emulated
from support.bench.emulated import HALF_STEPS_PER_MM
from support.bench.folding import FoldingOrigami
from support.bench.workbench import TerminalCable, Workbench
from support.command import parsers

WAVELENGTH_MM, PITCH_MM = 80.0, 6.3
# Way of the capsule for a mm of the wave, unfolded and folded.
ONWARD, BACK = 0.02, -0.006


class Gut:
    """A world by formula: the wave carries a capsule on, and back while the origami is folded.

    `head_mm` is the true place of the head.
    """

    def __init__(
        self,
        motor: emulated.EmulatedBoard,
        origami: FoldingOrigami,
        logger: emulated.EmulatedBoard,
    ) -> None:
        self._motor, self._origami, self._logger = motor, origami, logger
        # The cam shaft on the peristalsis board's motor, whose index closes a switch.
        turn = WAVELENGTH_MM * HALF_STEPS_PER_MM
        motor.set_cam(turn, turn / 3, turn / 20)
        self._wave_mm = self.head_mm = 0.0

    def __call__(self, start_s: float, end_s: float) -> None:
        """Move the capsule according to the motors in the last stretch of time."""
        del start_s, end_s
        before_mm, self._wave_mm = self._wave_mm, self._motor.half_steps / HALF_STEPS_PER_MM
        pace = np.interp(self._origami.folded, [0, 1], [ONWARD, BACK])
        self.head_mm += pace * (self._wave_mm - before_mm)
        behind_mm = self.head_mm - PITCH_MM * np.arange(4)
        angle = 2 * np.pi * (behind_mm - self._wave_mm) / WAVELENGTH_MM
        voltages_mv = 2500 - 300 * np.cos(angle)
        self._logger.set_voltages(voltages_mv, voltages_mv)


class Killed(BaseException):
    """The end of a survey that is killed: it sends and writes nothing any more."""


class Port:
    """An open serial port in memory, which resets its board: who waits lets the bench run."""

    timeout = 0.0

    def __init__(self, cable: "MemoryCable", rig: "Rig") -> None:
        self._cable, self._rig = cable, rig
        self.content = b""
        if not cable.plugged:
            raise FileNotFoundError(cable.port)
        cable.end = self

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


class MemoryCable(TerminalCable):
    """A cable whose other end is a `Port`, if a program has opened it."""

    end: Port | None = None
    sent = b""

    def _open_port(self) -> None:
        pass

    def unplug(self) -> None:
        """Unplug the cable; bytes that the program has not read are lost."""
        self.end = None
        self.plugged = self._opened = False

    def _is_opened(self) -> bool:
        return self.end is not None

    def _read(self) -> bytes:
        sent, self.sent = self.sent, b""
        return sent

    def _write(self, content: bytes) -> None:
        self.end.content += content


# What a test does while a survey runs: as soon as the condition holds, the act, and then the next.
Then = Iterable[tuple[Callable[[], bool], Callable[[], object]]]


class Rig:
    """A bench of boards for surveys; their firmware runs in the emulator."""

    # Time that the boards run before the world advances: no motor moves through a switch in it.
    stretch_us = 50_000
    # Interval at which the boards are read; a shorter one only takes longer.
    look_every_s = 0.2

    def __init__(self, folder: Path, monkeypatch: object) -> None:
        self.folder, self.killed = folder, False
        kinds = {"logger": emulated.LOGGER, "wave": emulated.PERISTALSIS, "fold": emulated.FOLD}
        boards = {name: emulated.EmulatedBoard(kind) for name, kind in kinds.items()}
        self.wave_board, self.origami = boards["wave"], FoldingOrigami(boards["fold"])
        cables = {
            name: MemoryCable(board, Path(name), sticks=name == "logger")
            for name, board in boards.items()
        }
        self.cables = SimpleNamespace(**cables)
        self.gut = Gut(self.wave_board, self.origami, boards["logger"])
        self.bench = Workbench(*cables.values(), world=self._go_on)
        self._then: deque = deque()
        self._stop = SimpleNamespace(reason="")
        self._replace(monkeypatch, cables)

    def _replace(self, monkeypatch: object, cables: dict[str, MemoryCable]) -> None:
        """Give surveys the bench's ports and its clock in place of the computer's."""
        rig = self

        class BenchDatetime(datetime):
            """A datetime with the bench's clock."""

            @classmethod
            def now(cls, tz: object = None) -> datetime:
                del tz
                return datetime(2026, 1, 1, tzinfo=UTC) + timedelta(seconds=rig.now_s)

        replace = monkeypatch.setattr
        replace(serial, "serial_for_url", lambda port, *_, **__: Port(cables[port], self))
        time = SimpleNamespace(monotonic=lambda: self.now_s, sleep=self.rest)
        for module in (board, clock, line, loop, wave):
            replace(module, "time", time)
        for module in (survey_command, survey_run):
            replace(module, "datetime", BenchDatetime)
        replace(survey_command, "StopRequest", lambda: self._stop)
        # The main thread waits for the bench, by the computer's clock.
        replace(wave.Drive, "_renew", lambda drive: None)
        for module, name in ((survey_bench, "LOOK_EVERY_S"), (fold, "READ_TIMEOUT_S")):
            replace(module, name, self.look_every_s)
        monkeypatch.chdir(self.folder)
        clock.AWAKE.__init__()

    def _go_on(self, start_s: float, end_s: float) -> None:
        """Advance thread and gut by the motion of the motors."""
        self.origami(start_s, end_s)
        self.gut(start_s, end_s)

    @property
    def now_s(self) -> float:
        """The bench's time in seconds."""
        return self.bench.now_s

    def survey(self, *options: object, then: Then = ()) -> None:
        """Run capsule survey on these boards to its end."""
        ports = ("--drive", "wave", "--fold", "fold", "--port", "logger", "--out", "tuesday")
        self._run(*ports, *options, then=then)

    def resume(self, then: Then = ()) -> None:
        """Run capsule survey to continue the session."""
        self._run("--resume", "tuesday", then=then)

    def _run(self, *words: object, then: Then) -> None:
        self._then, self._stop.reason, self.killed = deque(then), "", False
        options = parsers()["survey"].parse_args([str(word) for word in words])
        survey_command.check(options)
        try:
            survey_command.survey(options)
        finally:
            assert not self._then, "the survey ended before what the test waits for"

    def rest(self, seconds: float) -> None:
        """Run the bench for this time, and do what is next if its condition holds."""
        stretch_us = min(self.stretch_us, round(seconds * 1e6))
        self.bench.run_for(seconds, stretch_us=stretch_us)
        if self._then and self._then[0][0]():
            self._then.popleft()[1]()

    def press_ctrl_c(self) -> None:
        """Press Ctrl-C."""
        self._stop.reason = "Ctrl-C"

    def kill(self) -> None:
        """Kill the survey at once."""
        self.killed = True
        raise Killed

    def pass_by(self, seconds: float) -> None:
        """Advance the time without any program."""
        self.bench.run_for(seconds, stretch_us=self.stretch_us)

    def at_rest(self) -> bool:
        """Return whether the origami is unfolded and the wave stopped, after a survey has ended."""
        self.pass_by(2.0)
        return self.origami.folded == 0.0 and self.wave_board.coils == 0

    # Readers of the session's files.

    def events(self) -> list[dict]:
        """Read the log of events."""
        (path,) = (self.folder / "tuesday").glob("events.jsonl*")
        return [json.loads(line) for line in path.read_text().splitlines()]

    def stream(self) -> list[list[str]]:
        """Read the rows of the stream."""
        (path,) = (self.folder / "tuesday").glob("stream.csv*")
        return [line.split(",") for line in path.read_text().splitlines()[1:]]
