"""A threshold of the evidence that holds a budget of suspicions a metre, whatever the bench.

After I. Gibbs and E. Candes, Adaptive Conformal Inference Under Distribution Shift (arXiv
2106.00170): a level moves with every error that is made and not made, so that the rate of errors
comes to the one that is wanted, however the scores are distributed. Their level is a quantile; ours
is a height above the usual evidence, in units of its spread, so that it can lie beyond all that was
seen.
"""

from collections import deque

import numpy as np

# Of a Gumbel distribution of scale 1: largest values of many.
_MEDIAN = -np.log(np.log(2.0))
_BELOW_MEDIAN = _MEDIAN + np.log(np.log(4.0))


class AdaptiveThreshold:
    """What evidence is suspicious.

    The gut is cut into blocks of a few centimetres, of which each gives its largest evidence. What
    is usual, median and spread, comes from the last blocks, and at first from a prior.

    Parameters
    ----------
    budget : float
        Suspicions wanted a metre of healthy gut.
    block_mm : float
        Length of a block.
    prior : pair of float
        Median and scale of the blocks' largest evidence, as designed.
    prior_blocks : int
        After how many blocks the prior is given up, little by little.
    memory : int
        How many blocks are remembered.
    gain : float
        By how many spreads a suspicion raises the level.

    Attributes
    ----------
    usual : pair of float
        Median and scale of the blocks' largest evidence at present.
    """

    def __init__(
        self,
        *,
        budget: float,
        block_mm: float,
        prior: tuple[float, float],
        prior_blocks: int,
        memory: int,
        gain: float,
    ) -> None:
        self._budget = budget
        self._gain = gain
        self._prior, self._prior_blocks = prior, prior_blocks
        self._blocks: deque[float] = deque(maxlen=memory)
        self._learned = 0
        self.usual = prior
        # For a Gumbel distribution this level is passed as often as wanted.
        rate = -np.log1p(-budget * block_mm / 1000)
        self._begin = self._level = float(-np.log(rate) - _MEDIAN)

    def _usual(self) -> tuple[float, float]:
        count = len(self._blocks)
        if count < 2:
            return self._prior
        share = min(count / self._prior_blocks, 1.0)
        # A nodule that was not suspected raises the upper half.
        low, middle = np.quantile(list(self._blocks), (0.25, 0.5))
        scale = (middle - low) / _BELOW_MEDIAN
        median, spread = self._prior
        return share * middle + (1 - share) * median, share * scale + (1 - share) * spread

    @property
    def threshold(self) -> float:
        """Evidence above it is suspicious."""
        median, scale = self.usual
        return float(median + self._level * scale)

    def height(self, evidence: float) -> float:
        """Return an evidence in parts of the largest that a block of healthy gut usually has."""
        return float(evidence / self.usual[0])

    def passed(self, way_mm: float) -> None:
        """Take note that so much new gut was judged: without a suspicion the level sinks."""
        self._level -= self._gain * self._budget * way_mm / 1000

    def suspected(self) -> None:
        """Take note of a suspicion: the level rises."""
        self._level += self._gain

    def was_right(self) -> None:
        """Take the rise back: what was suspected is a nodule, and no error."""
        self._level -= self._gain

    def learn(self, largest: float) -> None:
        """Take note of the largest evidence of a block without a nodule."""
        self._blocks.append(largest)
        self.usual = self._usual()
        self._learned += 1
        if self._learned == self._prior_blocks:
            # What a wrong prior has done to the level is undone.
            self._level = self._begin
