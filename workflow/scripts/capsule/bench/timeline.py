"""Place samples in time: a gap becomes missing samples, and later samples keep their times.

One damaged frame in 65 536 passes its check, and its time can have any value. So `Sieve` accepts a
sample at once only if it is exactly the next one. Any other sample waits for the one after it. If
that one continues it, the sieve accepts it; if that one contradicts it, the sieve refuses it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Slot:
    """The slot of a sample in the recording.

    Attributes
    ----------
    index : int
        Column of the recording, from 0.
    missing : int
        Number of missing samples before it.
    by_computer_clock : bool
        Whether this computer's clock measured the gap, because the board restarted.
    """

    index: int
    missing: int
    by_computer_clock: bool


class Timeline:
    """A timeline that places samples by the board's clock, or after a restart by the computer's."""

    def __init__(self, rate_hz: float) -> None:
        self.period_ms = 1000.0 / rate_hz
        self._last: Sample | None = None
        self._index = -1
        self._restarted = False
        self._clock = BoardClock()
        self.taken_s = 0.0

    def continues(
        self, uptime_ms: int, running: bool, moment_s: float, fresh: bool = False
    ) -> bool:
        """Return whether the board has run without a restart since the last sample.

        Parameters
        ----------
        uptime_ms : int
            The board's clock.
        running : bool
            Whether the board sends samples; a board that stopped by itself has restarted.
        moment_s : float
            The computer's clock when the frame was read.
        fresh : bool
            Whether the board sent the frame at that moment, so that it did not wait in the port.
        """
        if self._last is None:
            return True
        # Modulo: a lower time would mean that the clock passed its end, weeks ahead.
        passed_s = (uptime_ms - self._last.device_ms) % CLOCK_ENDS_MS / 1000.0
        ahead_s = passed_s - (moment_s - self.taken_s)
        lowest_s = -CLOCKS_DIFFER_S if fresh else -math.inf
        return running and lowest_s <= ahead_s <= CLOCKS_DIFFER_S

    def note_restart(self) -> None:
        """Place the next sample by the computer's clock."""
        self._restarted = self._last is not None

    def place(self, sample: Sample, arrived_s: float) -> Slot:
        """Return the slot of a sample without an objection, which becomes the last one."""
        steps = self._steps(sample, arrived_s)
        slot = Slot(self._index + steps, steps - 1, self._restarted)
        if self._restarted:
            self._clock = BoardClock()
        self.taken_s = self._clock.moment_s(sample.device_ms, arrived_s)
        self._restarted = False
        self._last = sample
        self._index = slot.index
        return slot

    def is_next(self, sample: Sample, arrived_s: float) -> bool:
        """Return whether no sample is missing between the last sample and this one."""
        known = self._last is not None and not self._restarted
        return known and self._steps(sample, arrived_s) == 1

    def objection(self, sample: Sample, arrived_s: float) -> str:
        """Return why a sample cannot follow the last one; empty if it can."""
        if self._last is None or self._steps(sample, arrived_s):
            return ""
        return f"it cannot follow number {self._last.sequence} at {self._last.device_ms} ms"

    def _steps(self, sample: Sample, arrived_s: float) -> int:
        if self._last is None:
            return 1
        if self._restarted:
            return max(1, round((arrived_s - self.taken_s) * 1000.0 / self.period_ms))
        return steps_between(self._last, sample, self.period_ms, arrived_s - self.taken_s)


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


@dataclass(frozen=True)
class _Waiting:
    sample: Sample
    moment_s: float
    objection: str


class Sieve:
    """A filter that decides which samples a timeline gets; at most `BELIEVED_ALONE` wait in it."""

    def __init__(
        self,
        timeline: Timeline,
        accept: Callable[[Sample, Slot], None],
        refuse: Callable[[Sample, str], None],
    ) -> None:
        self._timeline, self._accept, self._refuse = timeline, accept, refuse
        self._waiting: list[_Waiting] = []
        self._rivals: list[_Waiting] = []  # earlier ones; the next sample decides between the two

    @property
    def in_doubt(self) -> bool:
        """Return whether new samples contradict the last one, so that the board must be asked."""
        return len(self._waiting) >= DOUBTED_ALONE and bool(self._objection())

    def sift(self, sample: Sample, moment_s: float) -> None:
        """Decide on a sample that was read at `moment_s` of the computer's clock."""
        new = _Waiting(sample, moment_s, self._timeline.objection(sample, moment_s))
        if self._timeline.is_next(sample, moment_s):
            self._wait_with()
            self._refuse_rivals()
            self._accept(sample, self._timeline.place(sample, moment_s))
            return
        if self._steps(self._rivals, new) and self._steps(self._waiting, new) != 1:
            self._waiting, self._rivals = self._rivals, self._waiting
        if self._steps(self._waiting, new):
            self._refuse_rivals()
            if not self._objection():
                self._accept_waiting()
                self.sift(sample, moment_s)
            elif new.objection:
                self._waiting.append(new)
                if len(self._waiting) >= BELIEVED_ALONE:
                    self._timeline.note_restart()
                    self._accept_waiting()
            else:
                self._wait_with(new)
        elif self._waiting and new.objection and not self._objection():
            self._refuse(sample, new.objection)
        else:
            self._wait_with(new)

    def settle(self) -> None:
        """Decide on the waiting samples, because no more samples of this board will follow."""
        self._refuse_rivals()
        if self._waiting and not self._objection():
            self._accept_waiting()

    def _objection(self) -> str:
        """Return the objection to the first waiting sample; a restart may have changed it."""
        first = self._waiting[0]
        return self._timeline.objection(first.sample, first.moment_s)

    def _steps(self, before: list[_Waiting], new: _Waiting) -> int:
        """Return the periods from the last of `before` to `new`; 0 if the two contradict."""
        if not before:
            return 0
        last = before[-1]
        passed_s = new.moment_s - last.moment_s
        return steps_between(last.sample, new.sample, self._timeline.period_ms, passed_s)

    def _wait_with(self, *new: _Waiting) -> None:
        self._refuse_rivals()
        self._rivals, self._waiting = self._waiting, [*new]

    def _refuse_rivals(self) -> None:
        rivals, self._rivals = self._rivals, []
        for each in rivals:
            self._refuse(each.sample, each.objection or "the samples around it contradict it")

    def _accept_waiting(self) -> None:
        waiting, self._waiting = self._waiting, []
        for each in waiting:
            self._accept(each.sample, self._timeline.place(each.sample, each.moment_s))
