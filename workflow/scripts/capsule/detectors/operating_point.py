"""From a score to a verdict: the threshold, and the probability that it is a nodule."""

from dataclasses import dataclass

import numpy as np


def threshold_at(healthy_scores: np.ndarray, specificity: float) -> float:
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
    place = max(rank, 1) - 1
    return float(np.partition(healthy_scores, place)[place])


@dataclass(frozen=True)
class Probability:
    """A logistic curve from the score to the probability of a nodule.

    Attributes
    ----------
    centre, scale : float
        The score is used as (score - centre) / scale.
    intercept, slope : float
        Of the log odds, at the prevalence of the fit.
    """

    centre: float
    scale: float
    intercept: float
    slope: float

    def of(self, scores: np.ndarray | float) -> np.ndarray:
        """Give the probability of a nodule at each score; NaN where the score is unknown."""
        odds = self.intercept + self.slope * (np.asarray(scores) - self.centre) / self.scale
        return 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0)))


def fit_probability(
    scores: np.ndarray, nodule: np.ndarray, prevalence: float, iterations: int = 50
) -> Probability | None:
    """Fit the logistic curve, with the recordings weighted to a stated prevalence.

    The score is standardised by the healthy recordings. A weak Gaussian prior on the slope keeps
    the curve finite where the two kinds do not overlap.

    Parameters
    ----------
    scores : (n,) array
        Scores of the training recordings.
    nodule : (n,) array of bool
        Which of them were made over a nodule.
    prevalence : float
        Share of recordings with a nodule where the verdict will be used.
    iterations : int
        Newton steps.

    Returns
    -------
    Probability or None
        None where one of the two kinds is missing, or the healthy scores do not vary.
    """
    healthy = scores[~nodule]
    if healthy.size < 2 or not nodule.any() or healthy.std() == 0:
        return None
    centre, scale = float(healthy.mean()), float(healthy.std())
    design = np.column_stack([np.ones(scores.size), (scores - centre) / scale])
    share = nodule.mean()
    weight = np.where(nodule, prevalence / share, (1 - prevalence) / (1 - share))
    prior = np.diag([0.0, 0.1])
    logit = np.log(prevalence / (1 - prevalence))
    coefficients = np.array([logit, 0.0])
    for _ in range(iterations):
        odds = np.clip(design @ coefficients, -50.0, 50.0)
        probability = 1.0 / (1.0 + np.exp(-odds))
        gradient = design.T @ (weight * (nodule - probability)) - prior @ coefficients
        curvature = (design * (weight * probability * (1 - probability))[:, np.newaxis]).T @ design
        step = np.linalg.solve(curvature + prior + 1e-9 * np.eye(2), gradient)
        # Newton overshoots where the curve is steep; no step is longer than a few units.
        longest = float(np.abs(step).max())
        coefficients += step * min(1.0, 4.0 / max(longest, 1e-300))
        if longest < 1e-12:
            break
    return Probability(centre, scale, float(coefficients[0]), float(coefficients[1]))
