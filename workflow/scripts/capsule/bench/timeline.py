"""Place samples in time: a gap becomes missing samples, and later samples keep their times.

One damaged frame in 65 536 passes its check, and its time can have any value. So `Timeline` accepts
a sample at once only if it is exactly the next one. Any other sample waits for the one after it. If
that one continues it, it is accepted; if that one contradicts it, it is refused.
"""

import math
from collections.abc import Callable

from capsule.bench.protocol import Sample

LARGEST_STRAY = 0.2  # largest deviation of a device time from the even grid, in periods
# Both have 32 bits on the board: its clock starts again after 49.7 days.
CLOCK_ENDS_MS = COUNTER_ENDS = 2**32
DRIFT = 0.01  # largest relative deviation of the board's resonator from the computer's clock
# A gap that is longer by the board's clock than by the computer's by so much is an error.
CLOCKS_DIFFER_S = 10.0
# After so many samples that continue each other but not the last one, the board's clock has jumped.
BELIEVED_ALONE = 20
DOUBTED_ALONE = 3
CONTRADICTED = "the samples around it contradict it"
# A sample, and the computer's clock when it was read.
_Read = tuple[Sample, float]
_Accept = Callable[[Sample, int, bool], None]
_Refuse = Callable[[Sample, str], None]


class BoardClock:
    """A conversion of a board's times to the computer's clock.

    The delay of a line varies. The smallest one counts as the delay of the line.
    """

    def __init__(self) -> None:
        self._last_ms: int | None = None
        self._board_s = 0.0
        self._least_delay_s = math.inf

    def continues(self, device_ms: int) -> bool:
        """Return whether the board has run without a reset since its last frame."""
        return self._last_ms is None or (device_ms - self._last_ms) % CLOCK_ENDS_MS < 2**31

    def moment_s(self, device_ms: int, arrived_s: float) -> float:
        """Convert a time of the board to the computer's clock, and store the delay."""
        last_ms = device_ms if self._last_ms is None else self._last_ms
        passed_s = (device_ms - last_ms) % CLOCK_ENDS_MS / 1000
        self._last_ms = device_ms
        self._board_s += passed_s
        # The two clocks drift apart, so an old delay counts as longer.
        aged_s = self._least_delay_s + DRIFT * passed_s
        self._least_delay_s = min(aged_s, arrived_s - self._board_s)
        return self._board_s + self._least_delay_s


class Timeline:
    """A timeline that places samples by the board's clock, or after a restart by the computer's.

    Parameters
    ----------
    rate_hz : float
        Samples per second.
    accept : callable
        Called with each sample that is accepted, the number of missing samples before it, and
        whether the computer's clock measured this gap, because the board restarted.
    refuse : callable
        Called with each sample that is not used, and the reason.

    Attributes
    ----------
    taken_s : float
        Time of the last accepted sample by the computer's clock.
    """

    def __init__(self, rate_hz: float, accept: _Accept, refuse: _Refuse) -> None:
        self._period_ms, self._accept, self._refuse = 1000.0 / rate_hz, accept, refuse
        self._last: Sample | None = None
        self._restarted = False
        self._clock = BoardClock()
        self.taken_s = 0.0
        # At most `BELIEVED_ALONE` wait; the next sample decides between them and earlier rivals.
        self._waiting: list[_Read] = []
        self._rivals: list[_Read] = []

    def continues(self, uptime_ms: int, running: bool, moment_s: float, fresh: bool) -> bool:
        """Return whether the board has run without a restart since the last sample.

        A frame with the board's clock was read at `moment_s` of the computer's; a `fresh` one did
        not wait in the port. A board that sends no samples (`running`) has restarted.
        """
        if self._last is None:
            return True
        # Modulo: a lower time would mean that the clock passed its end, weeks ahead.
        passed_s = (uptime_ms - self._last.device_ms) % CLOCK_ENDS_MS / 1000.0
        ahead_s = passed_s - (moment_s - self.taken_s)
        lowest_s = -CLOCKS_DIFFER_S if fresh else -math.inf
        return running and lowest_s <= ahead_s <= CLOCKS_DIFFER_S

    def note_restart(self) -> None:
        """Decide on the waiting samples, and place the next one by the computer's clock."""
        self.settle()
        self._restarted = self._last is not None

    @property
    def in_doubt(self) -> bool:
        """Return whether new samples contradict the last one, so that the board must be asked."""
        return len(self._waiting) >= DOUBTED_ALONE and not self._steps(*self._waiting[0])

    def sift(self, sample: Sample, moment_s: float) -> None:
        """Decide on a sample that was read at `moment_s` of the computer's clock."""
        new = sample, moment_s
        steps = self._steps(*new)
        if steps == 1 and self._last and not self._restarted:
            self._wait_with()
            self._refuse_rivals()
            self._place(*new)
            return
        if self._between(self._rivals, new) and self._between(self._waiting, new) != 1:
            self._waiting, self._rivals = self._rivals, self._waiting
        fits = bool(self._waiting) and self._steps(*self._waiting[0]) > 0
        if self._between(self._waiting, new):
            self._refuse_rivals()
            if fits:
                self._accept_waiting()
                self.sift(sample, moment_s)
            elif not steps:
                self._waiting.append(new)
                if len(self._waiting) >= BELIEVED_ALONE:
                    self.note_restart()
                    self._accept_waiting()
            else:
                self._wait_with(new)
        elif fits and not steps:
            self._refuse(sample, CONTRADICTED)
        else:
            self._wait_with(new)

    def settle(self) -> None:
        """Decide on the waiting samples, because no more samples of this board will follow."""
        self._refuse_rivals()
        # A restart may have changed whether the first of them fits.
        if self._waiting and self._steps(*self._waiting[0]):
            self._accept_waiting()

    def _steps(self, sample: Sample, moment_s: float) -> int:
        """Return the periods since the last accepted sample; 0 if this one cannot follow it."""
        if self._last is None:
            return 1
        passed_s = moment_s - self.taken_s
        if self._restarted:
            return max(1, round(passed_s * 1000.0 / self._period_ms))
        return steps_between(self._last, sample, self._period_ms, passed_s)

    def _between(self, before: list[_Read], new: _Read) -> int:
        """Return the periods from the last of `before` to `new`; 0 if the two contradict."""
        if not before:
            return 0
        (last, last_s), (sample, moment_s) = before[-1], new
        return steps_between(last, sample, self._period_ms, moment_s - last_s)

    def _place(self, sample: Sample, moment_s: float) -> None:
        missing, by_computer_clock = self._steps(sample, moment_s) - 1, self._restarted
        if self._restarted:
            self._clock = BoardClock()
        self.taken_s = self._clock.moment_s(sample.device_ms, moment_s)
        self._restarted = False
        self._last = sample
        self._accept(sample, missing, by_computer_clock)

    def _wait_with(self, *new: _Read) -> None:
        self._refuse_rivals()
        self._rivals, self._waiting = self._waiting, [*new]

    def _refuse_rivals(self) -> None:
        rivals, self._rivals = self._rivals, []
        for sample, _ in rivals:
            self._refuse(sample, CONTRADICTED)

    def _accept_waiting(self) -> None:
        waiting, self._waiting = self._waiting, []
        for each in waiting:
            self._place(*each)


def steps_between(earlier: Sample, later: Sample, period_ms: float, passed_s: float) -> int:
    """Return the number of periods from one sample to another, by the board's clock.

    It is 0 if the samples contradict each other, or this computer's clock.
    """
    passed_ms = (later.device_ms - earlier.device_ms) % CLOCK_ENDS_MS
    elapsed = passed_ms / period_ms
    steps = round(elapsed)
    frames = (later.sequence - earlier.sequence) % COUNTER_ENDS
    # The board numbers each sample, so there are never more numbers than periods.
    if not 1 <= frames <= steps or abs(elapsed - steps) > LARGEST_STRAY:
        return 0
    return steps if passed_ms / 1000.0 <= passed_s + CLOCKS_DIFFER_S else 0
