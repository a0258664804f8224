"""Where in time each sample belongs: a gap is missing samples, never shifted time."""

import math
from collections import deque
from dataclasses import dataclass

from acquisition.protocol import Sample

# The delay between a sample and its arrival varies; the smallest of the last ones is the line's.
DELAYS_KEPT = 50
LARGEST_STRAY = 0.2  # of a period, that a device time may be off the even grid
# Both are 32 bits on the board: its clock begins anew after 49.7 days.
CLOCK_ENDS_MS = COUNTER_ENDS = 2**32
DRIFT = 0.01  # of the time, that the board's resonator may be off the computer's clock
# A gap that is so much longer by the board's clock than by the computer's is none.
CLOCKS_DIFFER_S = 10.0


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
        self._board_s = 0.0  # the board's clock at the last sample, never wrapped
        self._index = -1
        self._restarted = False
        self._delays: deque[float] = deque(maxlen=DELAYS_KEPT)
        self._least_delay_s = math.inf

    @property
    def samples(self) -> int:
        """How many places of the recording are passed, missing samples included."""
        return self._index + 1

    def note_identity(self, uptime_ms: int, running: bool, moment_s: float = math.inf) -> bool:
        """Take note of what the board says of itself; says whether `continues` does not hold."""
        if not self.continues(uptime_ms, running, moment_s):
            self.note_restart()
        return self._restarted

    def continues(
        self, uptime_ms: int, running: bool, moment_s: float = math.inf, fresh: bool = False
    ) -> bool:
        """Say whether the board that took the last sample has run on ever since.

        Parameters
        ----------
        uptime_ms : int
            The board's clock.
        running : bool
            It sends samples; a board that does not, although it had been started, has restarted.
        moment_s : float
            The computer's clock when that was read; its end where it is not known.
        fresh : bool
            It was said at that moment, and did not wait in the port.
        """
        if self._last is None:
            return True
        if moment_s == math.inf:
            return running and uptime_ms >= self._last.device_ms
        # Modulo: a clock that runs backwards would have passed its end weeks ahead.
        passed_s = (uptime_ms - self._last.device_ms) % CLOCK_ENDS_MS / 1000.0
        ahead_s = passed_s - (moment_s - self.taken_s)
        lowest_s = -CLOCKS_DIFFER_S if fresh else -math.inf
        return running and lowest_s <= ahead_s <= CLOCKS_DIFFER_S

    def note_restart(self) -> None:
        """Have the next sample placed by the computer's clock."""
        self._restarted = self._last is not None

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
        steps = self._steps(sample, arrived_s)
        place = Place(self._index + steps, steps - 1, self._restarted)
        if self._last is None or self._restarted:
            self._delays.clear()
            self._least_delay_s = math.inf
            self._board_s = sample.device_ms / 1000.0
        else:
            passed_s = (sample.device_ms - self._last.device_ms) % CLOCK_ENDS_MS / 1000.0
            self._board_s += passed_s
            self._least_delay_s += DRIFT * passed_s
        self._restarted = False
        self._last = sample
        self._index = place.index
        self._delays.append(arrived_s - self._board_s)
        self._least_delay_s = min(self._least_delay_s, self._delays[-1])
        return place

    def is_next(self, sample: Sample) -> bool:
        """Say whether nothing is missing between the last sample and this one."""
        if self._last is None or self._restarted:
            return False
        frames = (sample.sequence - self._last.sequence) % COUNTER_ENDS
        passed_ms = (sample.device_ms - self._last.device_ms) % CLOCK_ENDS_MS
        return frames == 1 and abs(passed_ms / self._period_ms - 1) <= LARGEST_STRAY

    def objection(self, sample: Sample, arrived_s: float) -> str:
        """Say why a sample cannot have been taken after the last one; empty if it can."""
        try:
            self._steps(sample, arrived_s)
        except MisplacedSampleError as reason:
            return str(reason)
        return ""

    @property
    def taken_s(self) -> float:
        """Give the computer's clock when the last sample was taken, rather too early."""
        return self._board_s + self._least_delay_s

    def _steps(self, sample: Sample, arrived_s: float) -> int:
        if self._last is None:
            return 1
        if self._restarted:
            last_arrived_s = self._board_s + min(self._delays)
            return max(1, round((arrived_s - last_arrived_s) * 1000.0 / self._period_ms))
        return steps_between(self._last, sample, self._period_ms, arrived_s - self.taken_s)


def steps_between(earlier: Sample, later: Sample, period_ms: float, passed_s: float) -> int:
    """Count the periods from one sample to another by the board's clock.

    Parameters
    ----------
    earlier, later : Sample
        The samples.
    period_ms : float
        Between two samples.
    passed_s : float
        What passed between them by the computer's clock, at most.

    Returns
    -------
    int

    Raises
    ------
    MisplacedSampleError
        They contradict each other, or this computer's clock.
    """
    passed_ms = (later.device_ms - earlier.device_ms) % CLOCK_ENDS_MS
    elapsed = passed_ms / period_ms
    steps = round(elapsed)
    frames = (later.sequence - earlier.sequence) % COUNTER_ENDS
    pair = (
        f"number {later.sequence} at {later.device_ms} ms cannot follow "
        f"number {earlier.sequence} at {earlier.device_ms} ms"
    )
    # The board numbers what it sends, so more numbers than periods cannot be.
    if not 1 <= frames <= steps or abs(elapsed - steps) > LARGEST_STRAY:
        raise MisplacedSampleError(pair)
    if passed_ms / 1000.0 > passed_s + CLOCKS_DIFFER_S:
        raise MisplacedSampleError(f"{pair}: by this computer's clock {passed_s:.1f} s passed")
    return steps
