"""From the scores of healthy recordings to the threshold above which a score means a nodule."""

import numpy as np

from capsule.arrays import FloatArray


def threshold_at(healthy_scores: FloatArray, specificity: float) -> float:
    """Choose the threshold that a new healthy recording exceeds at most so often.

    The threshold is the score of rank ceil((n + 1) specificity) of n healthy recordings: whatever
    their distribution, a further one like them lies above it with a probability of at most
    1 - specificity. With fewer than specificity / (1 - specificity) recordings that much cannot be
    promised; then it is the largest score.

    Parameters
    ----------
    healthy_scores : (n,) array
        Scores of recordings without a nodule.
    specificity : float
        Wanted, such as 0.95.

    Returns
    -------
    float
        A score above it means a nodule; NaN without any healthy recording.
    """
    count = healthy_scores.size
    if count == 0:
        return float("nan")
    # A hair less, for products such as 20 x 0.95 that rounding lifts above a whole number.
    rank = min(int(np.ceil((count + 1) * specificity - 1e-9)), count)
    index = max(rank, 1) - 1
    return float(np.partition(healthy_scores, index)[index])
