"""The cycle with events in any order: folding needs feedback and a lease; few retests."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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


STEPS = st.one_of(
    st.sampled_from(EVENTS).map(lambda event: (event,)),
    # Events in their usual order reach late states.
    st.sampled_from(
        [TO_A_SUSPICION, THERE_AND_BACK, ("again",), ("not_back",), ("folded", "let_go")]
    ),
    st.integers(1, 10).map(lambda ticks: ticks * ("tick",)),
)


@settings(max_examples=200)
@given(st.lists(STEPS, min_size=20, max_size=40))
def test_any_events_in_any_order_fold_only_with_feedback_and_a_lease(steps):
    cycle, lease, passes, told_folded, over = Cycle(), 0, 0, False, False
    for event in itertools.chain(*steps):
        before, lease = cycle, max(lease - (event == "tick"), 0)
        cycle, commands = after(before, event)
        assert cycle.state in STATES
        if FOLD in commands:
            assert before.state not in ("returning", "closing", "ended")
            assert not before.no_return
            told_folded = False
        told_folded |= event == "folded" and before.state == "folding"
        assert told_folded or cycle.state != "returning"
        for command in commands:
            lease = {FOLD: LEASE, HOLD: LEASE, UNFOLD: 0}.get(command, lease)
        # Ticks renew the lease in the folded states, and nowhere else.
        is_folded = cycle.state in FOLDED_STATES
        assert (lease > 0) == (HOLD in after(cycle, "tick")[1]) == is_folded
        assert is_folded or before.state not in FOLDED_STATES or UNFOLD in commands
        if event == "suspected" and before.state == "exploring":
            passes = 0
        passes += cycle.state == "passing" and before.state != "passing"
        assert passes <= MOST_RETESTS
        # An end is an end: nothing folds the capsule, or moves it on, any more.
        over |= cycle.state in ("closing", "ended")
        assert not over or cycle.state in ("closing", "ended")
