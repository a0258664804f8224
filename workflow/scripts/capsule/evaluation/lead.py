"""The leading detector of the report: the best one on this archive, or the configured one."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from capsule.evaluation.cross_validation import HELD_OUT, choosing_scheme
from capsule.evaluation.rates import of_any


@dataclass(frozen=True)
class Lead:
    """The leading detector, and whether the configuration names it.

    ``sensitivity`` is that at the configured specificity, on which the choice rests; NaN if it is
    unknown. ``compared`` is a number of detectors.
    """

    detector: str
    named: bool
    sensitivity: float
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
    summary: pd.DataFrame, detectors: Sequence[str], schemes: Sequence[str], named: str
) -> Lead:
    """Return the detector whose verdicts the report shows first.

    All detectors are compared at the same share of false alarms. The specificity of a learned
    threshold is set, so it tells nothing of a detector.

    Parameters
    ----------
    summary : DataFrame
        results/evaluation/summary.csv.
    detectors, schemes : sequence of str
        Those of the evaluation. Of equally good detectors, the first leads. The scheme is the
        `choosing_scheme`.
    named : str
        The configured detector. Any other text selects the highest sensitivity at the specificity.
    """
    of_scheme = summary[summary["scheme"] == choosing_scheme(schemes)]
    of_scheme = of_any(of_scheme).set_index("detector")
    reached = of_scheme["sensitivity_at_specificity"].reindex(list(detectors)).astype(float)
    known = reached.dropna()
    # Of several that are equal, idxmax returns the first.
    best = str(known.idxmax()) if len(known) else detectors[0]
    detector = named if named in detectors else best
    return Lead(detector, named in detectors, float(reached[detector]), len(known))
