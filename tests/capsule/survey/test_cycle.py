"""The cycle with events in any order: folding needs feedback and a lease; few retests."""

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from capsule.survey.cycle import (
    EVENTS,
    FOLD,
    HOLD,
    MOST_RETESTS,
    MOST_TRIES,
    STATES,
    UNFOLD,
    Cycle,
    after,
)

pytestmark = pytest.mark.takes(0.3)

# In these states the origami is folded, or may be folded.
FOLDED_STATES = {"folding", "returning"}
LEASE = 6  # ticks of a judgement, 0.8 s each: five seconds


def lead(*events):
    cycle, commands = Cycle(), []
    for event in events:
        cycle, given = after(cycle, event)
        commands += given
    return cycle, commands


TO_A_SUSPICION = ("placed", "suspected", "passed")
THERE_AND_BACK = ("folded", "tick", "far_enough", "unfolded", "placed")


def test_a_place_is_passed_again_twice_at_most_and_the_next_one_as_often():
    cycle, commands = lead(*TO_A_SUSPICION, *THERE_AND_BACK, "confirmed")
    assert cycle == Cycle("exploring", retests=1)
    assert commands == [FOLD, HOLD, HOLD, UNFOLD]
    cycle, _ = lead(*TO_A_SUSPICION, *THERE_AND_BACK, "again", *THERE_AND_BACK, "again")
    assert cycle == Cycle("exploring", retests=MOST_RETESTS)
    assert after(cycle, "suspected")[0].retests == 0
    # A board that lets the origami go is told so, too.
    cycle, commands = lead(*TO_A_SUSPICION, "folded", "let_go")
    assert (cycle.state, commands[-1]) == ("unfolding", UNFOLD)


# Kills: tries of different places that add up to a capsule that cannot go back.
def test_after_three_ways_back_in_a_row_that_lead_nowhere_it_goes_on_with_single_passes():
    there = ("folded", "far_enough", "unfolded", "not_back")
    cycle, commands = lead(*TO_A_SUSPICION, *there * MOST_TRIES)
    assert cycle == Cycle("exploring", tries=MOST_TRIES, no_return=True)
    assert commands.count(FOLD) == MOST_TRIES
    assert after(after(cycle, "suspected")[0], "passed") == (cycle, ())
    placed = lead(*TO_A_SUSPICION, *there * 2, *THERE_AND_BACK)[0]
    assert (placed.tries, placed.no_return) == (0, False)


class Capsule(RuleBasedStateMachine):
    """A capsule with any events in any order, and a fold board that may lack feedback."""

    def __init__(self):
        super().__init__()
        self.cycle = Cycle()
        self.feedback_since_fold = False
        self.lease = 0
        self.retests_of_place = 0
        self.ended = False

    def happen(self, event):
        """Process an event and check the new state and the commands."""
        before = self.cycle
        self.cycle, commands = after(before, event)
        if FOLD in commands:
            assert before.state not in ("returning", "closing", "ended")
            assert not before.no_return
            self.feedback_since_fold = False
        if event == "folded" and before.state == "folding":
            self.feedback_since_fold = True
        if event == "suspected" and before.state == "exploring":
            self.retests_of_place = 0
        if self.cycle.state == "passing" and before.state != "passing":
            self.retests_of_place += 1
        for command in commands:
            self.lease = {FOLD: LEASE, HOLD: LEASE, UNFOLD: 0}.get(command, self.lease)
        # On leaving the folded states, the cycle sends a command to the board.
        if before.state in FOLDED_STATES and self.cycle.state not in FOLDED_STATES:
            assert UNFOLD in commands

    @rule(event=st.sampled_from(EVENTS))
    def anything(self, event):
        """Process any event, also one that makes no sense."""
        self.happen(event)

    @rule(
        path=st.sampled_from(
            [TO_A_SUSPICION, THERE_AND_BACK, ("again",), ("not_back",), ("folded", "let_go")]
        )
    )
    def usual(self, path):
        """Process events in their usual order, to reach late states."""
        for event in path:
            self.happen(event)

    @rule(ticks=st.integers(1, 10))
    def time_passes(self, ticks):
        """Process ticks of the pilot while the lease runs down."""
        for _ in range(ticks):
            self.lease = max(self.lease - 1, 0)
            self.happen("tick")

    @invariant()
    def state_is_known(self):
        """Check that no event leads to an unknown state."""
        assert self.cycle.state in STATES

    @invariant()
    def never_folded_without_feedback(self):
        """Check that the state is folded only after the board has reported it."""
        if self.cycle.state == "returning":
            assert self.feedback_since_fold

    @invariant()
    def never_folded_without_a_lease(self):
        """Check that ticks renew the lease in the folded states, and nowhere else."""
        if self.cycle.state in FOLDED_STATES:
            assert self.lease > 0
            assert HOLD in after(self.cycle, "tick")[1]
        else:
            assert self.lease == 0
            assert HOLD not in after(self.cycle, "tick")[1]

    @invariant()
    def never_more_passes_again_than_allowed(self):
        """Check the limit of passes, even if a place needs more."""
        assert self.retests_of_place <= MOST_RETESTS

    @invariant()
    def an_end_is_an_end(self):
        """Check that nothing folds a capsule after the survey has ended."""
        self.ended |= self.cycle.state in ("closing", "ended")
        if self.ended:
            assert self.cycle.state in ("closing", "ended")


Capsule.TestCase.settings = settings(max_examples=200, stateful_step_count=40, deadline=None)
TestCapsule = Capsule.TestCase
