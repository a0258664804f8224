"""The leading detector of the report: the best one on this archive, or the configured one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from capsule.evaluation.cross_validation import HELD_OUT, choosing_scheme


@dataclass(frozen=True)
class Lead:
    """The leading detector.

    Attributes
    ----------
    detector : str
        Its name.
    named : bool
        True if the configuration names it.
    balanced_accuracy : float
        From `balanced_accuracy`; NaN if it is unknown.
    compared : int
        Number of detectors that were compared.
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
    by its rates. Held-out recordings had no part in the choice.

    Parameters
    ----------
    lead : Lead
        From `leading`.
    scheme : str
        The scheme whose rates are shown.
    confidence : float
        Wanted level, such as 0.95.
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
    detectors : sequence of str
        The detectors, in the order of the configuration; of equally good ones, the first leads.
    schemes : sequence of str
        The schemes of the evaluation; `choosing_scheme` counts.
    named : str
        The configured detector. Any other text selects the highest balanced accuracy.
    """
    of_scheme = predictions[predictions["scheme"] == choosing_scheme(schemes)]
    reached = {
        name: balanced_accuracy(of_scheme[of_scheme["detector"] == name]) for name in detectors
    }
    known = {name: value for name, value in reached.items() if not np.isnan(value)}
    if named in detectors:
        detector = named
    else:
        # If several are equal, max returns the first.
        detector = max(known, key=lambda name: known[name]) if known else detectors[0]
    return Lead(detector, named in detectors, reached[detector], len(known))


def balanced_accuracy(verdicts: pd.DataFrame) -> float:
    """Return the mean of sensitivity and specificity; no verdict counts as a wrong verdict.

    Parameters
    ----------
    verdicts : DataFrame
        ``size_mm`` and ``predicted_mm`` of one detector under one scheme.

    Returns
    -------
    float
        NaN if there is no recording with a nodule, or none without.
    """
    true_mm, predicted_mm = verdicts["size_mm"].to_numpy(), verdicts["predicted_mm"].to_numpy()
    nodule, healthy = true_mm > 0, true_mm == 0
    if not nodule.any() or not healthy.any():
        return float("nan")
    found, quiet = predicted_mm[nodule] > 0, predicted_mm[healthy] == 0
    return float((found.mean() + quiet.mean()) / 2)
