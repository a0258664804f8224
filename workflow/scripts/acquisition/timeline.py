"""Where in time each sample belongs: a gap is missing samples, never shifted time."""

from collections import deque
from dataclasses import dataclass

from acquisition.protocol import Sample

# The delay between a sample and its arrival varies; the smallest of the last ones is the line's.
DELAYS_KEPT = 50
LARGEST_STRAY = 0.2  # of a period, that a device time may be off the even grid


class MisplacedSampleError(Exception):
    """A sample whose number and time contradict those before it."""


@dataclass(frozen=True)
class Place:
    """Where a sample belongs.

    Attributes
    ----------
    index : int
        Column of the recording, from 0.
    missing : int
        Samples missing before it.
    by_computer_clock : bool
        The board restarted, so the gap was measured by this computer.
    """

    index: int
    missing: int
    by_computer_clock: bool


class Timeline:
    """Places samples by the board's clock, and across a restart of the board by the computer's.

    Parameters
    ----------
    rate_hz : float
        Samples per second.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_ms = 1000.0 / rate_hz
        self._last: Sample | None = None
        self._index = -1
        self._restarted = False
        self._delays: deque[float] = deque(maxlen=DELAYS_KEPT)

    @property
    def samples(self) -> int:
        """How many places of the recording are passed, missing samples included."""
        return self._index + 1

    def note_identity(self, uptime_ms: int, running: bool) -> bool:
        """Take note of what the board says of itself.

        Returns
        -------
        bool
            The board has restarted since its last sample: its clock began anew, or it does not
            run although it had been started.
        """
        if self._last is not None and (uptime_ms < self._last.device_ms or not running):
            self._restarted = True
        return self._restarted

    def place(self, sample: Sample, arrived_s: float) -> Place:
        """Give a sample its place.

        Parameters
        ----------
        sample : Sample
            The sample.
        arrived_s : float
            The computer's clock at its arrival.

        Raises
        ------
        MisplacedSampleError
            It cannot have been taken after the last one; it must not be used.
        """
        if self._last is None:
            steps = 1
        elif self._restarted:
            steps = self._steps_by_computer_clock(arrived_s)
        else:
            steps = self._steps_by_board_clock(sample, self._last)
        place = Place(self._index + steps, steps - 1, self._restarted)
        if self._restarted:
            self._delays.clear()
        self._restarted = False
        self._last = sample
        self._index = place.index
        self._delays.append(arrived_s - sample.device_ms / 1000.0)
        return place

    def _steps_by_board_clock(self, sample: Sample, last: Sample) -> int:
        elapsed = (sample.device_ms - last.device_ms) / self._period_ms
        steps = round(elapsed)
        frames = sample.sequence - last.sequence
        # The board numbers what it sends, so more numbers than periods cannot be.
        if not 1 <= frames <= steps or abs(elapsed - steps) > LARGEST_STRAY:
            raise MisplacedSampleError(
                f"number {sample.sequence} at {sample.device_ms} ms cannot follow "
                f"number {last.sequence} at {last.device_ms} ms"
            )
        return steps

    def _steps_by_computer_clock(self, arrived_s: float) -> int:
        last_arrived_s = self._last.device_ms / 1000.0 + min(self._delays)
        return max(1, round((arrived_s - last_arrived_s) * 1000.0 / self._period_ms))
