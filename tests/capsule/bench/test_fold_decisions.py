"""Decisions of the fold board in any order of commands and faults: origami.c on this computer."""

import ctypes
import functools

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from support.bench import emulated
from support.bench.folding import SWITCH_TRAVEL, TRAVEL
from support.marks import needs_programs

pytestmark = [pytest.mark.takes(0.5), needs_programs("gcc", packages="gcc")]

STATES = ("unfolding", "unfolded", "folding", "folded", "fault")  # as origami.h numbers them
FREE, STUCK_OPEN, STUCK_CLOSED = range(3)
BOTH = [(0, STUCK_CLOSED), (1, STUCK_CLOSED)]
COMMANDS = st.sampled_from([["fold"], ["hold"], ["unfold"], ["fold", "hold", "hold"]])
LEASE_S, LONGEST_S, FAULT_PAUSE_S = 5, 10, 0.5
LET_OUT = 8000  # half-steps that moves after faults and restarts may let out
DUTY_S = 60


@functools.cache
def library():
    """Build a library of origami.c with a simulated thread, and load it."""
    fold = emulated.FIRMWARE / "fold"
    sources = (fold / "origami.c", emulated.HERE / "origami_host.c")
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

    def wait(self, seconds):
        """Run for some time, and return name of the state and coils."""
        self.run(round(1000 * seconds))
        return STATES[self.state()], self.coils()

    def refusal(self, command, after_s=0):
        """Send a command after some time; return why the board does not obey, or nothing."""
        self.wait(after_s)
        return self.say(ctypes.c_char(command[0].encode())).decode()


def folding(seconds):
    """Start a board, and let it fold for this time; it is folded after 4.9 s."""
    bench = Bench()
    assert not bench.refusal("fold", after_s=1)
    bench.wait(seconds)
    return bench


def test_a_fold_and_its_unfolding_in_their_usual_times():
    bench = folding(0)
    assert bench.refusal("setup") == "the origami moves or is folded"
    assert (bench.wait(4.5), bench.refusal("fold")) == (("folding", 1), "")
    bench.refusal("hold")
    assert bench.wait(0.5) == ("folded", 0)
    # A switch that bounces, or opens for a moment, is no fault.
    for how, seconds in (*10 * ((STUCK_OPEN, 0.005), (STUCK_CLOSED, 0.005)), (STUCK_OPEN, 0.8)):
        bench.stick(1, how)
        bench.wait(seconds)
    bench.stick(1, FREE)
    assert bench.wait(2) == ("folded", 0)
    before = bench.writes()
    assert not bench.refusal("unfold") and not bench.refusal("unfold")
    assert (*bench.wait(5), bench.half_steps()) == ("unfolded", 0, 0)
    assert 0 <= bench.wound() < SWITCH_TRAVEL
    assert (bench.refusal("unfold"), bench.coils()) == ("", 0)
    bench.wait(65)
    # Two slots of 100,000 writes each: 40,000 folds.
    assert bench.writes() - before <= 3


def test_the_wait_that_is_told_is_no_longer_than_needed_and_enough():
    bench = folding(0)
    for _ in range(3):
        bench.refusal("unfold", after_s=4)
        bench.wait(5)
        wait_s = bench.wait_s()
        assert 30 < wait_s < 60
        assert bench.refusal("fold", after_s=wait_s - 3) == "the motor has to rest"
        assert not bench.refusal("fold", after_s=3)


@pytest.mark.parametrize(
    ("seconds", "stuck", "command", "reason", "wound"),
    [
        # Both closed in a move: it stops at once.
        (2, BOTH, "hold", "both end switches are closed", (778, 786)),
        # What was wound before the switch should have opened, 500 half-steps, is let out.
        (0, BOTH[:1], "hold", "the switch unfolded did not open", (0, 501)),
        # 250 half-steps more are let out than were wound, and until a switch counts.
        (4.9, [(0, STUCK_OPEN)], "unfold", "the switch unfolded did not close", (-256, -1)),
        (4.9, [(1, STUCK_CLOSED)], "unfold", "the switch folded did not open", (1300, 1400)),
    ],
)
def test_a_switch_that_sticks_stops_a_move_until_it_is_free(seconds, stuck, command, reason, wound):
    bench = folding(seconds)
    for switch, how in stuck:
        bench.stick(switch, how)
    bench.refusal(command)
    while bench.wait(0.1)[0] != "fault":
        pass
    assert not bench.coils() and bench.reason().decode().startswith(reason)
    assert wound[0] <= bench.wound() <= wound[1]
    assert bench.refusal("fold") == bench.refusal("hold") == bench.reason().decode()
    for switch, _ in stuck:
        bench.stick(switch, FREE)
    assert bench.wait(5) == ("unfolded", 0)


# Kills: a bound or a duty that holds only after a restart.
@pytest.mark.parametrize("restarts", [False, True])
def test_a_dead_switch_lets_out_no_more_than_two_moves_in_a_quarter_of_the_time(restarts):
    bench = folding(4.9)
    bench.stick(0, STUCK_OPEN)
    bench.refusal("unfold")
    bench.wait(6)
    for minute in range(12):
        if restarts and minute % 3 == 0:
            bench.reset()
        on = 0
        for tenth in range(600):
            if tenth % 10 == 0:
                bench.refusal("unfold")
            on += bench.wait(0.1)[1]
        assert on <= 0.26 * 600
    assert -LET_OUT <= bench.lowest() < -LET_OUT + 500
    assert bench.wait(0) == ("fault", 0)
    assert bench.refusal("unfold").startswith("too much thread let out")
    assert bench.writes() < 50  # nor does it begin moves that it has to end at once


# Kills: a memory that is tried again and again, or that keeps a folded origami folded; moves that
# no count bounds, since the memory keeps none over the restarts.
@pytest.mark.parametrize("seconds", [0, 2, 4.9])
@pytest.mark.parametrize("switch", [STUCK_OPEN, FREE])
def test_a_memory_that_fails_is_tried_once_and_nothing_but_an_unfolding_moves(seconds, switch):
    bench = folding(seconds) if seconds else Bench()
    bench.damage_memory()
    bench.wait(0 if seconds else 1)
    before = bench.writes()
    bench.refusal("unfold" if seconds else "fold")
    assert bench.wait(5) == ("unfolded", 0)
    assert bench.refusal("fold", after_s=100) == "the memory cannot be written"
    assert bench.writes() == before + 1
    wound = bench.wound()
    assert wound < SWITCH_TRAVEL
    bench.stick(0, switch)
    for _ in range(20):
        bench.reset()
        bench.refusal("unfold", after_s=1)
        bench.refusal("fold", after_s=100)
    assert bench.wound() == wound


class AnyOrder(RuleBasedStateMachine):
    """A sequence of any commands and faults, in any order and at any time."""

    @initialize(wound=st.integers(0, TRAVEL))
    def start(self, wound):
        """Start the board with the origami in any position."""
        self.bench, self.broken = Bench(wound), False

    @rule(commands=COMMANDS, ms=st.integers(0, 12_000))
    def command(self, commands, ms):
        """Send commands, from noise or as in a survey, and run for some time after each."""
        for command in commands:
            self.bench.refusal(command)
            self.bench.run(ms)

    @rule(switch=st.integers(0, 1), how=st.integers(FREE, STUCK_CLOSED), stalled=st.booleans())
    def stick(self, switch, how, stalled):
        """Make a switch stick and the motor stall, or free them."""
        self.bench.stick(switch, how)
        self.bench.stall(int(stalled))
        self.broken = self.broken or stalled or how != FREE

    @rule()
    def silence(self):
        """Send nothing: the board unfolds, and not too far; or, with a fault so far, reports one.

        Its tries use up what it may let out; the motor rests between them.
        """
        tries = 7 * (LONGEST_S + DUTY_S) if self.broken else LONGEST_S
        state, coils = self.bench.wait(LEASE_S + tries)
        assert (state == "unfolded" or (self.broken and state == "fault")) and not coils
        assert self.broken or -SWITCH_TRAVEL < self.bench.wound() < SWITCH_TRAVEL

    @rule()
    def repair(self):
        """Repair all faults: the board then unfolds on command, or by hand if it has given up."""
        for switch in (0, 1):
            self.bench.stick(switch, FREE)
        self.bench.stall(0)
        for _ in range(3):  # after a stuck switch the board must first find that it is folded
            self.bench.wait(DUTY_S + 1)
            if self.bench.half_steps() <= -LET_OUT:
                self.bench.unfold_by_hand()
            else:
                assert not self.bench.refusal("unfold")
            state, _ = self.bench.wait(LONGEST_S + 2 * FAULT_PAUSE_S)
        assert state == "unfolded"
        assert self.bench.wound() < SWITCH_TRAVEL

    @invariant()
    def nothing_forbidden_has_happened(self):
        """Check that no tick has broken a rule; the bits of origami_host.c tell which."""
        assert self.bench.forbidden() == 0


TestAnyOrder = AnyOrder.TestCase
TestAnyOrder.settings = settings(max_examples=60, stateful_step_count=25, deadline=None)
