"""The places that a survey suspects: the threshold of suspicion, and the decision on each place.

The threshold is adaptive. It keeps a budget of suspicions a metre on any bench, after I. Gibbs and
E. Candes, Adaptive Conformal Inference Under Distribution Shift (arXiv 2106.00170). A level rises
with every error and sinks without one, so that the rate of errors approaches the wanted rate for
any distribution of the scores. Their level is a quantile. Here the level is a height above the
usual evidence, in units of its spread, so that it can exceed all values seen so far.

The decision assumes:

- The unit of evidence is the largest evidence that some centimetres of healthy gut usually have at
  present. So the limits also hold on a noisier bench.
- The first pass counts as well, although it was selected for its high evidence. The limits were
  learned from suspected healthy places, which were selected in the same way.
- Seat, noise and drift differ from pass to pass. The nodule's height against the capsule and the
  wall's unevenness do not. Passes over one place are therefore far from independent, and the
  decision uses no sequential test that assumes independence.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from capsule.survey.cycle import MOST_RETESTS
from capsule.survey.gut_evidence import GutEvidence

# Simulated guts gave the numbers of threshold and decision (docs/survey.md).
# Wanted number of suspicions in a metre of healthy gut.
_BUDGET = 1.5
# Length of a block, and the number of blocks that are remembered.
_BLOCK_MM, _MEMORY = 25.0, 80
# Median and scale of the blocks' largest evidence before any block is known, and the number of
# blocks that replace this prior step by step.
_PRIOR, _PRIOR_BLOCKS = (0.07, 0.0166), 20
# Rise of the level with each suspicion, in spreads.
_GAIN = 1.0
# Values of a Gumbel distribution of scale 1, the distribution of the largest of many values.
_MEDIAN = -np.log(np.log(2.0))
_BELOW_MEDIAN = _MEDIAN + np.log(np.log(4.0))
# A mean height above the first confirms, below the second dismisses; after the last pass, one above
# the third confirms.
_CONFIRM, _DISMISS, _AT_LAST = 2.05, 1.8, 2.0
# A pass is over when the last sensor is this far beyond the place.
_BEYOND_MM = 5.0
# Largest distance from a place at which evidence counts for it.
_REACH_MM = 6.0
# Smallest distance of a new suspicion from a place that was judged.
_APART_MM = 10.0
_UNKNOWN = float("nan")


@dataclass
class Place:
    """A suspected place."""

    number: int  # from 1, in the order of suspicion
    first_mm: float  # position from the first pass
    threshold: float  # above which the first pass was suspicious
    # The largest evidence of each pass, including the first; NaN for a pass without evidence.
    evidence: list[float] = field(default_factory=list)
    # The same in units of the usual evidence; empty before the first repeated pass.
    heights: list[float] = field(default_factory=list)
    again_mm: list[float] = field(default_factory=list)  # position from each repeated pass
    status: str = ""  # one of `capsule.survey.cycle.STATUSES`; empty before the decision
    may_be_off_mm: float = 0.0  # as in `capsule.survey.sensing.Sensing`, at the first pass

    @property
    def passes(self) -> int:
        """Number of passes with evidence."""
        return int(np.count_nonzero(~np.isnan(self.evidence)))

    @property
    def place_mm(self) -> float:
        """Position: the median over all passes, or the first pass's if the place is dismissed."""
        again = [place for place in self.again_mm if not np.isnan(place)]
        if self.status == "dismissed":
            return self.first_mm
        return float(np.median([self.first_mm, *again]))


class AdaptiveThreshold:
    """The threshold above which evidence is suspicious.

    The gut is divided into blocks of a few centimetres, and each block gives its largest evidence.
    The usual evidence (median and spread) comes from the last blocks, and at first from a prior.
    """

    def __init__(self) -> None:
        self._blocks: deque[float] = deque(maxlen=_MEMORY)
        self.usual = _PRIOR
        # In a Gumbel distribution, blocks exceed this level at the wanted rate.
        rate = -np.log1p(-_BUDGET * _BLOCK_MM / 1000)
        self._begin = self._level = float(-np.log(rate) - _MEDIAN)

    @property
    def threshold(self) -> float:
        """Evidence above it is suspicious."""
        median, scale = self.usual
        return float(median + self._level * scale)

    def height(self, evidence: float) -> float:
        """Return evidence in units of the largest that a block of healthy gut usually has."""
        return float(evidence / self.usual[0])

    def passed(self, way_mm: float) -> None:
        """Lower the level for new gut that was judged."""
        self._level -= _GAIN * _BUDGET * way_mm / 1000

    def suspected(self) -> None:
        """Raise the level after a suspicion."""
        self._level += _GAIN

    def was_right(self) -> None:
        """Undo the rise after a confirmed nodule, because the suspicion was no error."""
        self._level -= _GAIN

    def learn(self, largest: float) -> None:
        """Add the largest evidence of a block without a nodule."""
        self._blocks.append(largest)
        known = len(self._blocks)
        if known > 1:
            share = min(known / _PRIOR_BLOCKS, 1.0)
            # A nodule that was not suspected raises the upper half, so only the lower half is used.
            low, middle = np.quantile(list(self._blocks), (0.25, 0.5))
            scale = (middle - low) / _BELOW_MEDIAN
            median, spread = _PRIOR
            self.usual = share * middle + (1 - share) * median, share * scale + (1 - share) * spread
        if known == _PRIOR_BLOCKS:
            # This undoes the effect of a wrong prior on the level.
            self._level = self._begin


def decide(heights: Sequence[float]) -> str:
    """Return the decision from all passes over a place.

    Parameters
    ----------
    heights : sequence of float
        Evidence near the place in the first pass and in each repeated pass, in units of the usual
        evidence; NaN for a pass without evidence.
    """
    again = np.array(heights[1:])
    last = len(again) >= MOST_RETESTS
    if np.isnan(again).all():
        return "undecided" if last else "again"
    mean = np.nanmean(heights)
    if mean > (_AT_LAST if last else _CONFIRM):
        return "confirmed"
    if mean < _DISMISS:
        return "dismissed"
    return "undecided" if last else "again"


class Suspects:
    """The places suspected so far.

    Attributes
    ----------
    places : list of Place
        The places in the order of suspicion; the last one is the present place.
    threshold : AdaptiveThreshold
        Threshold above which evidence is suspicious.
    newest_score : float
        The largest evidence of the newest judgement; NaN if it had none.
    """

    def __init__(self, length_mm: float) -> None:
        self.places: list[Place] = []
        self.newest_score = _UNKNOWN
        self.threshold = AdaptiveThreshold()
        self._length_mm = length_mm
        self._front_mm: float | None = None
        self._open_from_mm = -np.inf
        self._block: tuple[int, float] | None = None
        self._best = (_UNKNOWN, -np.inf)

    @property
    def present(self) -> Place:
        """The place that the survey examines at present."""
        return self.places[-1]

    def is_beyond(self, position_mm: float) -> bool:
        """Return whether the last sensor is far enough beyond the present place."""
        return position_mm >= self.present.first_mm + self._length_mm + _BEYOND_MM

    def look(self, evidence: GutEvidence, fix_mm: float) -> Place | None:
        """Add the evidence of new gut, and return a new suspected place, if any."""
        self._go_on(evidence, fix_mm - self._length_mm)
        place_mm, score = self._unjudged(evidence).best()
        self.newest_score = score
        threshold = self.threshold.threshold
        if not score > threshold:
            return None
        self.threshold.suspected()
        self.places.append(Place(len(self.places) + 1, place_mm, threshold))
        self._best = (place_mm, score)
        return self.present

    def look_closer(self, evidence: GutEvidence, fix_mm: float) -> None:
        """Add evidence to the first pass over the present place."""
        self._go_on(evidence, fix_mm - self._length_mm)
        self._keep_best(self._unjudged(evidence))
        self.present.first_mm = self._best[0]

    def end_first_pass(self) -> None:
        """End the first pass over the present place."""
        self.present.evidence.append(self._end()[1])
        # All gut passed until now has been judged, too.
        if self._front_mm is not None:
            self._open_from_mm = self._front_mm

    def jump(self) -> None:
        """Skip gut that the capsule has passed folded, because it was not judged."""
        self._front_mm = None

    def look_again(self, evidence: GutEvidence) -> None:
        """Add evidence of a repeated pass; only evidence near the present place counts."""
        first_mm = self.present.first_mm
        self._keep_best(evidence.within(first_mm - _REACH_MM, first_mm + _REACH_MM))

    def end_pass(self) -> str:
        """End a repeated pass over the present place, and return the decision of `decide`."""
        place_mm, score = self._end()
        seen, place = np.isfinite(score), self.present
        place.evidence.append(score if seen else _UNKNOWN)
        place.again_mm.append(place_mm)
        # The heights of all passes are computed with the present noise.
        place.heights = [self.threshold.height(evidence) for evidence in place.evidence]
        outcome = decide(place.heights)
        if outcome != "again":
            self.close(outcome)
        return outcome

    def close(self, status: str) -> None:
        """Set the status of the present place, if it has none."""
        if not self.places or self.present.status:
            return
        self.present.status = status
        if status == "confirmed":
            self.threshold.was_right()

    def _end(self) -> tuple[float, float]:
        """Return the place with the most evidence in the pass that ends, and this evidence."""
        best, self._best = self._best, (_UNKNOWN, -np.inf)
        return best

    def _keep_best(self, evidence: GutEvidence) -> None:
        place_mm, score = evidence.best()
        self.newest_score = score
        if score > self._best[1]:
            self._best = (place_mm, score)

    def _unjudged(self, evidence: GutEvidence) -> GutEvidence:
        judged = [place.first_mm for place in self.places if place.status]
        ahead = evidence.within(self._open_from_mm, np.inf)
        return ahead.without(judged, _APART_MM)

    def _go_on(self, evidence: GutEvidence, front_mm: float) -> None:
        """Update the threshold with new gut that all sensors have passed, block by block."""
        if self._front_mm is None:
            self._front_mm = front_mm
        new_mm = max(front_mm - self._front_mm, 0.0)
        self._front_mm += new_mm
        self.threshold.passed(new_mm)
        number = int(front_mm // _BLOCK_MM)
        if self._block is None or number > self._block[0]:
            if self._block is not None and np.isfinite(self._block[1]):
                self.threshold.learn(self._block[1])
            self._block = number, -np.inf
        perhaps = [place.first_mm for place in self.places if place.status != "dismissed"]
        ahead = evidence.within(self._open_from_mm, np.inf)
        _, largest = ahead.without(perhaps, 2 * _APART_MM).best()
        if largest > self._block[1]:
            self._block = number, largest
