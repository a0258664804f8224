"""The logger of a survey: its samples on an even grid in time; a late sample is missing."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from capsule.arrays import FloatArray
from capsule.bench.attendance import Attendance
from capsule.bench.bench_errors import AcquisitionError, BoardLostError
from capsule.bench.board_link import BoardLink
from capsule.bench.clock import AWAKE, elapsed_s
from capsule.bench.frame_log import FrameLog
from capsule.bench.intake import Intake

# A sample that is later than this is missing: the survey does not wait for it.
LATE_S = 2.0
LAST_WORD = "pause"
Number = TypeVar("Number", float, np.ndarray)


class LoggerFeed:
    """The source of a survey's samples, in columns on an even grid in time.

    Parameters
    ----------
    link : BoardLink
        The board's line.
    log : FrameLog
        Log of damaged frames and gaps.
    tell : callable
        Function that shows a message to the user.

    Attributes
    ----------
    at_end : bool
        Whether the capsule has reached the end stop.
    """

    def __init__(self, link: BoardLink, log: FrameLog, tell: Callable[[str], None]) -> None:
        self._link, self._tell = link, tell
        self._intake = Intake(link.identity, self, log, limit=None, kept=0)
        self._attendance = Attendance(link.identity, self._intake, tell)
        self._sensors = int(link.identity.entries["channels"])
        self._period_s = self._intake.progress.period_s
        self._connections, self._connected = link.connections, True
        # Samples that were not taken yet, and the number of the first one.
        self._columns: list[Sequence[float] | None] = []
        self._first = 0
        self.at_end = False

    @property
    def rate_hz(self) -> float:
        """Samples per second."""
        return 1.0 / self._period_s

    def serve(self, timeout_s: float) -> None:
        """Read the board's frames; wait for them up to the timeout."""
        arrivals = self._link.receive(timeout_s)
        if self._link.connected != self._connected:
            self._connected = self._link.connected
            if not self._connected:
                self._attendance.went_away()
        if self._link.connections > self._connections:
            self._connections = self._link.connections
            self._attendance.came_back()
            self._attendance.take_identity(
                self._link.identity, elapsed_s(), self._link.port, fresh=True
            )
        for arrival in arrivals:
            self._attendance.take([arrival], self._link.port)
            if self._intake.ended:
                # Go on: the survey ends only after the origami is unfolded.
                self.at_end, self._intake.ended = True, ""
        if command := self._attendance.command(AWAKE.now_s()):
            self._link.send(command)

    def take(self, count: int) -> tuple[FloatArray, FloatArray] | None:
        """Take the next samples; return None while some have not arrived and are not late.

        Parameters
        ----------
        count : int
            Number of samples K.

        Returns
        -------
        values : (S, K) array
            Readings; NaN is a missing sample.
        moments_s : (K,) array
            Times of the samples by the computer's clock.
        """
        if len(self._columns) < count and not self._late(count):
            return None
        columns, self._columns = self._columns[:count], self._columns[count:]
        values = np.full((self._sensors, count), np.nan)
        for number, column in enumerate(columns):
            if column is not None:
                values[:, number] = column
        moments_s = self._moment_s(self._first + np.arange(count))
        self._first += count
        return values, moments_s

    def trouble(self, patience_s: float) -> AcquisitionError | None:
        """Return the error that ends the survey; None if it can continue."""
        silent_s = AWAKE.now_s() - self._attendance.sampled_s
        if silent_s <= patience_s:
            return None
        return BoardLostError(
            f"the logger at {self._link.port} sent no sample for {silent_s:.0f} s (--patience)"
        )

    def close(self) -> None:
        """Pause the board and close its port."""
        self._link.send(LAST_WORD)
        self._link.close()

    # The interface `Rows` of `Intake`.

    def add(self, time_s: float, values: Sequence[float] | None) -> None:
        """Add a sample; None is a missing one. A sample that was late stays missing."""
        number = round(time_s / self._period_s)
        if number == self._first + len(self._columns):
            self._columns.append(values)

    def flush(self) -> None:
        """Do nothing, because `take` reads the samples from memory."""

    def _late(self, count: int) -> bool:
        """Return whether the last of the next samples is late."""
        if self._intake.received == 0:
            return False
        return elapsed_s() > self._moment_s(self._first + count - 1) + LATE_S

    def _moment_s(self, number: Number) -> Number:
        """Return the times of samples, past or future, by the computer's clock."""
        newest = self._intake.progress.places - 1
        return self._intake.taken_s + (number - newest) * self._period_s
