"""Suspicion, decision and the way back, and the cycle with events in any order."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.survey import cycle as cycles
from capsule.survey.cycle import FOLD, HOLD, UNFOLD, Cycle, after
from capsule.survey.gut_evidence import GutEvidence
from capsule.survey.suspects import AdaptiveThreshold, Suspects, decide
from capsule.survey.way_back import WayBack

TO_A_SUSPICION = ("placed", "suspected", "passed")
THERE_AND_BACK = ("folded", "tick", "far_enough", "unfolded", "placed")
STEPS = st.one_of(
    st.sampled_from(cycles.EVENTS).map(lambda event: (event,)),
    # Events in their usual order reach late states.
    st.sampled_from([TO_A_SUSPICION, THERE_AND_BACK, ("again",), ("not_back",), 7 * ("tick",)]),
)


def test_what_passes_again_say():
    for outcome, *passes in (
        ("confirmed", [9.0, 9.0], [2.4, 1.5, 2.4], [2.3, 2.1, np.nan]),
        ("dismissed", [3.0, 0.5], [3.0, 1.2, 1.0]),
        ("again", [2.4, 1.5], [3.0, np.nan]),
        ("undecided", [2.4, 1.6, 1.7], [3.0, np.nan, 0.8]),
    ):
        assert [decide(heights) for heights in passes] == [outcome] * len(passes)


@pytest.mark.parametrize(("noise", "heavy"), [(0.5, False), (2.0, False), (0.5, True)])
def test_the_budget_is_kept_whatever_the_noise_and_its_tail(noise, heavy):
    numbers, suspicions = np.random.default_rng(1), 0
    for _ in range(5):
        adaptive = AdaptiveThreshold()
        off = 2 * numbers.standard_t(3, 200) if heavy else numbers.gumbel(size=200)
        for block, largest in enumerate(noise * (0.07 + 0.0166 * off)):
            if largest > adaptive.threshold:
                adaptive.suspected()
                suspicions += block >= 40
            adaptive.passed(25.0)
            adaptive.learn(largest)
    assert suspicions / (5 * 160 * 0.025) == pytest.approx(1.5, rel=0.3)  # in a metre


def test_a_suspicion_raises_the_threshold_until_it_proves_right():
    adaptive = AdaptiveThreshold()
    before = adaptive.threshold
    adaptive.suspected()
    adaptive.was_right()
    assert adaptive.threshold == pytest.approx(before)
    adaptive.passed(1000.0)
    # Once enough blocks are known, what a wrong prior did to the level is undone.
    for largest in np.linspace(0.2, 0.4, 20):
        adaptive.learn(largest)
    (median, scale), (usual, spread) = adaptive.usual, AdaptiveThreshold().usual
    assert (adaptive.threshold - median) / scale == pytest.approx((before - usual) / spread)


# Kills: a nodule that raises what is usual; gut that is suspected again after its pass.
def test_a_suspected_place_is_neither_usual_nor_suspected_again():
    places_mm, suspects = np.arange(100.0), Suspects(18.9)
    here, there = (np.abs(places_mm - at_mm) < 3 for at_mm in (50, 80))
    assert suspects.look(GutEvidence(places_mm, 0.2 * here), 60.0).first_mm == pytest.approx(50)
    for fix_mm in (70.0, 95.0, 120.0):
        suspects.look_closer(GutEvidence(places_mm, 9.0 * here), fix_mm)
    suspects.end_first_pass()
    suspects.close("dismissed")
    assert suspects.present.evidence == [9.0]
    assert suspects.threshold.usual[0] < 0.1
    assert suspects.look(GutEvidence(places_mm, 9.0 * there), 121.0) is None


def test_a_leg_is_short_enough_where_the_speed_was_badly_guessed():
    # A short leg says nothing of the speed: it may be the fastest one. Then, several of sixteen
    # waves did not push the capsule: it is more than twice as fast.
    for moved_mm, seconds, fastest_mm_s in ((-1.0, 6.4, -1.1), (-12.0, 51.2, -0.56)):
        back = WayBack(80.0, 3.2).learned(moved_mm, seconds)
        longest_s = back.longest_s()
        assert abs(fastest_mm_s * longest_s - back.expected_mm(longest_s)) < 40
    # The last leg counts most.
    assert back.learned(-48.0, 51.2).speed_mm_s < -30.0 / 51.2
    # Once the speed is known, chance alone, waves that do not push, leads it half a wave astray.
    astray_mm = 2.5 * 0.65 * 0.4 * np.sqrt(3.2 * WayBack(80.0, 3.2, 1e9, -4e8).longest_s())
    assert astray_mm == pytest.approx(38, rel=0.01)


@pytest.mark.parametrize("speed_mm_s", [-0.9, -0.4, -0.2, 0.3])
def test_no_leg_is_so_long_that_the_odometer_could_be_a_wavelength_off(speed_mm_s):
    back = WayBack(80.0, 3.2)
    assert back.leg_s(200.0) > 45  # the first one
    for _ in range(5):
        seconds = back.leg_s(200.0)
        moved_mm = speed_mm_s * seconds
        assert abs(moved_mm - back.expected_mm(seconds)) < 40
        back = back.learned(moved_mm, seconds)
    assert back.speed_mm_s == pytest.approx(speed_mm_s)
    assert back.went_back(moved_mm) == (speed_mm_s < 0)
    # Once the speed is known, one leg goes back by 30 mm; what does not go back is tried for 25 s.
    assert back.leg_s(30.0) == pytest.approx(30.0 / -speed_mm_s if speed_mm_s < 0 else 25.0)


def lead(*events):
    cycle, commands = Cycle(), []
    for event in events:
        cycle, given = after(cycle, event)
        commands += given
    return cycle, commands


# Kills: tries of different places that add up to a capsule that cannot go back.
def test_a_place_is_passed_again_twice_at_most_until_three_ways_back_in_a_row_lead_nowhere():
    once = (*TO_A_SUSPICION, *THERE_AND_BACK)
    assert lead(*once, "confirmed") == (Cycle("exploring", retests=1), [FOLD, HOLD, HOLD, UNFOLD])
    twice, _ = lead(*once, "again", *THERE_AND_BACK, "again")
    assert twice == Cycle("exploring", retests=cycles.MOST_RETESTS)
    assert after(twice, "suspected")[0].retests == 0
    # A board that lets the origami go is told so, too.
    for let_go in (("let_go",), ("folded", "let_go")):
        cycle, commands = lead(*TO_A_SUSPICION, *let_go)
        assert (cycle.state, commands[-1]) == ("unfolding", UNFOLD)
    there = ("folded", "far_enough", "unfolded", "not_back")
    cycle, commands = lead(*TO_A_SUSPICION, *there * cycles.MOST_TRIES)
    assert cycle == Cycle("exploring", tries=cycles.MOST_TRIES, no_return=True)
    assert commands.count(FOLD) == cycles.MOST_TRIES
    assert after(after(cycle, "suspected")[0], "passed") == (cycle, ())  # single passes from now on
    placed, _ = lead(*TO_A_SUSPICION, *there * 2, *THERE_AND_BACK)
    assert (placed.tries, placed.no_return) == (0, False)


@given(st.lists(STEPS, min_size=20, max_size=40))
def test_any_events_in_any_order_fold_only_with_feedback_and_a_lease(steps):
    lasts = 6  # ticks of a judgement, 0.8 s each: five seconds
    cycle, lease, passes, told_folded, over = Cycle(), 0, 0, False, False
    for event in itertools.chain(*steps):
        before, lease = cycle, max(lease - (event == "tick"), 0)
        cycle, commands = after(before, event)
        if FOLD in commands:
            assert before.state not in ("returning", "closing", "ended") and not before.no_return
            told_folded = False
        told_folded |= event == "folded" and before.state == "folding"
        assert told_folded or cycle.state != "returning"
        for command in commands:
            lease = {FOLD: lasts, HOLD: lasts, UNFOLD: 0}.get(command, lease)
        # Ticks renew the lease where the origami is folded, or may be folded, and nowhere else.
        was_folded, is_folded = (each.state in ("folding", "returning") for each in (before, cycle))
        assert (lease > 0) == (HOLD in after(cycle, "tick")[1]) == is_folded
        assert is_folded or not was_folded or UNFOLD in commands
        if event == "suspected" and before.state == "exploring":
            passes = 0
        passes += cycle.state == "passing" and before.state != "passing"
        assert passes <= cycles.MOST_RETESTS
        # An end is an end: nothing folds the capsule, or moves it on, any more.
        over |= cycle.state in ("closing", "ended")
        assert not over or cycle.state in ("closing", "ended")
