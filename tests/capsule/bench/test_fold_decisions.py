"""Decisions of the fold board in any order of commands and faults: origami.c on this computer."""

import ctypes
import functools
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from support.bench import emulated
from support.bench.folding import SWITCH_TRAVEL, TRAVEL
from support.marks import needs_programs

pytestmark = [
    pytest.mark.takes(0.5),
    needs_programs("gcc", packages="gcc"),
]

STATES = ("unfolding", "unfolded", "folding", "folded", "fault")  # as origami.h numbers them
FREE, STUCK_OPEN, STUCK_CLOSED = range(3)
LEASE_S, LONGEST_S, FAULT_PAUSE_S = 5, 10, 0.5
LET_OUT = 8000  # half-steps that moves after faults and restarts may let out
RELEASE, SLACK = 500, 250  # half-steps, as docs/protocol.md has them
DEBOUNCED = 6  # half-steps that the motor makes until a switch counts
DUTY_S = 60


@functools.cache
def library():
    """Build a library of origami.c with a simulated thread, and load it."""
    fold = emulated.FIRMWARE / "fold"
    sources = (fold / "origami.c", Path(emulated.__file__).parent / "origami_host.c")
    options = (f"-I{fold}", f"-DTRAVEL={TRAVEL}", f"-DSWITCH_TRAVEL={SWITCH_TRAVEL}")
    loaded = emulated.build_host_library(*sources, options=options)
    loaded.bench_new.restype = ctypes.c_void_p
    loaded.bench_say.restype = loaded.bench_reason.restype = ctypes.c_char_p
    return loaded


class Bench:
    """The decisions of origami.c with a simulated thread and its switches."""

    def __init__(self, wound=0):
        self._bench = ctypes.c_void_p(library().bench_new(wound))

    def __getattr__(self, name):
        return functools.partial(getattr(library(), f"bench_{name}"), self._bench)

    def __del__(self):
        library().bench_free(self._bench)

    def wait(self, seconds):
        """Run for some time."""
        self.run(round(1000 * seconds))

    def name(self):
        """Return the name of the state."""
        return STATES[self.state()]

    def refusal(self, command):
        """Send a command; return why the board does not obey, or nothing."""
        return self.say(ctypes.c_char(command[0].encode())).decode()


def folding(seconds):
    """Start a board, and let it fold for this time; it is folded after 4.9 s."""
    bench = Bench()
    bench.wait(1)
    assert not bench.refusal("fold")
    bench.wait(seconds)
    return bench


def test_a_fold_and_its_unfolding_in_their_usual_times_and_what_is_refused_meanwhile():
    bench = folding(4.5)
    assert (bench.name(), bench.refusal("fold")) == ("folding", "")
    bench.refusal("hold")
    bench.wait(0.5)
    assert (bench.name(), bench.coils()) == ("folded", 0)
    before = bench.writes()
    assert not bench.refusal("unfold") and not bench.refusal("unfold")
    assert bench.refusal("fold") == "wait until the origami is unfolded"
    assert bench.refusal("hold") == "nothing is folded"
    bench.wait(5)
    assert (bench.name(), bench.coils(), bench.half_steps()) == ("unfolded", 0, 0)
    assert 0 <= bench.wound() < SWITCH_TRAVEL
    assert bench.refusal("hold") == "nothing is folded"
    assert not bench.refusal("unfold")
    assert bench.coils() == 0
    bench.wait(65)
    # Two slots of 100,000 writes each: 40,000 folds.
    assert bench.writes() - before <= 3


def test_the_wait_that_is_told_is_no_longer_than_needed_and_enough():
    bench = Bench()
    bench.wait(1)
    for _ in range(3):
        assert not bench.refusal("fold")
        bench.wait(4)
        bench.refusal("unfold")
        bench.wait(5)
        wait_s = bench.wait_s()
        assert 30 < wait_s < 60
        bench.wait(wait_s - 3)
        assert bench.refusal("fold") == "the motor has to rest"
        bench.wait(3)


OPEN, CLOSED = (0, STUCK_OPEN), (0, STUCK_CLOSED)


@pytest.mark.parametrize(
    ("seconds", "stuck", "command", "reason", "wound"),
    [
        # Both closed in a move: it stops at once.
        (2, [CLOSED, (1, STUCK_CLOSED)], "hold", "both end switches are closed", (778, 786)),
        # What was wound before the switch should have opened is let out.
        (
            0, [CLOSED], "hold", "the switch unfolded did not open or closed again",
            (0, RELEASE + 1),
        ),
        # Little more is let out than was wound.
        (
            4.9, [OPEN], "unfold", "the switch unfolded did not close where it should",
            (-SLACK - DEBOUNCED, -1),
        ),
    ],
)  # fmt: skip
def test_a_switch_that_sticks_stops_a_move_until_it_is_free(seconds, stuck, command, reason, wound):
    bench = folding(seconds)
    for switch, how in stuck:
        bench.stick(switch, how)
    bench.refusal(command)
    for _ in range(80):
        if bench.name() == "fault":
            break
        bench.wait(0.1)
    assert (bench.name(), bench.coils(), bench.reason().decode()) == ("fault", 0, reason)
    assert wound[0] <= bench.wound() <= wound[1]
    assert bench.refusal("fold") == bench.refusal("hold") == reason
    for switch, _ in stuck:
        bench.stick(switch, FREE)
    bench.wait(5)
    assert (bench.name(), bench.coils()) == ("unfolded", 0)


def test_switches_that_bounce_or_open_for_a_moment_are_no_fault():
    bench = folding(4.9)
    bench.refusal("hold")
    for how in 10 * (STUCK_OPEN, STUCK_CLOSED):
        bench.stick(1, how)
        bench.wait(0.005)
    bench.stick(1, STUCK_OPEN)
    bench.wait(0.8)
    bench.stick(1, FREE)
    bench.wait(2)
    assert bench.name() == "folded"


def duty(bench, seconds):
    """Run for some time with an `unfold` each second; return the share of it with the coils on."""
    on = 0
    for moment in range(round(10 * seconds)):
        if moment % 10 == 0:
            bench.refusal("unfold")
        bench.wait(0.1)
        on += bench.coils()
    return on / (10 * seconds)


# Kills: a bound or a duty that holds only after a restart.
@pytest.mark.parametrize("restart", [False, True], ids=["no restart", "restarts"])
def test_a_dead_switch_lets_out_no_more_than_two_moves_in_a_quarter_of_the_time(restart):
    bench = folding(4.9)
    bench.stick(0, STUCK_OPEN)
    bench.refusal("unfold")
    bench.wait(6)
    for minute in range(12):
        if restart and minute % 3 == 0:
            bench.reset()
        assert duty(bench, 60) <= 0.26
    assert -LET_OUT <= bench.lowest() < -LET_OUT + 500
    assert (bench.name(), bench.coils()) == ("fault", 0)
    assert bench.refusal("unfold").startswith("too much thread let out")
    assert bench.writes() < 50  # nor does it begin moves that it has to end at once


# Kills: a memory that is tried again and again, or that keeps a folded origami folded; moves that
# no count bounds, since the memory keeps none over the restarts.
@pytest.mark.parametrize("seconds", [0, 2, 4.9])
@pytest.mark.parametrize("switch", [STUCK_OPEN, FREE])
def test_a_memory_that_fails_is_tried_once_and_nothing_but_an_unfolding_moves(seconds, switch):
    bench = folding(seconds) if seconds else Bench()
    bench.damage_memory()
    if not seconds:
        bench.wait(1)
    before = bench.writes()
    bench.refusal("unfold" if seconds else "fold")
    bench.wait(5)
    assert (bench.name(), bench.coils()) == ("unfolded", 0)
    bench.wait(100)
    assert bench.refusal("fold") == "the memory cannot be written"
    assert bench.writes() == before + 1
    wound = bench.wound()
    assert wound < SWITCH_TRAVEL
    bench.stick(0, switch)
    for _ in range(20):
        bench.reset()
        bench.wait(1)
        bench.refusal("unfold")
        bench.wait(100)
        bench.refusal("fold")
    assert bench.wound() == wound


class AnyOrder(RuleBasedStateMachine):
    """A sequence of any commands and faults, in any order and at any time."""

    @initialize(wound=st.integers(0, TRAVEL))
    def start(self, wound):
        """Start the board with the origami in any position."""
        self.bench = Bench(wound)
        self.broken = False

    @rule(command=st.sampled_from(["fold", "hold", "unfold"]))
    def command(self, command):
        """Send a command, from the computer or from noise."""
        self.bench.refusal(command)

    @rule(milliseconds=st.integers(1, 12_000))
    def wait(self, milliseconds):
        """Run for some time."""
        self.bench.run(milliseconds)

    @rule()
    def fold_and_hold(self):
        """Fold and hold as a survey does."""
        self.bench.refusal("fold")
        for _ in range(3):
            self.bench.wait(4)
            self.bench.refusal("hold")

    @rule(switch=st.integers(0, 1), how=st.sampled_from([FREE, STUCK_OPEN, STUCK_CLOSED]))
    def stick(self, switch, how):
        """Make a switch stick, or free it."""
        self.bench.stick(switch, how)
        self.broken = self.broken or how != FREE

    @rule(stalled=st.booleans())
    def stall(self, stalled):
        """Make the motor stall, or free it."""
        self.bench.stall(int(stalled))
        self.broken = self.broken or stalled

    @rule()
    def silence(self):
        """Send nothing: with any fault, the board unfolds or reports a fault, and rests.

        Its tries use up what it may let out; the motor rests between them.
        """
        self.bench.wait(LEASE_S + 7 * (LONGEST_S + DUTY_S))
        assert self.bench.name() in ("unfolded", "fault")
        assert not self.bench.coils()

    @precondition(lambda self: not self.broken)
    @rule()
    def silence_of_a_whole_bench(self):
        """Send nothing: without any fault so far, the board unfolds, and not too far."""
        self.bench.wait(LEASE_S + LONGEST_S)
        assert self.bench.name() == "unfolded"
        assert -SWITCH_TRAVEL < self.bench.wound() < SWITCH_TRAVEL

    @rule()
    def repair(self):
        """Repair all faults: the board then unfolds on command, or by hand if it has given up."""
        self.bench.stick(0, FREE)
        self.bench.stick(1, FREE)
        self.bench.stall(0)
        for _ in range(3):  # after a stuck switch the board must first find that it is folded
            self.bench.wait(DUTY_S + 1)
            if self.bench.half_steps() <= -LET_OUT:
                self.bench.unfold_by_hand()
            else:
                assert not self.bench.refusal("unfold")
            self.bench.wait(LONGEST_S + 2 * FAULT_PAUSE_S)
        assert self.bench.name() == "unfolded"
        assert self.bench.wound() < SWITCH_TRAVEL

    @invariant()
    def nothing_forbidden_has_happened(self):
        """Check each move and the coils at rest.

        A move needs a lease and an open switch, and is short. At rest the coils are off.
        """
        if hasattr(self, "bench"):
            assert self.bench.forbidden() == 0
            assert self.bench.longest_move_ms() <= 1000 * LONGEST_S
            assert self.bench.half_steps() >= -LET_OUT


class TestAnyOrder(AnyOrder.TestCase):
    """The tests of `AnyOrder`."""

    settings = settings(max_examples=150, stateful_step_count=30, deadline=None)
