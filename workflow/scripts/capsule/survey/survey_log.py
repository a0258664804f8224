"""The input and the output of a survey: readings of the boards, and a log of events."""

from dataclasses import dataclass

from capsule.arrays import FloatArray

# States of the origami that a fold board reports.
UNFOLDED, FOLDING, FOLDED, UNFOLDING = "unfolded", "folding", "folded", "unfolding"
UNKNOWN_FOLD = "unknown"
# Unfolded, with a command to fold, but the motor has to rest first.
RESTING = "resting"
FOLD_STATES = {UNFOLDED, FOLDING, FOLDED, UNFOLDING, RESTING, UNKNOWN_FOLD}


@dataclass(frozen=True)
class Readings:
    """The data from the boards since the last judgement.

    Attributes
    ----------
    values : (S, K) array
        Readings; NaN where a sample is missing.
    wave_mm : (K,) array
        How far the drive has carried the wave; NaN where that is unknown.
    fold : str
        State of the origami from the fold board, one of `FOLD_STATES`; ``unknown`` if it says
        nothing.
    """

    values: FloatArray
    wave_mm: FloatArray
    fold: str


@dataclass(frozen=True)
class Event:
    """One line of the log.

    Attributes
    ----------
    time_s : float
        Time of the event in seconds.
    before, event, after : str
        State before, event, and state after.
    reason : str
        Reason in words.
    position_mm, score, threshold : float
        Values at the event; NaN if they do not apply.
    """

    time_s: float
    before: str
    event: str
    after: str
    reason: str
    position_mm: float = float("nan")
    score: float = float("nan")
    threshold: float = float("nan")
