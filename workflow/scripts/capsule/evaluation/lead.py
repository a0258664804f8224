"""The leading detector of the report: the best one on this archive, or the configured one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from capsule.evaluation.cross_validation import HELD_OUT, choosing_scheme
from capsule.evaluation.rates import is_right


@dataclass(frozen=True)
class Lead:
    """The leading detector, and whether the configuration names it.

    ``balanced_accuracy`` is NaN if it is unknown. ``compared`` is a number of detectors.
    """

    detector: str
    named: bool
    balanced_accuracy: float
    compared: int


def headline_confidence(lead: Lead, scheme: str, confidence: float) -> float:
    """Return the level of the leading detector's intervals, after which their promise holds.

    The best of several detectors looks better than it is. The intervals of all of them hold at once
    if each has the level ``1 - (1 - confidence) / number compared`` (Bonferroni 1936), so they also
    hold for the best one, whichever it is. A detector that the configuration names was not chosen
    by its rates. Under the scheme of held-out sessions, the recordings had no part in the choice.
    """
    if lead.named or scheme == HELD_OUT:
        return confidence
    return 1 - (1 - confidence) / max(lead.compared, 1)


def leading(
    predictions: pd.DataFrame, detectors: Sequence[str], schemes: Sequence[str], named: str
) -> Lead:
    """Return the detector whose verdicts the report shows first.

    Parameters
    ----------
    predictions : DataFrame
        results/evaluation/predictions.csv.
    detectors, schemes : sequence of str
        Those of the evaluation. Of equally good detectors, the first leads. The scheme is the
        `choosing_scheme`.
    named : str
        The configured detector. Any other text selects the highest balanced accuracy.
    """
    of_scheme = predictions[predictions["scheme"] == choosing_scheme(schemes)]
    reached = {
        name: balanced_accuracy(of_scheme[of_scheme["detector"] == name]) for name in detectors
    }
    known = [name for name in detectors if not np.isnan(reached[name])]
    # If several are equal, max returns the first.
    best = max(known, key=lambda name: reached[name], default=detectors[0])
    detector = named if named in detectors else best
    return Lead(detector, named in detectors, reached[detector], len(known))


def balanced_accuracy(verdicts: pd.DataFrame) -> float:
    """Return the mean of sensitivity and specificity; no verdict counts as a wrong verdict.

    It is made from ``size_mm`` and ``predicted_mm`` of one detector under one scheme. It is NaN
    without a recording over a nodule, or without a healthy one.
    """
    true_mm = verdicts["size_mm"].to_numpy()
    right = is_right(verdicts["predicted_mm"].to_numpy(), true_mm)
    nodules, healthy = right[true_mm > 0], right[true_mm == 0]
    if not nodules.size or not healthy.size:
        return float("nan")
    return float((nodules.mean() + healthy.mean()) / 2)
