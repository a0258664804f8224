"""Decide which samples to accept, so that a damaged frame does no harm to later samples.

One damaged frame in 65 536 passes its check, and its time can have any value. The sieve accepts a
sample at once if it is exactly the next one. Any other sample waits for the one after it. If that
one continues it, the sieve accepts it; if that one contradicts it, the sieve refuses it.
"""

from dataclasses import dataclass, field

from capsule.bench.protocol import Sample
from capsule.bench.timeline import MisplacedSampleError, Place, Timeline, steps_between

# After so many samples that continue each other but not the last one, the board's clock has jumped.
BELIEVED_ALONE = 20
DOUBTED_ALONE = 3


@dataclass
class Sifted:
    """Accepted samples with their places, in order, and refused samples with the reasons."""

    accepted: list[tuple[Sample, Place]] = field(default_factory=list)
    refused: list[tuple[Sample, str]] = field(default_factory=list)


@dataclass(frozen=True)
class _Waiting:
    sample: Sample
    moment_s: float
    objection: str


class Sieve:
    """A filter that decides which samples a timeline gets; at most `BELIEVED_ALONE` wait in it.

    Parameters
    ----------
    timeline : Timeline
        Gives the samples their places.
    period_s : float
        Time between two samples.
    """

    def __init__(self, timeline: Timeline, period_s: float) -> None:
        self._timeline = timeline
        self._period_ms = 1000.0 * period_s
        self._waiting: list[_Waiting] = []
        self._rivals: list[_Waiting] = []  # earlier ones; the next sample decides between the two

    @property
    def in_doubt(self) -> bool:
        """Return whether new samples contradict the last one, so that the board must be asked."""
        return len(self._waiting) >= DOUBTED_ALONE and bool(self._objection())

    def sift(self, sample: Sample, moment_s: float) -> Sifted:
        """Decide on a sample that was read at `moment_s` of the computer's clock."""
        sifted = Sifted()
        new = _Waiting(sample, moment_s, self._timeline.objection(sample, moment_s))
        if self._timeline.is_next(sample):
            self._refuse(sifted)
            self._accept(sifted, [new])
            return sifted
        if self._steps(self._rivals, new) and self._steps(self._waiting, new) != 1:
            self._waiting, self._rivals = self._rivals, self._waiting
        if self._steps(self._waiting, new):
            self._refuse_rivals(sifted)
            if not self._objection():
                self._accept_waiting(sifted)
                after = self.sift(sample, moment_s)
                sifted.accepted += after.accepted
                sifted.refused += after.refused
            elif new.objection:
                self._waiting.append(new)
                if len(self._waiting) >= BELIEVED_ALONE:
                    self._timeline.note_restart()
                    self._accept_waiting(sifted)
            else:
                self._wait_with(sifted, new)
        elif self._waiting and new.objection and not self._objection():
            sifted.refused.append((sample, new.objection))
        else:
            self._wait_with(sifted, new)
        return sifted

    def settle(self) -> Sifted:
        """Decide on the waiting samples, because no more samples of this board will follow."""
        sifted = Sifted()
        self._refuse_rivals(sifted)
        if self._waiting and not self._objection():
            self._accept_waiting(sifted)
        return sifted

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
        try:
            return steps_between(last.sample, new.sample, self._period_ms, passed_s)
        except MisplacedSampleError:
            return 0

    def _wait_with(self, sifted: Sifted, new: _Waiting) -> None:
        self._refuse_rivals(sifted)
        self._rivals, self._waiting = self._waiting, [new]

    def _refuse_rivals(self, sifted: Sifted) -> None:
        reason = "the samples around it contradict it"
        sifted.refused += [(each.sample, each.objection or reason) for each in self._rivals]
        self._rivals = []

    def _refuse(self, sifted: Sifted) -> None:
        self._refuse_rivals(sifted)
        self._rivals, self._waiting = self._waiting, []
        self._refuse_rivals(sifted)

    def _accept_waiting(self, sifted: Sifted) -> None:
        waiting, self._waiting = self._waiting, []
        self._accept(sifted, waiting)

    def _accept(self, sifted: Sifted, waiting: list[_Waiting]) -> None:
        for each in waiting:
            sifted.accepted.append((each.sample, self._timeline.place(each.sample, each.moment_s)))
