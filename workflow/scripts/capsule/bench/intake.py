"""The intake of samples: check each one, place it in time, and write it with the gap before it."""

import math
from collections.abc import Sequence
from typing import Protocol

from capsule.bench.frame_log import FrameLog
from capsule.bench.protocol import Damaged, Identity, Sample
from capsule.bench.sieve import Sieve, Sifted
from capsule.bench.terminal import Progress
from capsule.bench.timeline import CLOCK_ENDS_MS, Place, Timeline

FLUSH_EVERY = 1000  # samples: a gap of days is written in pieces, not kept in memory


class Rows(Protocol):
    """A destination of samples, such as the file of a recording."""

    def add(self, time_s: float, values: Sequence[float] | None) -> None:
        """Add a sample; None is a missing one."""

    def flush(self) -> None:
        """Write the added samples."""


class Intake:
    """The intake of the samples of one recording.

    Parameters
    ----------
    identity : Identity
        The logger's description of itself.
    rows : Rows
        Destination of the samples.
    log : FrameLog
        Log of gaps, damaged frames and refused samples.
    limit : int or None
        Number of samples of the recording, missing ones included; None: no limit.
    kept : int
        Number of first samples that stay in memory, for the running verdict.

    Attributes
    ----------
    progress : Progress
        State of the recording.
    samples : list of tuple of int, or None
        The first samples; None is a missing one.
    ended : str
        Reason why the recording is complete; empty while it is not.
    """

    def __init__(
        self, identity: Identity, rows: Rows, log: FrameLog, limit: int | None, kept: int
    ) -> None:
        rate_hz = float(identity.entries["rate_hz"])
        self._sensors = int(identity.entries["channels"])
        self._full_scale = 2 ** int(identity.entries["adc_bits"]) - 1
        self._rows = rows
        self._log = log
        self._limit = math.inf if limit is None else limit
        self._kept = kept
        self._timeline = Timeline(rate_hz)
        self._sieve = Sieve(self._timeline, 1.0 / rate_hz)
        self.progress = Progress(1.0 / rate_hz, end_s=(limit or 0) / rate_hz)
        self.samples: list[tuple[float, ...] | None] = []
        self.ended = ""

    @property
    def received(self) -> int:
        """Number of accepted samples."""
        return self.progress.places - self.progress.missing

    @property
    def taken_s(self) -> float:
        """Estimated time of the last sample, by the computer's clock; rather too early."""
        return self._timeline.taken_s

    def take(self, sample: Sample, moment_s: float) -> None:
        """Check and place a sample that was read at `moment_s` of the computer's clock."""
        if self.ended:
            return
        if len(sample.counts) != self._sensors or max(sample.counts) > self._full_scale:
            self.refuse(sample, "other sensors or readings than those of this board")
            return
        if sample.device_ms >= CLOCK_ENDS_MS:
            self.refuse(sample, "a time beyond the end of the board's clock")
            return
        self._settle(self._sieve.sift(sample, moment_s))

    def take_identity(
        self, uptime_ms: int, running: bool, moment_s: float, fresh: bool = False
    ) -> bool:
        """Compare the board's clock with the samples; return False if the board has restarted."""
        if self._timeline.continues(uptime_ms, running, moment_s, fresh):
            return True
        self.settle()
        self._timeline.note_restart()
        return False

    def settle(self) -> None:
        """Decide on samples in doubt, because no more samples of this board will follow."""
        self._settle(self._sieve.settle())

    @property
    def in_doubt(self) -> bool:
        """Return whether new samples contradict earlier ones, so that the board must be asked."""
        return self._sieve.in_doubt

    def _settle(self, sifted: Sifted) -> None:
        for sample, reason in sifted.refused:
            self.refuse(sample, reason)
        for sample, place in sifted.accepted:
            if not self.ended:
                self._accept(sample, place)

    def note_damaged(self, piece: Damaged) -> None:
        """Count bytes that are not a whole frame, and write them to the log."""
        self.progress.damaged += 1
        self._log.damaged(piece)

    def refuse(self, sample: Sample, reason: str) -> None:
        """Count a sample that cannot be used, and write it to the log."""
        self.note_damaged(Damaged(repr(sample).encode(), reason))

    def _accept(self, sample: Sample, place: Place) -> None:
        if place.index >= self._limit:
            self.ended = "--duration is over"
            return
        if place.missing:
            self._note_gap(place)
        for index in range(place.index - place.missing, place.index):
            self._keep(index, None)
        self._keep(place.index, sample.counts)
        if sample.at_end:
            self.ended = "the capsule reached the end stop"
        elif place.index + 1 == self._limit:
            self.ended = "--duration is over"

    def _keep(self, index: int, counts: tuple[float, ...] | None) -> None:
        # Without rounding, 3 * 0.1 would be written as 0.30000000000000004.
        self._rows.add(round(index * self.progress.period_s, 6), counts)
        if len(self.samples) < self._kept:
            self.samples.append(counts)
        self.progress.recent.append(counts)
        self.progress.places = index + 1
        if index % FLUSH_EVERY == 0:
            self._rows.flush()

    def _note_gap(self, place: Place) -> None:
        self.progress.gaps += 1
        self.progress.missing += place.missing
        clock = "this computer's clock" if place.by_computer_clock else "the board's clock"
        start_s = (place.index - place.missing) * self.progress.period_s
        self._log.note(f"gap at {start_s:.1f} s: {place.missing} samples are missing, by {clock}")
