"""The five verdicts that a person acts on, from what a detector says of a recording or a place."""

import math
from enum import StrEnum

from capsule.kinds import Row

# From this probability of a nodule on, a score above the threshold is a nodule.
LEAST_PROBABILITY = 0.5


class VerdictWord(StrEnum):
    """A verdict in words, as all tables, programs and the page show it; the most urgent first.

    `NODULE` and `UNCERTAIN` both count as found: the threshold decides, as in the paper, whose
    capsule passes again what resembles a nodule.
    """

    NODULE = "nodule"
    UNCERTAIN = "uncertain: pass again"
    UNLIKE = "unlike the recordings that teach"
    NO_VERDICT = "no verdict"
    NO_NODULE = "no nodule"

    @property
    def code(self) -> str:
        """The verdict as one word, for classes and keys: ``no_nodule``."""
        return self.name.lower()


# What a survey's places are called, by the status of results of the survey.
OF_SURVEY = {
    "confirmed": VerdictWord.NODULE,
    "undecided": VerdictWord.UNCERTAIN,
    "dismissed": VerdictWord.NO_NODULE,
}


def verdict_word(
    score: float | None,
    threshold: float | None,
    probability: float | None = None,
    *,
    unlike: bool = False,
    reason: str = "",
) -> VerdictWord:
    """Return which of the five verdicts a detector gives.

    Parameters
    ----------
    score, threshold : float or None
        The score, and the threshold above which it means a nodule; None or NaN if not known.
    probability : float or None
        Probability of a nodule at the configured prevalence. Without one, as of a detector that
        gives none or of several passes together, the threshold alone decides.
    unlike : bool
        Whether the recording is unlike those that teach.
    reason : str
        Why no detector judges the recording; empty if they do.
    """
    if reason or score is None or threshold is None or math.isnan(score) or math.isnan(threshold):
        return VerdictWord.NO_VERDICT
    if unlike:
        return VerdictWord.UNLIKE
    if score <= threshold:
        return VerdictWord.NO_NODULE
    # A comparison with NaN is false.
    doubtful = probability is not None and probability < LEAST_PROBABILITY
    return VerdictWord.UNCERTAIN if doubtful else VerdictWord.NODULE


def row_verdict(row: Row) -> VerdictWord:
    """Return the verdict of a row of results/detections.csv, predictions.csv or sites.csv."""
    reason = row.get("no_verdict")
    return verdict_word(
        row["score"],
        row["threshold"],
        row.get("probability"),
        unlike=row.get("familiar") == "no",
        reason=reason if isinstance(reason, str) else "",
    )
