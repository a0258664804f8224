"""The threshold of a score, chosen from the scores of healthy recordings."""

import numpy as np

from capsule.arrays import FloatArray


def threshold_at(healthy_scores: FloatArray, specificity: float) -> float:
    """Return the threshold that limits how often a new healthy recording causes a false alarm.

    The threshold is the score of rank ceil((n + 1) specificity) of n healthy recordings. A new
    healthy recording of the same distribution exceeds it with a probability of at most
    1 - specificity. Fewer than specificity / (1 - specificity) recordings cannot guarantee this;
    the threshold is then the largest score.

    Parameters
    ----------
    healthy_scores : (n,) array
        Scores of recordings without a nodule.
    specificity : float
        The wanted specificity, such as 0.95.

    Returns
    -------
    float
        A score above it means a nodule; NaN if there is no healthy recording.
    """
    count = healthy_scores.size
    if count == 0:
        return float("nan")
    # Slightly less, because rounding can lift a product such as 20 x 0.95 above a whole number.
    rank = min(int(np.ceil((count + 1) * specificity - 1e-9)), count)
    index = max(rank, 1) - 1
    return float(np.partition(healthy_scores, index)[index])
