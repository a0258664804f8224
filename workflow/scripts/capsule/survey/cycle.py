"""The capsule's cycle as a pure table: in a state, an event leads to a state and gives commands.

Unfolded, sense; suspect; finish the pass; fold; be pushed back; unfold; find the position again;
pass again; decide. Two counters stand beside the table: how often a place was passed again, and how
often in a row folding did not bring the capsule back.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

FOLD, UNFOLD, HOLD, STOP_WAVE = "fold", "unfold", "hold", "stop_wave"

MOST_RETESTS = 2
MOST_TRIES = 3


class Step(NamedTuple):
    """Where an event leads, and what the boards are told."""

    state: str
    commands: tuple[str, ...] = ()


# What is the origami's way to unfolded, and what it is to end in.
STATES = (
    "starting",
    "exploring",
    "finishing",
    "folding",
    "returning",
    "unfolding",
    "finding",
    "passing",
    "approaching",
    "arrived",
    "closing",
    "ended",
)
# In these the origami is not, or may not be, unfolded.
FOLDED_STATES = {"folding", "returning"}

_TABLE: dict[tuple[str, str], Step] = {
    ("starting", "placed"): Step("exploring"),
    ("exploring", "suspected"): Step("finishing"),
    ("finishing", "passed"): Step("folding", (FOLD,)),
    # The lease of a fold lasts no longer than the folding itself.
    ("folding", "tick"): Step("folding", (HOLD,)),
    ("folding", "folded"): Step("returning", (HOLD,)),
    ("folding", "late"): Step("unfolding", (UNFOLD,)),
    ("returning", "tick"): Step("returning", (HOLD,)),
    ("returning", "far_enough"): Step("unfolding", (UNFOLD,)),
    # The lease ran out, or the board was reset: it unfolds by itself and is told so once more.
    ("returning", "let_go"): Step("unfolding", (UNFOLD,)),
    ("folding", "let_go"): Step("unfolding", (UNFOLD,)),
    ("unfolding", "unfolded"): Step("finding"),
    ("unfolding", "late"): Step("closing", (UNFOLD,)),
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
    # On the way to a target nothing is suspected.
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
# Whatever happens meanwhile: the origami unfolds, and nothing folds it again.
_ENDINGS = {"stopped", "gut_ended", "fault", "cannot_arrive"}
EVENTS = sorted({event for _, event in _TABLE} | _ENDINGS)


@dataclass(frozen=True)
class Cycle:
    """Where the capsule is in its cycle.

    Attributes
    ----------
    state : str
        One of `STATES`.
    retests : int
        How often the present place was passed again.
    tries : int
        How often in a row folding did not bring the capsule back.
    no_return : bool
        It was too often: the survey goes on with single passes.
    """

    state: str = "starting"
    retests: int = 0
    tries: int = 0
    no_return: bool = False

    @property
    def over(self) -> bool:
        """Whether nothing more will happen."""
        return self.state == "ended"


def after(cycle: Cycle, event: str) -> tuple[Cycle, tuple[str, ...]]:
    """Return the cycle after an event, and the commands that it gives.

    An event that means nothing in a state changes nothing.

    Parameters
    ----------
    cycle : Cycle
        Before the event.
    event : str
        One of `EVENTS`.

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
        return replace(cycle, state="closing"), (UNFOLD,)
    step = _TABLE.get((cycle.state, event))
    if step is None:
        return cycle, ()
    cycle = _counted(cycle, event)
    if step.state == "folding" and cycle.no_return:
        # What would be folded for is given up.
        return replace(cycle, state="exploring"), ()
    if event == "again" and cycle.retests >= MOST_RETESTS:
        return replace(cycle, state="exploring"), ()
    if step.state == "passing" and cycle.retests > MOST_RETESTS:
        return replace(cycle, state="exploring"), ()
    return replace(cycle, state=step.state), step.commands


def _counted(cycle: Cycle, event: str) -> Cycle:
    """Count a pass or a try."""
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
