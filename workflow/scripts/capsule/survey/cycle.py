"""The capsule's cycle as a table: in each state, an event leads to a new state and to commands.

The capsule senses unfolded, suspects a place, finishes the pass and folds. The waves push it back.
It unfolds, finds its position, passes the place again, and the survey decides. Two counters
complete the table: how often a place was passed again, and how often in a row folding did not bring
the capsule back.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

FOLD, UNFOLD, HOLD, STOP_WAVE = "fold", "unfold", "hold", "stop_wave"

MOST_RETESTS = 2
MOST_TRIES = 3


class Step(NamedTuple):
    """The state after an event, and the commands for the boards."""

    state: str
    commands: tuple[str, ...] = ()


# What is decided of a suspected place.
STATUSES = ("confirmed", "dismissed", "undecided")
# The states, with their descriptions for the user.
STATES = {
    "starting": "waits until it feels the wave",
    "exploring": "explores",
    "finishing": "passes the suspected place",
    "folding": "folds",
    "returning": "is folded; the waves push it back",
    "unfolding": "unfolds",
    "finding": "finds its position",
    "passing": "passes the place again",
    "approaching": "travels to its target",
    "arrived": "has reached its target",
    "closing": "unfolds at the end",
    "ended": "the survey is over",
}

_TABLE: dict[tuple[str, str], Step] = {
    ("starting", "placed"): Step("exploring"),
    ("exploring", "suspected"): Step("finishing"),
    ("finishing", "passed"): Step("folding", (FOLD,)),
    # The lease may end before the folding does, so each tick renews it.
    ("folding", "tick"): Step("folding", (HOLD,)),
    ("folding", "folded"): Step("returning", (HOLD,)),
    ("folding", "late"): Step("unfolding", (UNFOLD,)),
    ("returning", "tick"): Step("returning", (HOLD,)),
    ("returning", "far_enough"): Step("unfolding", (UNFOLD,)),
    # Without a lease or after a reset, the board unfolds by itself. The command repeats that.
    ("returning", "let_go"): Step("unfolding", (UNFOLD,)),
    ("folding", "let_go"): Step("unfolding", (UNFOLD,)),
    ("unfolding", "unfolded"): Step("finding"),
    ("unfolding", "late"): Step("closing", (STOP_WAVE, UNFOLD)),
    ("finding", "placed"): Step("passing"),
    ("finding", "short"): Step("folding", (FOLD,)),
    ("finding", "not_back"): Step("folding", (FOLD,)),
    ("finding", "gone_on"): Step("exploring"),
    ("finding", "lost"): Step("exploring"),
    ("passing", "confirmed"): Step("exploring"),
    ("passing", "dismissed"): Step("exploring"),
    ("passing", "undecided"): Step("exploring"),
    ("passing", "again"): Step("folding", (FOLD,)),
    ("passing", "lost"): Step("exploring"),
    # On the way to a target, the survey suspects no places.
    ("starting", "goal_ahead"): Step("approaching"),
    ("starting", "goal_behind"): Step("folding", (FOLD,)),
    ("exploring", "goal_ahead"): Step("approaching"),
    ("exploring", "goal_behind"): Step("folding", (FOLD,)),
    ("approaching", "goal_behind"): Step("folding", (FOLD,)),
    ("finding", "goal_ahead"): Step("approaching"),
    ("approaching", "reached"): Step("approaching"),
    ("exploring", "reached"): Step("exploring"),
    ("approaching", "arrived"): Step("arrived", (STOP_WAVE,)),
    ("finding", "arrived"): Step("arrived", (STOP_WAVE,)),
    ("arrived", "tick"): Step("ended"),
    ("closing", "unfolded"): Step("ended"),
    ("closing", "tick"): Step("closing", (UNFOLD,)),
    ("closing", "late"): Step("ended"),
}
# In any state, these events stop the wave and unfold the origami, and nothing folds it again.
_ENDINGS = {"stopped", "gut_ended", "fault", "cannot_arrive"}
EVENTS = sorted({event for _, event in _TABLE} | _ENDINGS)


@dataclass(frozen=True)
class Cycle:
    """The present state of the capsule in its cycle.

    Attributes
    ----------
    state : str
        One of `STATES`.
    retests : int
        Number of times that the present place was passed again.
    tries : int
        Number of times in a row that folding did not bring the capsule back.
    no_return : bool
        True after `MOST_TRIES` such tries: the survey goes on with single passes.
    """

    state: str = "starting"
    retests: int = 0
    tries: int = 0
    no_return: bool = False

    @property
    def over(self) -> bool:
        """True if the cycle has ended."""
        return self.state == "ended"


def after(cycle: Cycle, event: str) -> tuple[Cycle, tuple[str, ...]]:
    """Return the cycle after an event, and the commands for the boards.

    An event without an entry for the present state changes nothing.

    Raises
    ------
    KeyError
        There is no such event.
    """
    if event not in EVENTS:
        raise KeyError(event)
    if event in _ENDINGS:
        if cycle.state in ("closing", "ended"):
            return cycle, ()
        # The wave first: unfolding takes seconds, and with a stuck thread many.
        return replace(cycle, state="closing"), (STOP_WAVE, UNFOLD)
    step = _TABLE.get((cycle.state, event))
    if step is None:
        return cycle, ()
    cycle = _counted(cycle, event)
    # If folding does not bring the capsule back, it does not fold any more.
    in_vain = step.state == "folding" and cycle.no_return
    often = event == "again" and cycle.retests >= MOST_RETESTS
    if in_vain or often or (step.state == "passing" and cycle.retests > MOST_RETESTS):
        return replace(cycle, state="exploring"), ()  # the place is given up
    return replace(cycle, state=step.state), step.commands


def _counted(cycle: Cycle, event: str) -> Cycle:
    """Return the cycle with the counters of passes and tries after an event."""
    match event:
        case "suspected":
            return replace(cycle, retests=0)
        case "placed" if cycle.state == "finding":
            return replace(cycle, retests=cycle.retests + 1, tries=0)
        case "short" | "goal_ahead":
            return replace(cycle, tries=0)
        case "not_back":
            tries = cycle.tries + 1
            return replace(cycle, tries=tries, no_return=tries >= MOST_TRIES)
    return cycle
