"""One recording from its first to its last sample, through noise, resets and unplugged cables."""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from capsule.bench.archive import PartFile
from capsule.bench.attendance import SILENT_AFTER_S, Attendance
from capsule.bench.bench_errors import (
    AcquisitionError,
    BoardLostError,
    BoardNotFoundError,
    LineLostError,
)
from capsule.bench.clock import AWAKE, elapsed_s
from capsule.bench.frame_log import FrameLog
from capsule.bench.intake import Intake
from capsule.bench.limits import Limits, StopRequest
from capsule.bench.line import Line
from capsule.bench.protocol import Acknowledgement, Identity
from capsule.bench.reconnection import Reconnection
from capsule.bench.terminal import Progress, Terminal
from capsule.bench.usb import UsbPort

if TYPE_CHECKING:
    from capsule.bench.stream_line import StreamLine

LAST_FRAMES_S = 0.5
RATE_OVER_S = 5.0
LOOK_EVERY_S = 0.05


class Session:
    """One recording from one logger into one file.

    Parameters
    ----------
    line : Line or StreamLine
        The open line to the logger.
    identity : Identity
        The logger's description of itself.
    part : PartFile
        The file of the samples.
    log : FrameLog
        Log of events and damaged frames.
    terminal : Terminal
        The terminal for messages.
    limits : Limits
        Limits of the recording.
    stop : StopRequest
        Request to stop, by Ctrl-C.
    watch : callable
        Function that shows, drives and judges; often called with progress and first samples.
    """

    def __init__(
        self,
        line: "Line | StreamLine",
        identity: Identity,
        part: PartFile,
        log: FrameLog,
        terminal: Terminal,
        limits: Limits,
        stop: StopRequest,
        watch: Callable[[Progress, list[tuple[float, ...] | None]], None],
    ) -> None:
        self._line = line
        self._return = Reconnection(UsbPort(line.port), line.baud, "logger")
        self._part = part
        self._log = log
        self._terminal = terminal
        self._limits = limits
        self._stop = stop
        self._watch = watch
        self._intake = Intake(identity, part, log, limits.samples, limits.kept)
        self._attendance = Attendance(identity, self._intake, self._tell)
        self.progress = self._intake.progress
        self.ended = ""
        self._rate_mark = (time.monotonic(), 0)
        self._begun_s = elapsed_s()

    def run(self) -> None:
        """Record until a limit, a request or an error ends it; `ended` is then the reason.

        Raises
        ------
        BoardLostError
            No sample came within the patience; the samples before that are in the file.
        AcquisitionError
            Samples cannot be written.
        """
        while not self.ended:
            try:
                # Read first: samples that came while this program was stopped are in the port.
                self._attendance.take(self._line.receive(), self._line.port)
                self._keep_running()
            except LineLostError:
                self._wait_for_board()
                continue
            self._part.flush()
            self._part.sync()
            self._measure_rate()
            self._watch(self.progress, self._intake.samples)
            self.ended = self._intake.ended or self._stop.reason
        self._pause()

    def _keep_running(self) -> None:
        """Start the board until it sends, and ask for its identity if it is silent."""
        now_s = AWAKE.now_s()
        self._check_patience(now_s)
        if command := self._attendance.command(now_s):
            self._line.send(command)

    def _check_patience(self, now_s: float, what: str = "sent no sample for") -> None:
        """Raise an error if no sample came for too long, even if other frames come.

        Raises
        ------
        BoardLostError
            The patience or the duration has ended.
        """
        if self._intake.ended:
            return
        silent_s = now_s - self._attendance.sampled_s
        duration_s = self.progress.end_s or math.inf
        if silent_s > self._limits.patience_s:
            option = "--patience"
        elif silent_s > SILENT_AFTER_S and elapsed_s() - self._begun_s > duration_s:
            option = "--duration is over"
        else:
            return
        raise BoardLostError(f"the board at {self._line.port} {what} {silent_s:.0f} s ({option})")

    def _measure_rate(self) -> None:
        now_s = time.monotonic()
        since_s, count = self._rate_mark
        if now_s - since_s >= RATE_OVER_S or (self.progress.rate_hz == 0 and now_s - since_s >= 1):
            received = self._intake.received
            self.progress.rate_hz = (received - count) / (now_s - since_s)
            self._rate_mark = (now_s, received)

    def _wait_for_board(self) -> None:
        """Wait until the board is back, and continue the same recording."""
        self._close_line()
        self._attendance.went_away()
        patience_s = self._limits.patience_s
        self._tell(
            f"the board at {self._line.port} was unplugged; plug it back in within "
            f"{patience_s:.0f} s (--patience), or end the recording with Ctrl-C"
        )
        told = ""
        try:
            while not self._stop.reason:
                self._part.sync()
                self._watch(self.progress, self._intake.samples)
                self._check_patience(AWAKE.now_s(), "did not come back within")
                try:
                    found = self._return.step(LOOK_EVERY_S)
                except AcquisitionError as reason:
                    if not isinstance(reason, BoardNotFoundError) and str(reason) != told:
                        told = str(reason)
                        self._tell(f"still waiting: {told}")
                    continue
                if found and self._is_ours(*found):
                    return
            self.ended = self._stop.reason
        finally:
            self._return.close()

    def _is_ours(self, line: Line, identity: Identity) -> bool:
        """Continue on the line of a board that has come back; close that of another board."""
        if self._attendance.is_foreign(identity, line.port):
            self._return.reject(line)
            return False
        self._line = line
        self._tell("the board is back; the recording continues in the same file")
        self._attendance.came_back()
        self._attendance.take_identity(identity, elapsed_s(), line.port, fresh=True)
        return True

    def _pause(self) -> None:
        """Pause the board, and keep the samples that it sends until it confirms."""
        deadline = AWAKE.now_s() + LAST_FRAMES_S
        try:
            self._line.send("pause")
            while AWAKE.now_s() < deadline:
                arrivals = self._line.receive()
                self._attendance.take(arrivals, self._line.port)
                if any(arrival.event == Acknowledgement("pause", "") for arrival in arrivals):
                    break
        except LineLostError:
            pass  # the recording has ended anyway
        self._close_line()
        self._intake.settle()
        self._part.flush()

    def _close_line(self) -> None:
        for piece in self._line.close():
            self._intake.note_damaged(piece)

    def _tell(self, text: str) -> None:
        self._terminal.note(text)
        self._log.note(text)
