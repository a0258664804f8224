"""An adaptive threshold of the evidence that keeps a budget of suspicions a metre on any bench.

After I. Gibbs and E. Candes, Adaptive Conformal Inference Under Distribution Shift (arXiv
2106.00170). A level rises with every error and sinks without one, so that the rate of errors
approaches the wanted rate for any distribution of the scores. Their level is a quantile. Here the
level is a height above the usual evidence, in units of its spread, so that it can exceed all values
seen so far.
"""

from collections import deque

import numpy as np

# Values of a Gumbel distribution of scale 1, the distribution of the largest of many values.
_MEDIAN = -np.log(np.log(2.0))
_BELOW_MEDIAN = _MEDIAN + np.log(np.log(4.0))


class AdaptiveThreshold:
    """The threshold above which evidence is suspicious.

    The gut is divided into blocks of a few centimetres, and each block gives its largest evidence.
    The usual evidence (median and spread) comes from the last blocks, and at first from a prior.

    Parameters
    ----------
    budget : float
        Wanted number of suspicions in a metre of healthy gut.
    block_mm : float
        Length of a block.
    prior : pair of float
        Median and scale of the blocks' largest evidence before any block is known.
    prior_blocks : int
        Number of blocks that replace the prior step by step.
    memory : int
        Number of blocks that are remembered.
    gain : float
        Rise of the level with each suspicion, in spreads.

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
        # In a Gumbel distribution, blocks exceed this level at the wanted rate.
        rate = -np.log1p(-budget * block_mm / 1000)
        self._begin = self._level = float(-np.log(rate) - _MEDIAN)

    def _usual(self) -> tuple[float, float]:
        count = len(self._blocks)
        if count < 2:
            return self._prior
        share = min(count / self._prior_blocks, 1.0)
        # A nodule that was not suspected raises the upper half, so only the lower half is used.
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
        """Return evidence in units of the largest that a block of healthy gut usually has."""
        return float(evidence / self.usual[0])

    def passed(self, way_mm: float) -> None:
        """Lower the level for new gut that was judged."""
        self._level -= self._gain * self._budget * way_mm / 1000

    def suspected(self) -> None:
        """Raise the level after a suspicion."""
        self._level += self._gain

    def was_right(self) -> None:
        """Undo the rise after a confirmed nodule, because the suspicion was no error."""
        self._level -= self._gain

    def learn(self, largest: float) -> None:
        """Add the largest evidence of a block without a nodule."""
        self._blocks.append(largest)
        self.usual = self._usual()
        self._learned += 1
        if self._learned == self._prior_blocks:
            # This undoes the effect of a wrong prior on the level.
            self._level = self._begin
