"""Simulate a serial line that follows a script of a test, without waiting."""

from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from types import SimpleNamespace

import pytest

from capsule.bench import board, clock, logger, recorder
from capsule.bench.bench_errors import BoardNotFoundError, LineLostError
from capsule.bench.board import Board
from capsule.bench.growing_file import FrameLog, GrowingFile
from capsule.bench.line import Arrival
from capsule.bench.logger import Logger
from capsule.bench.loop import Loop
from capsule.bench.protocol import Damaged, FrameParser, encode
from capsule.bench.recorder import Recorder

SAID = "protocol=1,firmware=1.0,rate_hz=10,channels=4,adc_bits=10,vref_mv=5000,series_ohm=12000"
SAID += ",wavelength_mm=80.000,state=running,uptime_ms=0"
ENTRIES = dict(entry.split("=") for entry in SAID.split(","))


def sample_frame(number: int, device_ms: int | None = None, sequence: int | None = None) -> bytes:
    """Return the frame of a sample whose counts contain its number."""
    device_ms = 100 * number if device_ms is None else device_ms
    sequence = number if sequence is None else sequence
    return encode(f"D,{sequence},{device_ms},{number % 1024},2,3,4,0")


def identity_of(device: str, **changes: object) -> str:
    """Return the payload with a board's identity; None leaves an entry out."""
    entries = {key: value for key, value in (ENTRIES | changes).items() if value is not None}
    return ",".join(["I", device, *(f"{key}={value}" for key, value in entries.items())])


def identity_frame(**changes: object) -> bytes:
    """Return the frame with a logger's identity."""
    return encode(identity_of("logger", **changes))


class FakeLine:
    """A line that keeps what is sent, and receives the frames that a test puts there.

    If it is `lost`, its port has disappeared, in the midst of the frame `rest` if there is one.
    A test may give each attribute by its name.
    """

    def __init__(self, port: str = "/dev/board", baud: int = 0, **changes: object) -> None:
        self.port, self.baud = port, baud
        self.frames: list[str] = []
        self.sent: list[str] = []
        self.sent_s = -100.0
        self.lost = self.closed = False
        self.first_bytes = self.rest = b""
        vars(self).update(changes)

    def receive(self, timeout_s: float = 0.0) -> list[Arrival]:
        """Return the events in the frames."""
        del timeout_s
        if self.lost:
            raise LineLostError("unplugged")
        received, self.frames = b"".join(map(encode, self.frames)), []
        self.first_bytes += received
        return [Arrival(event, 0.0) for event in FrameParser().feed(received)]

    def send(self, payload: str) -> None:
        """Keep a command."""
        if self.lost:
            raise LineLostError("unplugged")
        self.sent.append(payload)

    def close(self) -> list:
        """Note that it was closed."""
        self.closed = True
        return [Damaged(self.rest, "cut off")] if self.rest else []


def board_on(line: FakeLine, kind: str = "peristalsis", **changes: object) -> Board:
    """Return a board on a line, which has said what it is after what was in the line."""
    line.frames.append(identity_of(kind, **changes))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(board, "Line", lambda *_: line)
        return Board(line.port, line.baud, kind, lambda text: None)


class ScriptedBench:
    """A recorder whose line and clock follow a script, with Ctrl-C at the script's end.

    When its port is opened again, the board answers after `away_s`, with the next changes of its
    identity in `answers`.
    """

    port, baud, sent_s, first_bytes = "scripted", 115200, 0.0, b""

    def __init__(self, folder: Path, monkeypatch: object) -> None:
        self.now_s = self.away_s = 0.0
        self.sent: list[str] = []
        self.told: list[str] = []
        self._script: Iterator = iter(())
        self.answers: Iterator[dict] = iter([{}])
        self._parser = FrameParser()
        self._stop = SimpleNamespace(reason="")
        monkeypatch.setattr(clock, "time", SimpleNamespace(monotonic=lambda: self.now_s))
        awake = clock.AwakeClock()
        for module in (board, logger):
            monkeypatch.setattr(module, "AWAKE", awake)
        for module in (board, recorder):
            monkeypatch.setattr(module, "elapsed_s", lambda: self.now_s)
        for name, value in {"Line": self._opened, "REOPEN_AFTER_S": 0, "KNOCK_EVERY_S": 0}.items():
            monkeypatch.setattr(board, name, value)
        final = folder / "raw" / "3mm" / "r01.csv"
        self.log = FrameLog(folder / "logs" / "r01.log", self.told.append)
        header = {"started": "2026-01-01T00:00:00Z", "wave_until_s": "end"}
        self.part = GrowingFile(final, recorder.head_of(header, 4), tell=self.told.append)
        mine = Board(self.port, self.baud, "logger", self.told.append)
        self.logger = Logger(mine, self.log)
        self.logger.state.longest = 1000
        loop = Loop("the recording", self.logger.state, self.log)
        self.recorder = Recorder(self.logger, self.part, header, loop, 5.0, self._stop)

    def _opened(self, *_: object) -> "ScriptedBench":
        for changes in self.answers:
            first = [(self.now_s + self.away_s, identity_frame(**changes))]
            self._script = chain(first, self._script)
            return self
        raise BoardNotFoundError("no answer is left")

    def run(self, script: Iterable[tuple[float, bytes | Exception]]) -> None:
        """Run the recorder over a script: pairs of a time and the bytes that arrive then."""
        self._script = iter(script)
        try:
            self.recorder.archive()
        finally:
            self.log.close()

    @property
    def path(self) -> Path:
        """The file of the recording: with its final name, if it has got one."""
        return self.part.final if self.part.final.exists() else self.part.path

    def rows(self) -> list[list[str]]:
        """Read the cells of the lines of samples on disk; none without a file."""
        lines = self.path.read_text(encoding="utf-8").splitlines() if self.path.exists() else []
        return [line.split(",") for line in lines if line[0].isdigit()]

    def numbers(self) -> list[int]:
        """Read the numbers of the samples on disk."""
        return [int(row[1]) for row in self.rows() if row[1]]

    def receive(self, timeout_s: float = 0.05) -> list[Arrival]:
        """Return the next bytes of the script."""
        step = next(self._script, None)
        if step is None:
            self._stop.reason = "Ctrl-C"
            self.now_s += timeout_s
            return []
        self.now_s, content = step
        if isinstance(content, Exception):
            raise content
        return [Arrival(event, self.now_s) for event in self._parser.feed(content)]

    def send(self, payload: str) -> None:
        """Record a command to the board."""
        self.sent.append(payload)

    def close(self) -> list:
        """Close the line."""
        return self._parser.drop_pending()
