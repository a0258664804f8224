"""The logger board: start it, check its samples, place them in time, and hand them on."""

import math
from collections.abc import Iterable, Mapping
from datetime import datetime

from capsule.bench.bench_errors import AcquisitionError, BoardLostError
from capsule.bench.board import Board, another_board
from capsule.bench.clock import AWAKE
from capsule.bench.growing_file import FrameLog
from capsule.bench.line import READ_TIMEOUT_S, Arrival
from capsule.bench.protocol import Damaged, Identity, Sample
from capsule.bench.state import State
from capsule.bench.timeline import CLOCK_ENDS_MS, Timeline
from capsule.kinds import Settings

START_AGAIN_S = 0.5
# A reset board waits in its boot loader, which must not get a byte (see board.QUIET_S).
SILENT_AFTER_S = 2.5
ASK_AGAIN_S = 1.0
LAST_FRAMES_S = 0.5


class Source:
    """A source of samples that is always there, in place of a logger board.

    A subclass reads the samples. `header` has the first entries of a recording's header; with the
    further ones, they describe it as a logger's do.
    """

    connected, silent_s = True, 0.0
    pending: tuple[str, ...] = ()

    def __init__(self, port: str, header: Mapping[str, str], **further: str) -> None:
        self.port, self.header = port, header
        self.identity = Identity("logger", {**header, **further})

    def read(self, timeout_s: float) -> Iterable[Arrival]:
        """Return the samples that have come; wait up to the timeout for the first."""
        raise NotImplementedError

    def send(self, payload: str) -> None:
        """Do nothing: it needs no commands."""

    want = send

    def close(self) -> list[Damaged]:
        """Let go of it."""
        return []


class Logger:
    """One logger, from its frames to samples on an even grid in time.

    Attributes
    ----------
    state : State
        State of the recording.
    samples : list of tuple of float, or None
        The first samples of a recording, until it is too long for the workflow, for the running
        verdict; None is a missing one.
    at_end : bool
        Whether the capsule has reached the end stop.
    complete : bool
        Whether the recording is complete; further samples are dropped.
    taken_s : float
        Estimated time of the last sample, by the computer's clock; rather too early.
    """

    def __init__(self, board: Board | Source, log: FrameLog, *, to_end_stop: bool = True) -> None:
        self._board, self._log, self._to_end_stop = board, log, to_end_stop
        entries = board.identity.entries
        rate_hz, self._largest = float(entries["rate_hz"]), 2 ** int(entries["adc_bits"]) - 1
        self.rate_hz, self.sensors = rate_hz, int(entries["channels"])
        full_scale = float(entries.get("full_scale", self._largest))
        self.state = State(1.0 / rate_hz, full_scale=full_scale)
        self.samples: list[tuple[float, ...] | None] = []
        self._new: list[tuple[float, ...] | None] = []
        self.at_end = self.complete = False
        self.taken_s = 0.0
        self._timeline = Timeline(rate_hz, self._accept, self._refuse)
        self._foreign = ""
        self._running = self._granted = False
        self._asked_s = 0.0
        self._started_s = -START_AGAIN_S
        self._sampled_s = AWAKE.now_s()

    @property
    def fault(self) -> str:
        """What is wrong now and what to do; empty if nothing is."""
        if not self._board.connected:
            return "the logger was unplugged: plug it back in, or end with Ctrl-C"
        silent_s = AWAKE.now_s() - self._sampled_s
        silent = silent_s > SILENT_AFTER_S
        return f"the logger has sent no sample for {silent_s:.0f} s" if silent else ""

    def trouble(self, patience_s: float, option: str = "--patience") -> AcquisitionError | None:
        """Return the error after a wait for a sample that is longer than an option allows."""
        # Since the last accepted sample, or since the board came back after it.
        silent_s = AWAKE.now_s() - self._sampled_s
        if silent_s <= patience_s:
            return None
        what = "sent no sample for" if self._board.connected else "did not come back within"
        waited = f"{what} {silent_s:.0f} s ({option})"
        return BoardLostError(f"the logger at {self._board.port} {waited}")

    def serve(self, timeout_s: float) -> None:
        """Send what the board needs, and receive its frames; wait for them up to the timeout."""
        if command := self._command(AWAKE.now_s()):
            self._board.send(command)
        self._receive(timeout_s)

    def _receive(self, timeout_s: float) -> None:
        """Process the board's frames, and wait for them up to the timeout."""
        for arrival in self._board.read(timeout_s):
            match arrival.event:
                case Damaged() as piece:
                    self._note_damaged(piece)
                case Sample() as sample:
                    self._sift(sample, arrival.moment_s)
                case Identity() as identity:
                    self._take_identity(identity, arrival.moment_s, arrival.fresh)
        if not self._board.connected:
            self._timeline.settle()
            self._running = False

    def take(self) -> list[tuple[float, ...] | None]:
        """Return the samples since the last call, up to the newest; None is a missing one."""
        new, self._new = self._new, []
        return new

    def end(self) -> None:
        """Pause the board, keep the samples that it sends until it confirms, and close its port."""
        deadline_s = AWAKE.now_s() + LAST_FRAMES_S
        self._board.want("pause")
        while self._board.connected:
            self._receive(READ_TIMEOUT_S)
            if not self._board.pending or AWAKE.now_s() > deadline_s:
                break
        for piece in self._board.close():
            self._note_damaged(piece)
        self._timeline.settle()

    def _note_damaged(self, piece: Damaged) -> None:
        """Count bytes that are not a whole frame, and write them to the log."""
        self.state.damaged += 1
        self._log.damaged(piece)

    def _command(self, now_s: float) -> str:
        """Return the command that the board needs now; empty if it needs none."""
        silent = self._board.silent_s > SILENT_AFTER_S
        if silent or self._timeline.in_doubt or self._foreign:
            if now_s - self._asked_s > ASK_AGAIN_S:
                self._asked_s = now_s
                return "identify"
        elif not self._running and now_s - self._started_s > START_AGAIN_S:
            self._started_s = now_s
            return "start"
        return ""

    def _take_identity(self, identity: Identity, moment_s: float, fresh: bool) -> None:
        """Process the board's description of itself; `fresh`: it was just connected again."""
        if fresh and not self._granted:  # wait for a sample anew, but once until one arrives
            self._sampled_s = AWAKE.now_s()
            self._granted = True
        before = self._foreign
        self._foreign = another_board(self._board.port, self._board.identity, identity)
        if self._foreign:
            if self._foreign != before:
                self._log.tell(self._foreign)
            return
        running = identity.entries.get("state") == "running"
        uptime = identity.entries.get("uptime_ms", "")
        if not uptime.isdecimal() or self._timeline.continues(
            int(uptime), running, moment_s, fresh
        ):
            return
        self._timeline.note_restart()
        if self._running or (running and fresh):
            self._log.tell(
                "the board was reset or exchanged: its clock started again. The recording "
                "continues in the same file; this computer's clock gives the length of the gap"
            )
        self._running = False
        self._started_s = -START_AGAIN_S

    def _sift(self, sample: Sample, moment_s: float) -> None:
        """Check and place a sample that was read at `moment_s` of the computer's clock."""
        if self._foreign:
            self._refuse(sample, "sent by another board")
        elif self.complete:
            return
        elif len(sample.counts) != self.sensors or max(sample.counts) > self._largest:
            self._refuse(sample, "other sensors or readings than those of this board")
        elif sample.device_ms >= CLOCK_ENDS_MS:
            self._refuse(sample, "a time beyond the end of the board's clock")
        else:
            self._timeline.sift(sample, moment_s)

    def _refuse(self, sample: Sample, reason: str) -> None:
        """Count a sample that cannot be used, and write it to the log."""
        self._note_damaged(Damaged(repr(sample).encode(), reason))

    def _accept(self, sample: Sample, missing: int, by_computer_clock: bool) -> None:
        """Keep a sample and the missing ones before it, if the recording is not yet complete."""
        room = (round(self.state.end_s * self.rate_hz) or math.inf) - self.state.samples
        if self.complete:
            return
        self.complete = missing + 1 >= room
        if missing >= room:
            return
        if missing:
            clock = "this computer's clock" if by_computer_clock else "the board's clock"
            told = f"{missing} samples are missing, by {clock}"
            self._log.note(f"gap at {self.state.time_s:.1f} s: {told}")
        for _ in range(missing):
            self._keep(None)
        self._keep(sample.counts)
        self.taken_s, self._sampled_s = self._timeline.taken_s, AWAKE.now_s()
        self._running, self._granted = True, False
        if sample.at_end:
            self.at_end = True
            self.complete = self.complete or self._to_end_stop

    def _keep(self, counts: tuple[float, ...] | None) -> None:
        self._new.append(counts)
        if len(self.samples) <= self.state.longest < math.inf:
            self.samples.append(counts)
        self.state.add(counts)


def check_fits(logger: Identity, settings: Settings) -> None:
    """Raise an error if the workflow could not read recordings of a logger.

    Raises
    ------
    AcquisitionError
        The board has another number of sensors or another rate.
    """
    for entry, key in (("channels", "sensors"), ("rate_hz", "rate_hz")):
        has = float(logger.entries[entry])
        if has != settings[key]:
            raise AcquisitionError(
                f"the board has {entry} = {has:g}, but the workflow is configured for "
                f"{settings[key]:g}; change recording.{key} in config/config.yaml, or use another "
                "board"
            )


def moment_text(moment: datetime) -> str:
    """Return a time in UTC as text for a header."""
    return moment.isoformat(timespec="seconds").replace("+00:00", "Z")
