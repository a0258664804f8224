"""The five verdicts that a person acts on, from what a detector says of a recording or a place."""

from enum import StrEnum

from capsule import words
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
    UNLIKE = words.UNLIKE
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
    unlike: str = "",
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
    unlike : str
        Why the recording is unlike those that teach; empty if it is not.
    reason : str
        Why no detector judges the recording; empty if they do.
    """
    if reason or not words.is_known(score) or not words.is_known(threshold):
        return VerdictWord.NO_VERDICT
    if unlike:
        return VerdictWord.UNLIKE
    if score <= threshold:
        return VerdictWord.NO_NODULE
    doubtful = words.is_known(probability) and probability < LEAST_PROBABILITY
    return VerdictWord.UNCERTAIN if doubtful else VerdictWord.NODULE


def row_verdict(row: Row) -> VerdictWord:
    """Return the verdict of a row of results/detections.csv, predictions.csv or sites.csv."""
    reason = row.get("no_verdict")
    return verdict_word(
        row["score"],
        row["threshold"],
        row.get("probability"),
        unlike=words.unlike_because(row),
        reason=str(reason) if words.is_known(reason) else "",
    )
