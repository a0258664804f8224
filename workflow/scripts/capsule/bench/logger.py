"""The logger board: start it, check its samples, place them in time, and hand them on."""

import math
from datetime import datetime
from typing import Any

from capsule.bench.bench_errors import AcquisitionError
from capsule.bench.board import Board, another_board
from capsule.bench.clock import AWAKE, elapsed_s
from capsule.bench.growing_file import FrameLog
from capsule.bench.identification import differences
from capsule.bench.protocol import Damaged, Event, Identity, Sample
from capsule.bench.state import State
from capsule.bench.timeline import CLOCK_ENDS_MS, Sieve, Slot, Timeline

START_AGAIN_S = 0.5
# A reset board waits in its boot loader, which must not get a byte (see identification.QUIET_S).
SILENT_AFTER_S = 2.5
ASK_AGAIN_S = 1.0


class Logger:
    """One logger, from its frames to samples on an even grid in time.

    Parameters
    ----------
    board : Board
        The board.
    log : FrameLog
        Log of gaps, damaged frames and refused samples.
    limit : int or None
        Number of samples of the recording, missing ones included; None: no limit.
    kept : int
        Number of first samples that stay in memory, for the running verdict.
    to_end_stop : bool
        Whether the end stop completes the recording.

    Attributes
    ----------
    state : State
        State of the recording.
    samples : list of tuple of int, or None
        The first samples; None is a missing one.
    at_end : bool
        Whether the capsule has reached the end stop.
    complete : bool
        Whether the recording is complete; further samples are dropped.
    sampled_s : float
        Time of the last accepted sample, by `AWAKE`.
    """

    def __init__(
        self,
        board: Board,
        log: FrameLog,
        *,
        limit: int | None = None,
        kept: int = 0,
        to_end_stop: bool = True,
    ) -> None:
        self._board, self._log = board, log
        self._identity = board.identity
        rate_hz = float(self._identity.entries["rate_hz"])
        self.sensors = int(self._identity.entries["channels"])
        self._full_scale = 2 ** int(self._identity.entries["adc_bits"]) - 1
        self._limit = math.inf if limit is None else limit
        self._kept, self._to_end_stop = kept, to_end_stop
        self._timeline = Timeline(rate_hz)
        self._sieve = Sieve(self._timeline, self._accept, self._refuse)
        self.state = State(1.0 / rate_hz, end_s=(limit or 0) / rate_hz)
        self.samples: list[tuple[float, ...] | None] = []
        self._new: list[tuple[float, ...] | None] = []
        self.at_end = self.complete = False
        self._connections, self._connected = board.connections, True
        self._foreign = ""
        self._running = self._granted = False
        self._asked_s = 0.0
        self._started_s = -START_AGAIN_S
        self._heard_s = self.sampled_s = AWAKE.now_s()

    @property
    def received(self) -> int:
        """Number of accepted samples."""
        return self.state.samples - self.state.missing

    @property
    def silent_s(self) -> float:
        """Time since the last accepted sample, or since the board came back after it."""
        return AWAKE.now_s() - self.sampled_s

    @property
    def taken_s(self) -> float:
        """Estimated time of the last sample, by the computer's clock; rather too early."""
        return self._timeline.taken_s

    def serve(self, timeout_s: float) -> None:
        """Receive the board's frames, wait for them up to the timeout, and send what it needs."""
        self.receive(timeout_s)
        if command := self._command(AWAKE.now_s()):
            self._board.send(command)

    def receive(self, timeout_s: float) -> list[Event]:
        """Process the board's frames, wait for them up to the timeout, and return them."""
        arrivals = self._board.receive(timeout_s)
        if self._connected and not self._board.connected:
            self._went_away()
        self._connected = self._board.connected
        if self._board.connections > self._connections:
            self._came_back()
        if arrivals:
            self._heard_s = AWAKE.now_s()
        before = self.received
        for arrival in arrivals:
            match arrival.event:
                case Damaged() as piece:
                    self.note_damaged(piece)
                case Sample() as sample if self._foreign:
                    self._refuse(sample, "sent by another board")
                case Sample() as sample:
                    self._sift(sample, arrival.moment_s)
                case Identity() as identity:
                    self._take_identity(identity, arrival.moment_s)
        if self.received > before:
            self._running = True
            self.sampled_s = AWAKE.now_s()
            self._granted = False
        return [arrival.event for arrival in arrivals]

    def take(self) -> list[tuple[float, ...] | None]:
        """Return the samples since the last call, up to the newest; None is a missing one."""
        new, self._new = self._new, []
        return new

    def settle(self) -> None:
        """Decide on samples in doubt, because no more samples of this board will follow."""
        self._sieve.settle()

    def note_damaged(self, piece: Damaged) -> None:
        """Count bytes that are not a whole frame, and write them to the log."""
        self.state.damaged += 1
        self._log.damaged(piece)

    def _command(self, now_s: float) -> str:
        """Return the command that the board needs now; empty if it needs none."""
        silent = now_s - self._heard_s > SILENT_AFTER_S
        if silent or self._sieve.in_doubt or self._foreign:
            if now_s - self._asked_s > ASK_AGAIN_S:
                self._asked_s = now_s
                return "identify"
        elif not self._running and now_s - self._started_s > START_AGAIN_S:
            self._started_s = now_s
            return "start"
        return ""

    def _went_away(self) -> None:
        self.settle()
        self._running = False

    def _came_back(self) -> None:
        """Restart the wait for a sample, because the board is connected again."""
        self._connections = self._board.connections
        self._heard_s = AWAKE.now_s()
        if not self._granted:  # only once, until a sample arrives
            self.sampled_s = self._heard_s
            self._granted = True
        self._take_identity(self._board.identity, elapsed_s(), fresh=True)

    def _take_identity(self, identity: Identity, moment_s: float, fresh: bool = False) -> None:
        """Process the board's description of itself; `fresh` as in `Timeline.continues`."""
        before, self._foreign = self._foreign, differences(self._identity, identity)
        if self._foreign:
            if self._foreign != before:
                self._log.tell(another_board(self._board.port, self._foreign))
            return
        running = identity.entries.get("state") == "running"
        uptime = identity.entries.get("uptime_ms", "")
        if not uptime.isdecimal() or self._timeline.continues(
            int(uptime), running, moment_s, fresh
        ):
            return
        self.settle()
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
        if self.complete:
            return
        if len(sample.counts) != self.sensors or max(sample.counts) > self._full_scale:
            self._refuse(sample, "other sensors or readings than those of this board")
        elif sample.device_ms >= CLOCK_ENDS_MS:
            self._refuse(sample, "a time beyond the end of the board's clock")
        else:
            self._sieve.sift(sample, moment_s)

    def _refuse(self, sample: Sample, reason: str) -> None:
        """Count a sample that cannot be used, and write it to the log."""
        self.note_damaged(Damaged(repr(sample).encode(), reason))

    def _accept(self, sample: Sample, slot: Slot) -> None:
        if self.complete:
            return
        self.complete = slot.index + 1 >= self._limit
        if slot.index >= self._limit:
            return
        if slot.missing:
            self._note_gap(slot)
        for _ in range(slot.missing):
            self._keep(None)
        self._keep(sample.counts)
        if sample.at_end:
            self.at_end = True
            self.complete = self.complete or self._to_end_stop

    def _keep(self, counts: tuple[float, ...] | None) -> None:
        self._new.append(counts)
        if len(self.samples) < self._kept:
            self.samples.append(counts)
        self.state.add(counts)

    def _note_gap(self, slot: Slot) -> None:
        self.state.gaps += 1
        self.state.missing += slot.missing
        clock = "this computer's clock" if slot.by_computer_clock else "the board's clock"
        start_s = (slot.index - slot.missing) * self.state.period_s
        self._log.note(f"gap at {start_s:.1f} s: {slot.missing} samples are missing, by {clock}")


def check_fits(identity: Identity, settings: dict[str, Any]) -> None:
    """Raise an error if the workflow could not read recordings of this logger.

    Parameters
    ----------
    identity : Identity
        The logger's description of itself.
    settings : dict
        Section ``recording`` of the configuration.

    Raises
    ------
    AcquisitionError
        The board has another number of sensors or another rate.
    """
    for entry, key in (("channels", "sensors"), ("rate_hz", "rate_hz")):
        if float(identity.entries[entry]) != settings[key]:
            raise AcquisitionError(
                f"the board has {entry} = {identity.entries[entry]}, but the workflow is "
                f"configured for {settings[key]:g}; change recording.{key} in config/config.yaml, "
                "or use another board"
            )


def header_of(identity: Identity, started: datetime) -> dict[str, str]:
    """Return the header of this logger's recordings."""
    entries = identity.entries
    return {
        "source": f"recorded by the {identity.device} board, firmware {entries['firmware']}",
        "rate_hz": entries["rate_hz"],
        "adc_bits": entries["adc_bits"],
        "vref_v": f"{int(entries['vref_mv']) / 1000:g}",
        "series_ohm": entries["series_ohm"],
        "started": moment_text(started),
    }


def moment_text(moment: datetime) -> str:
    """Return a time in UTC as text for a header."""
    return moment.isoformat(timespec="seconds").replace("+00:00", "Z")
