"""The fold board's firmware in the emulator: its moves of the thread, and its faults."""

import binascii
import struct

import numpy as np
import pytest

from capsule.bench.protocol import Acknowledgement, FoldState, Identity, Refusal
from support.bench import emulated
from support.bench.emulated import EmulatedBoard, Talk
from support.bench.folding import SWITCH_TRAVEL, TRAVEL, FoldingOrigami

pytestmark = [pytest.mark.boards, emulated.needed]
DEBOUNCED = 6  # half-steps that the motor makes until a switch counts


@pytest.fixture
def fold():
    return Talk(emulated.FOLD, FoldingOrigami)


def of_kind(kind, events):
    return [event for event in events if isinstance(event, kind)]


def states(events):
    """Return the successive states in the frames of a board."""
    names = [report.state for report in of_kind(FoldState, events)]
    return [name for name, before in zip(names, [None, *names], strict=False) if name != before]


def answer(talk, command):
    """Send a command, and return the reason why the board refuses it, or its confirmation."""
    name = command.partition(",")[0]
    (answered,) = [event for event in talk.say(command) if getattr(event, "command", "") == name]
    return getattr(answered, "reason", answered)


def at_rest(talk):
    """Return state and switches of a board whose coils stay off, and whether it is unfolded."""
    before = talk.board.half_steps
    report = of_kind(FoldState, talk.wait(1) + talk.say("state"))[-1]
    assert (talk.board.coils, talk.board.half_steps) == (0, before)
    return report.state, report.switches, talk.world.wound < SWITCH_TRAVEL


UNFOLDED = "unfolded", "unfolded", True


def test_folds_holds_unfolds_and_says_where_it_is(fold):
    quiet = of_kind(FoldState, fold.wait(3))
    assert set(np.diff([report.device_ms for report in quiet])) == {1000}
    told_us = fold.now_us
    heard = fold.say("fold", 4)
    # What the board believes is what the thread did.
    last = of_kind(FoldState, fold.say("state", seconds=0.01))[-1]
    assert last.half_steps == pytest.approx(fold.world.wound, abs=DEBOUNCED)
    heard += fold.say("hold", 2)
    assert at_rest(fold) == ("folded", "folded", False)
    heard += fold.say("unfold", 7)
    assert at_rest(fold) == UNFOLDED
    assert states(heard) == ["folding", "folded", "unfolding", "unfolded"]
    assert not of_kind(Refusal, heard)
    busy = [report.device_ms for report in of_kind(FoldState, heard) if "fold" in report.state]
    assert max(np.diff(busy[:20])) <= 203
    # The coils first pull the rotor into its place; then it makes 400 half-steps a second.
    times_us = fold.board.seen.steps.times_us()
    assert times_us[0] - told_us > 50_000
    steps_us = np.diff(times_us)
    assert np.abs(steps_us[steps_us < 100_000] - 2500).max() < 50
    assert (fold.board.seen.illegal_steps, fold.board.seen.watchdog_resets) == (0, 0)


@pytest.mark.parametrize(
    ("mishap", "watched"),
    [(EmulatedBoard.reset, 0), (lambda board: board.hang(False), 1), (EmulatedBoard.stop_timer, 1)],
)
def test_a_board_that_starts_anew_unfolds(mishap, watched):
    talk = Talk(emulated.FOLD, lambda board: FoldingOrigami(board, TRAVEL))
    talk.wait(0.5)
    mishap(talk.board)
    (greeting,) = of_kind(Identity, talk.wait(0.35))  # the watchdog takes 0.25 s
    assert greeting.entries["state"] == "unfolding"
    assert int(greeting.entries["uptime_ms"]) < 20
    assert talk.board.seen.watchdog_resets == watched
    talk.wait(6)
    assert at_rest(talk) == UNFOLDED


def test_a_flood_of_questions_keeps_it_from_nothing(fold):
    fold.say("fold")
    fold.board.deliver(b"?\n" * 10_000)
    heard = fold.wait(2)
    assert len(of_kind(Identity, heard)) > 100
    assert fold.board.seen.watchdog_resets == 0
    assert states(heard) == ["folding"]
    assert np.diff([report.device_ms for report in of_kind(FoldState, heard)]).max() < 300


def newest(talk):
    """Return half-steps and ticks on of the newest record in the memory."""
    slots = [struct.unpack("<10sH", talk.board.eeprom[at : at + 12]) for at in (0, 16)]
    whole = [record for record, check in slots if binascii.crc_hqx(record, 0xFFFF) == check]
    return max(struct.unpack("<IiH", record) for record in whole)[1:]


def test_a_power_cut_leaves_a_whole_record_of_all_that_the_move_may_do(fold):
    fold.say("fold", seconds=0.06)
    assert newest(fold) == (0, 4000)
    fold.board.write_eeprom(16, b"\xff" * 5)  # as if the power had failed during this write
    fold.board.reset()
    (greeting,) = of_kind(Identity, fold.wait(0.1))
    assert (greeting.entries["setup"], newest(fold)) == ("yes", (0, 0))
    fold.say("fold", seconds=0.005)
    while fold.board.coils == 0:
        fold.wait(0.005)
    # Written before it moves; the motor may yet be on for 10 s.
    assert (fold.board.half_steps, *newest(fold)) == (0, 0, 4000)
    fold.wait(2)
    fold.board.reset()
    fold.wait(0.2)
    assert newest(fold) == (-4000, 8000)
    fold.wait(4)
    assert at_rest(fold) == UNFOLDED
    assert "the motor has to rest" in answer(fold, "fold")


def test_a_board_with_an_empty_memory_does_not_move_until_it_is_set_up(fold):
    fold.board.write_eeprom(0, b"\xff" * 32)
    fold.board.reset()
    heard = fold.wait(0.1)
    assert of_kind(Identity, heard)[0].entries["setup"] == "no"
    assert (states(heard), of_kind(Refusal, heard)) == (["fault"], [Refusal("fold", "not set up")])
    assert answer(fold, "fold") == answer(fold, "unfold") == "not set up"
    assert answer(fold, "setup,now") == "wants unfolded"
    fold.world.wound = TRAVEL / 2
    fold.wait(2)
    assert answer(fold, "setup,unfolded") == "the switch unfolded alone must be closed"
    assert fold.board.half_steps == 0
    fold.world.wound = 0
    fold.wait(0.1)
    assert answer(fold, "setup,unfolded") == Acknowledgement("setup", "unfolded")
    fold.wait(0.1)
    fold.board.reset()
    fold.wait(0.1)
    assert answer(fold, "fold") == Acknowledgement("fold", "")


def test_a_broken_wire_reads_as_closed_and_normally_open_switches_take_another_build(
    fold, tmp_path
):
    fold.board.break_wire(emulated.PIN_3)
    fold.wait(0.1)
    assert "both end switches are closed" in answer(fold, "fold")
    assert fold.board.half_steps == 0  # it does not pull
    emulated.build_firmware(tmp_path, "-DNORMALLY_CLOSED=0")
    talk = Talk(emulated.FOLD, FoldingOrigami, image=tmp_path / "fold.elf", normally_closed=False)
    assert answer(talk, "fold") == Acknowledgement("fold", "")
    assert states(talk.wait(6)) == ["folding", "folded", "unfolding"]
