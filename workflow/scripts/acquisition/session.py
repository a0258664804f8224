"""A recording from its first sample to its archive, through noise, resets and pulled cables."""

import math
import time
from collections.abc import Callable

from acquisition.archive import PartFile
from acquisition.bench_errors import (
    AcquisitionError,
    BoardLostError,
    BoardNotFoundError,
    LineLostError,
)
from acquisition.boards import connect, differences
from acquisition.clock import AWAKE, elapsed_s
from acquisition.frame_log import FrameLog
from acquisition.intake import Intake
from acquisition.limits import Limits, StopRequest
from acquisition.line import Arrival, Line
from acquisition.protocol import Acknowledgement, Damaged, Identity, Sample
from acquisition.terminal import Progress, Terminal
from acquisition.usb import UsbPort

START_AGAIN_S = 0.5
# A board that was reset sits in its boot loader, which must not hear a byte (see boards.QUIET_S).
SILENT_AFTER_S = 2.5
ASK_AGAIN_S = 1.0
LAST_FRAMES_S = 0.5
RATE_OVER_S = 5.0
KNOCK_EVERY_S = 0.2


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
        Called with the progress and the first samples, often: shows, drives, judges.
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
        self._line = line
        self._port = UsbPort(line.port)
        self._identity = identity
        self._foreign = ""
        self._part = part
        self._log = log
        self._terminal = terminal
        self._limits = limits
        self._stop = stop
        self._watch = watch
        self._intake = Intake(identity, part, log, limits.samples, limits.kept)
        self.progress = self._intake.progress
        self.ended = ""
        self._rate_mark = (time.monotonic(), 0)
        self._heard_s = self._sampled_s = AWAKE.now_s()
        self._granted = False
        self._asked_s = 0.0
        self._started_s = -START_AGAIN_S
        self._begun_s = elapsed_s()
        self._running = False

    def run(self) -> None:
        """Record until something ends it; `ended` then says what.

        Raises
        ------
        BoardLostError
            No sample came for longer than the patience; what came before is in the file.
        AcquisitionError
            Samples cannot be written.
        """
        while not self.ended:
            try:
                # Read first: what came while this program was stopped lies in the port.
                self._take(self._line.receive())
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
        """Start the board until it sends, and ask after it when it falls silent."""
        now_s = AWAKE.now_s()
        self._check_patience(now_s)
        if now_s - self._heard_s > SILENT_AFTER_S or self._intake.in_doubt or self._foreign:
            if now_s - self._asked_s > ASK_AGAIN_S:
                self._line.send("identify")
                self._asked_s = now_s
        elif not self._running and now_s - self._started_s > START_AGAIN_S:
            self._line.send("start")
            self._started_s = now_s

    def _check_patience(self, now_s: float, what: str = "sent no sample for") -> None:
        """Give up where no sample came for too long, whatever else comes.

        Raises
        ------
        BoardLostError
            The patience or the duration is over.
        """
        if self._intake.ended:
            return
        silent_s = now_s - self._sampled_s
        duration_s = self.progress.end_s or math.inf
        if silent_s > self._limits.patience_s:
            option = "--patience"
        elif silent_s > SILENT_AFTER_S and elapsed_s() - self._begun_s > duration_s:
            option = "--duration is over"
        else:
            return
        raise BoardLostError(f"the board at {self._line.port} {what} {silent_s:.0f} s ({option})")

    def _take(self, arrivals: list[Arrival]) -> None:
        if arrivals:
            self._heard_s = AWAKE.now_s()
        before = self._intake.received
        for arrival in arrivals:
            if self._intake.ended:
                break
            match arrival.event:
                case Damaged() as piece:
                    self._intake.note_damaged(piece)
                case Sample() as sample if self._foreign:
                    self._intake.refuse(sample, "sent by another board")
                case Sample() as sample:
                    self._intake.take(sample, arrival.moment_s)
                case Identity() as identity:
                    self._take_identity(identity, arrival.moment_s)
        if self._intake.received > before:
            self._running = True
            self._sampled_s = AWAKE.now_s()
            self._granted = False

    def _take_identity(self, identity: Identity, moment_s: float, fresh: bool = False) -> None:
        if self._is_foreign(identity):
            return
        running = identity.entries.get("state") == "running"
        uptime = identity.entries.get("uptime_ms", "")
        if uptime.isdecimal() and not self._intake.take_identity(
            int(uptime), running, moment_s, fresh
        ):
            if self._running or (running and fresh):
                self._tell(
                    "the board was reset or exchanged: its clock started again. The recording "
                    "continues in the same file; this computer's clock gives the length of the gap"
                )
            self._running = False
            self._started_s = -START_AGAIN_S

    def _is_foreign(self, identity: Identity) -> bool:
        """Compare what answers now with the board that the recording's header describes."""
        before = self._foreign
        self._foreign = differences(self._identity, identity)
        if self._foreign and self._foreign != before:
            self._tell(
                f"the board at {self._line.port} is another one ({self._foreign}), so the "
                "recorder ignores its samples; plug the first board back in, or end the recording "
                "with Ctrl-C"
            )
        return bool(self._foreign)

    def _measure_rate(self) -> None:
        now_s = time.monotonic()
        since_s, count = self._rate_mark
        if now_s - since_s >= RATE_OVER_S or (self.progress.rate_hz == 0 and now_s - since_s >= 1):
            received = self._intake.received
            self.progress.rate_hz = (received - count) / (now_s - since_s)
            self._rate_mark = (now_s, received)

    def _wait_for_board(self) -> None:
        """Wait until the board is back, and go on in the same recording."""
        self._close_line()
        self._intake.settle()
        self._running = False
        patience_s = self._limits.patience_s
        self._tell(
            f"the board at {self._line.port} was unplugged; plug it back in within "
            f"{patience_s:.0f} s (--patience), or end the recording with Ctrl-C"
        )
        told = ""
        while True:
            self._part.sync()
            self._watch(self.progress, self._intake.samples)
            if self._stop.reason:
                self.ended = self._stop.reason
                return
            try:
                self._line, identity = connect(self._port.current_name(), self._line.baud, "logger")
            except AcquisitionError as reason:
                if not isinstance(reason, BoardNotFoundError) and str(reason) != told:
                    told = str(reason)
                    self._tell(f"still waiting: {told}")
                self._wait_a_little()
                continue
            if self._is_foreign(identity):
                self._close_line()
                self._wait_a_little()
                continue
            self._tell("the board is back; the recording continues in the same file")
            self._heard_s = AWAKE.now_s()
            if not self._granted:  # once; then a sample must come
                self._sampled_s = self._heard_s
                self._granted = True
            self._take_identity(identity, elapsed_s(), fresh=True)
            return

    def _wait_a_little(self) -> None:
        self._check_patience(AWAKE.now_s(), "did not come back within")
        time.sleep(KNOCK_EVERY_S)
        AWAKE.now_s()  # asked often, or it takes the wait for a stop

    def _pause(self) -> None:
        """Pause the board; what it sent before it heard of that is kept."""
        deadline = AWAKE.now_s() + LAST_FRAMES_S
        try:
            self._line.send("pause")
            while AWAKE.now_s() < deadline:
                arrivals = self._line.receive()
                self._take(arrivals)
                if any(arrival.event == Acknowledgement("pause", "") for arrival in arrivals):
                    break
        except LineLostError:
            pass  # the recording has ended all the same
        self._close_line()
        self._intake.settle()
        self._part.flush()

    def _close_line(self) -> None:
        for piece in self._line.close():
            self._intake.note_damaged(piece)

    def _tell(self, text: str) -> None:
        self._terminal.note(text)
        self._log.note(text)
