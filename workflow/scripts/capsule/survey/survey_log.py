"""What goes into a survey and what comes out: readings of the boards, and a log of events."""

from dataclasses import dataclass

from capsule.arrays import FloatArray

# What a fold board says of the origami.
UNFOLDED, FOLDING, FOLDED, UNFOLDING = "unfolded", "folding", "folded", "unfolding"
UNKNOWN_FOLD = "unknown"
# Unfolded and told to fold, but its motor has to rest first.
RESTING = "resting"


@dataclass(frozen=True)
class Readings:
    """What the boards said since the last judgement.

    Attributes
    ----------
    time_s : (K,) array
        Times of the samples.
    values : (S, K) array
        Readings; NaN where a sample is missing.
    wave_mm : (K,) array
        How far the drive has carried the wave; NaN where that is not known.
    fold : str
        What the fold board says of the origami: ``unfolded``, ``folding``, ``folded``,
        ``unfolding``, ``resting``, or ``unknown`` where it says nothing.
    """

    time_s: FloatArray
    values: FloatArray
    wave_mm: FloatArray
    fold: str


@dataclass(frozen=True)
class Judgement:
    """What the survey made of the samples up to the newest.

    Attributes
    ----------
    head_mm : float
        Where they have the head; NaN where they do not tell.
    score, threshold : float
        The largest evidence that counts in the present state, NaN where there is none, and what is
        suspicious.
    """

    head_mm: float
    score: float
    threshold: float


@dataclass(frozen=True)
class Event:
    """A line of the log.

    Attributes
    ----------
    time_s : float
        When.
    before, event, after : str
        State, what happened, and state.
    reason : str
        Why, in words.
    position_mm, score, threshold : float
        NaN where they play no part.
    """

    time_s: float
    before: str
    event: str
    after: str
    reason: str
    position_mm: float = float("nan")
    score: float = float("nan")
    threshold: float = float("nan")
