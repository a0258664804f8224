"""A recording from its first sample to its archive, through noise, resets and pulled cables."""

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import FrameType

from acquisition.archive import PartFile
from acquisition.bench_errors import (
    AcquisitionError,
    BoardLostError,
    BoardNotFoundError,
    LineLostError,
)
from acquisition.boards import connect
from acquisition.frame_log import FrameLog
from acquisition.line import Arrival, Line
from acquisition.protocol import Acknowledgement, Damaged, Identity, Sample
from acquisition.terminal import Progress, Terminal
from acquisition.timeline import MisplacedSampleError, Timeline
from acquisition.usb import UsbPort

START_AGAIN_S = 0.5
# A board that was reset sits in its boot loader, which must not hear a byte (see boards.QUIET_S).
SILENT_AFTER_S = 2.5
ASK_AGAIN_S = 1.0
LAST_FRAMES_S = 0.5
RATE_OVER_S = 5.0
KNOCK_EVERY_S = 0.2


@dataclass(frozen=True)
class Limits:
    """What ends a recording.

    Attributes
    ----------
    samples : int or None
        Number of places of the recording, the missing ones included.
    patience_s : float
        How long to wait for a board that went away.
    """

    samples: int | None
    patience_s: float


class StopRequest:
    """Ctrl-C, or a polite kill: ends the recording at the next pause for breath."""

    def __init__(self) -> None:
        self.reason = ""
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), self._note)

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        self.reason = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name


class Session:
    """Records from one logger into one file.

    Parameters
    ----------
    line : Line
        The open line to the logger.
    identity : Identity
        What the logger says of itself.
    part : PartFile
        Where the samples go.
    log : FrameLog
        Where everything else goes.
    terminal : Terminal
        Where people look.
    limits : Limits
        What ends the recording.
    stop : StopRequest
        Ctrl-C.
    watch : callable
        Called with the progress and all samples so far, often: shows, drives, judges.
    """

    def __init__(
        self,
        line: Line,
        identity: Identity,
        part: PartFile,
        log: FrameLog,
        terminal: Terminal,
        limits: Limits,
        stop: StopRequest,
        watch: Callable[[Progress, list[tuple[int, ...] | None]], None],
    ) -> None:
        rate_hz = float(identity.entries["rate_hz"])
        self._line = line
        self._port = UsbPort(line.port)
        self._sensors = int(identity.entries["channels"])
        self._full_scale = 2 ** int(identity.entries["adc_bits"]) - 1
        self._part = part
        self._log = log
        self._terminal = terminal
        self._limits = limits
        self._stop = stop
        self._watch = watch
        self._timeline = Timeline(rate_hz)
        self.progress = Progress(1.0 / rate_hz, end_s=(limits.samples or 0) / rate_hz)
        self.samples: list[tuple[int, ...] | None] = []
        self.ended = ""
        self._full = False
        self._rate_mark = (time.monotonic(), 0)
        self._heard_s = time.monotonic()
        self._asked_s = 0.0
        self._started_s = 0.0
        self._running = False

    def run(self) -> None:
        """Record until something ends it; `ended` then says what.

        Raises
        ------
        BoardLostError
            The board went away for longer than the patience; what came before is in the file.
        AcquisitionError
            Samples cannot be written.
        """
        while not self.ended:
            try:
                self._keep_running()
                arrivals = self._line.receive()
            except LineLostError:
                self._wait_for_board()
                continue
            self._take(arrivals)
            self._part.flush()
            self._part.sync()
            self._measure_rate()
            self._watch(self.progress, self.samples)
            self.ended = self.ended or self._stop.reason
        self._pause()

    def _keep_running(self) -> None:
        """Start the board until it sends, and ask after it when it falls silent."""
        now_s = time.monotonic()
        silent_s = now_s - self._heard_s
        if silent_s > self._limits.patience_s:
            raise BoardLostError(
                f"the board at {self._line.port} sent nothing for {silent_s:.0f} s (--patience)"
            )
        if silent_s > SILENT_AFTER_S:
            if now_s - self._asked_s > ASK_AGAIN_S:
                self._line.send("identify")
                self._asked_s = now_s
        elif not self._running and now_s - self._started_s > START_AGAIN_S:
            self._line.send("start")
            self._started_s = now_s

    def _take(self, arrivals: list[Arrival]) -> None:
        if self._full:
            return
        if arrivals:
            self._heard_s = time.monotonic()
        for arrival in arrivals:
            match arrival.event:
                case Damaged() as piece:
                    self._note_damaged(piece)
                case Sample() as sample:
                    self._take_sample(sample, arrival.moment_s)
                case Identity(entries=entries):
                    self._take_identity(entries)
            if self._full:
                return

    def _take_identity(self, entries: dict[str, str]) -> None:
        running = entries.get("state") == "running"
        if self._timeline.note_identity(int(entries.get("uptime_ms", 0)), running):
            if self._running:
                self._tell("the board was reset; going on in the same recording")
            self._running = False
            self._started_s = 0.0

    def _take_sample(self, sample: Sample, moment_s: float) -> None:
        if len(sample.counts) != self._sensors or max(sample.counts) > self._full_scale:
            self._note_damaged(Damaged(repr(sample).encode(), "not this board's sensors"))
            return
        try:
            place = self._timeline.place(sample, moment_s)
        except MisplacedSampleError as reason:
            self._note_damaged(Damaged(repr(sample).encode(), str(reason)))
            return
        self._running = True
        if self._limits.samples is not None and place.index >= self._limits.samples:
            self._fill("--duration is over")
            return
        if place.missing:
            self._note_gap(place.index, place.missing, place.by_computer_clock)
        for index in range(place.index - place.missing, place.index):
            self._keep(index, None)
        self._keep(place.index, sample.counts)
        if sample.at_end:
            self._fill("the capsule reached the end stop")
        elif place.index + 1 == self._limits.samples:
            self._fill("--duration is over")

    def _fill(self, reason: str) -> None:
        self.ended = reason
        self._full = True

    def _keep(self, index: int, counts: tuple[int, ...] | None) -> None:
        # Rounded: 3 * 0.1 would be written 0.30000000000000004.
        self._part.add(round(index * self.progress.period_s, 6), counts)
        self.samples.append(counts)
        self.progress.recent.append(counts)
        self.progress.places = index + 1

    def _note_gap(self, index: int, missing: int, by_computer_clock: bool) -> None:
        self.progress.gaps += 1
        self.progress.missing += missing
        clock = "this computer's clock" if by_computer_clock else "the board's clock"
        start_s = (index - missing) * self.progress.period_s
        self._log.note(f"gap at {start_s:.1f} s: {missing} samples are missing, by {clock}")

    def _note_damaged(self, piece: Damaged) -> None:
        self.progress.damaged += 1
        self._log.damaged(piece)

    def _measure_rate(self) -> None:
        now_s = time.monotonic()
        since_s, count = self._rate_mark
        if now_s - since_s >= RATE_OVER_S or (self.progress.rate_hz == 0 and now_s - since_s >= 1):
            received = len(self.samples) - self.progress.missing
            self.progress.rate_hz = (received - count) / (now_s - since_s)
            self._rate_mark = (now_s, received)

    def _wait_for_board(self) -> None:
        """Wait until the board is back, and go on in the same recording."""
        self._close_line()
        self._running = False
        patience_s = self._limits.patience_s
        self._tell(
            f"the board at {self._line.port} was unplugged; plug it back in within "
            f"{patience_s:.0f} s (--patience), or end the recording with Ctrl-C"
        )
        deadline = time.monotonic() + patience_s
        told = ""
        while time.monotonic() < deadline:
            self._watch(self.progress, self.samples)
            if self._stop.reason:
                self.ended = self._stop.reason
                return
            try:
                self._line, identity = connect(self._port.current_name(), self._line.baud, "logger")
            except AcquisitionError as reason:
                if not isinstance(reason, BoardNotFoundError) and str(reason) != told:
                    told = str(reason)
                    self._tell(f"still waiting: {told}")
                time.sleep(KNOCK_EVERY_S)
                continue
            self._tell("the board is back; going on in the same recording")
            self._heard_s = time.monotonic()
            self._take_identity(dict(identity.entries))
            return
        raise BoardLostError(
            f"the board at {self._line.port} did not come back within {patience_s:.0f} s "
            "(--patience)"
        )

    def _pause(self) -> None:
        """Pause the board; what it sent before it heard of that is kept."""
        deadline = time.monotonic() + LAST_FRAMES_S
        try:
            self._line.send("pause")
            while time.monotonic() < deadline:
                arrivals = self._line.receive()
                self._take(arrivals)
                if any(arrival.event == Acknowledgement("pause", "") for arrival in arrivals):
                    break
        except LineLostError:
            pass  # the recording has ended all the same
        self._close_line()
        self._part.flush()

    def _close_line(self) -> None:
        for piece in self._line.close():
            self._note_damaged(piece)

    def _tell(self, text: str) -> None:
        self._terminal.note(text)
        self._log.note(text)
