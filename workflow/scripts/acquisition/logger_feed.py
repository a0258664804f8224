"""The logger of a survey: samples as they come, and missing ones where none came in time."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from acquisition.attendance import Attendance
from acquisition.bench_errors import AcquisitionError, BoardLostError
from acquisition.board_link import BoardLink
from acquisition.clock import AWAKE, elapsed_s
from acquisition.frame_log import FrameLog
from acquisition.intake import Intake
from capsule.arrays import FloatArray

# What comes later than this is given as missing: a survey does not stand still.
LATE_S = 2.0
LAST_WORD = "pause"
Number = TypeVar("Number", float, np.ndarray)


class LoggerFeed:
    """The samples of a survey, in columns on an even grid in time.

    Parameters
    ----------
    link : BoardLink
        The board's line.
    log : FrameLog
        Where damaged frames and gaps go.
    tell : callable
        Is told what people should know.

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
        # Samples that nobody has taken yet; the first one's number.
        self._columns: list[Sequence[float] | None] = []
        self._first = 0
        self.at_end = False

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return 1.0 / self._period_s

    def serve(self, timeout_s: float) -> None:
        """Take what the board has said; waits up to the timeout for something to come."""
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
                # More samples come: the survey ends when the origami is unfolded.
                self.at_end, self._intake.ended = True, ""
        if command := self._attendance.command(AWAKE.now_s()):
            self._link.send(command)

    def take(self, count: int) -> tuple[FloatArray, FloatArray] | None:
        """Take the next samples; None while they have not come and are not late.

        Parameters
        ----------
        count : int
            How many, K.

        Returns
        -------
        values : (S, K) array
            Readings; NaN where a sample is missing.
        moments_s : (K,) array
            The computer's clock when each was taken.
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
        """Say why the survey cannot go on; None if it can."""
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

    # What `Intake` needs of the place where its samples go.

    def add(self, time_s: float, values: Sequence[float] | None) -> None:
        """Add a sample; None is a missing one. What was given as missing stays missing."""
        number = round(time_s / self._period_s)
        if number == self._first + len(self._columns):
            self._columns.append(values)

    def flush(self) -> None:
        """Do nothing: samples are taken from here."""

    def _late(self, count: int) -> bool:
        """Say whether samples that have not come would be late by now."""
        if self._intake.received == 0:
            return False
        return elapsed_s() > self._moment_s(self._first + count - 1) + LATE_S

    def _moment_s(self, number: Number) -> Number:
        """Return the computer's clock when samples were, or will be, taken."""
        newest = self._intake.progress.places - 1
        return self._intake.taken_s + (number - newest) * self._period_s
