"""The fold board's firmware in the emulator: its moves of the thread, and its faults."""

import binascii
import math
import re
import struct
from pathlib import Path

import numpy as np
import pytest

from capsule.bench.protocol import Acknowledgement, FoldState, Identity, Refusal
from support.bench import emulated
from support.bench.emulated import Talk
from support.bench.folding import SWITCH_TRAVEL, TRAVEL, FoldingOrigami

pytestmark = [pytest.mark.boards, emulated.needed]

HALF_STEPS_PER_S = 400
HALF_STEPS_PER_TURN = 64 * (32 / 9) * (22 / 11) * (26 / 9) * (31 / 10)  # of a 28BYJ-48
DEBOUNCED = 6  # half-steps that the motor makes until a switch counts


def start(wound=0):
    """Start a board whose thread is wound by this many half-steps."""
    return Talk(emulated.FOLD, lambda board: FoldingOrigami(board, wound))


@pytest.fixture
def fold():
    return start()


def reports(events):
    return [event for event in events if isinstance(event, FoldState)]


def states(events):
    """Return the successive states in the frames of a board."""
    names = [report.state for report in reports(events)]
    return [name for name, before in zip(names, [None, *names], strict=False) if name != before]


def answer(talk, command):
    """Send a command, and return the answer."""
    (answered,) = [event for event in talk.say(command) if getattr(event, "command", "") == command]
    return answered


def state(talk):
    report = reports(talk.say("state"))[-1]
    return report.state, report.switches


def faults(events):
    """Return the reasons of the faults in the frames of a board."""
    return [event.reason for event in events if isinstance(event, Refusal)]


def newest(talk):
    """Return half-steps and ticks on of the newest record in the memory."""
    slots = [struct.unpack("<10sH", talk.board.eeprom[at : at + 12]) for at in (0, 16)]
    whole = [record for record, check in slots if binascii.crc_hqx(record, 0xFFFF) == check]
    return max(struct.unpack("<IiH", record) for record in whole)[1:]


def is_at_rest(talk):
    """Return whether the coils are off and the motor does not turn for 1 s."""
    before = talk.board.half_steps
    talk.wait(1)
    return talk.board.coils == 0 and talk.board.half_steps == before


def is_unfolded(talk):
    return talk.world.wound < SWITCH_TRAVEL and is_at_rest(talk)


def test_folds_holds_and_unfolds(fold):
    told_us = fold.now_us
    heard = fold.say("fold")
    for _ in range(5):
        heard += fold.wait(4) + fold.say("hold")
    assert fold.world.wound == pytest.approx(TRAVEL - SWITCH_TRAVEL, abs=2 * DEBOUNCED)
    assert is_at_rest(fold)
    heard += fold.say("unfold") + fold.wait(7)
    assert is_unfolded(fold)
    assert states(heard) == ["folding", "folded", "unfolding", "unfolded"]
    seen = {(report.state, report.switches) for report in reports(heard)}
    assert {("folding", "none"), ("folded", "folded"), ("unfolded", "unfolded")} <= seen
    assert not faults(heard)
    assert fold.board.seen.illegal_steps == 0
    # The coils first pull the rotor into its place.
    assert fold.board.seen.steps.times_us()[0] - told_us > 50_000
    within_moves_us = np.diff(fold.board.seen.steps.times_us())
    within_moves_us = within_moves_us[within_moves_us < 100_000]
    assert np.abs(within_moves_us - 1e6 / HALF_STEPS_PER_S).max() < 50
    assert fold.board.seen.watchdog_resets == 0


def test_says_where_it_is_five_times_a_second_and_once_at_rest(fold):
    (greeting, first) = fold.greeting
    told = {"protocol": "1", "firmware": "1.2", "lease_ms": "5000", "longest_ms": "10000"}
    told |= {"state": "unfolded", "setup": "yes", "uptime_ms": "12"}
    assert greeting == Identity("fold", told)
    assert (first.switches, first.state, first.half_steps) == ("unfolded", "unfolded", 0)
    quiet_ms = np.diff([report.device_ms for report in reports(fold.wait(5))])
    assert set(quiet_ms) == {1000}
    busy = reports(fold.say("fold") + fold.wait(4))
    assert np.diff([report.device_ms for report in busy]).max() <= 203
    # What the board believes is what the thread did.
    fold.wait(0.3)
    last = reports(fold.say("state", seconds=0.01))[-1]
    assert last.half_steps == pytest.approx(fold.world.wound, abs=DEBOUNCED)


@pytest.mark.parametrize(
    ("mishap", "settings"),
    [("reset", {}), ("hang", {"interrupts": False}), ("hang", {"interrupts": True}),
     ("stop_timer", {})],
)  # fmt: skip
def test_a_board_that_starts_anew_unfolds(mishap, settings):
    talk = start(TRAVEL)
    talk.wait(0.03)
    (greeting, first) = talk.greeting
    assert greeting.entries["state"] == first.state == "unfolding"
    talk.wait(0.5)
    getattr(talk.board, mishap)(**settings)
    heard = talk.wait(0.35)  # the watchdog takes 0.25 s
    (greeting,) = [event for event in heard if isinstance(event, Identity)]
    assert greeting.entries["state"] == "unfolding"
    assert int(greeting.entries["uptime_ms"]) < 20
    assert talk.board.seen.watchdog_resets == (mishap != "reset")
    talk.wait(6)
    assert is_unfolded(talk)
    assert state(talk) == ("unfolded", "unfolded")


def test_a_flood_of_questions_keeps_it_from_nothing(fold):
    fold.say("fold")
    fold.board.deliver(b"?\n" * 10_000)
    heard = fold.wait(2)
    assert len([event for event in heard if isinstance(event, Identity)]) > 100
    assert fold.board.seen.watchdog_resets == 0
    assert states(heard) == ["folding"]
    moments_ms = [report.device_ms for report in reports(heard)]
    assert np.diff(moments_ms).max() < 300


def test_a_power_cut_in_a_write_leaves_the_record_before(fold):
    fold.say("fold", seconds=0.06)
    assert newest(fold) == (0, 4000)
    fold.board.write_eeprom(16, b"\xff" * 5)  # as if the power had failed during this write
    fold.board.reset()
    (greeting,) = [event for event in fold.wait(0.05) if isinstance(event, Identity)]
    assert (greeting.entries["setup"], newest(fold)) == ("yes", (0, 0))


def test_a_power_cut_in_a_move_finds_the_whole_move_in_the_memory(fold):
    before = fold.board.eeprom
    fold.say("fold", seconds=0.005)
    while fold.board.coils == 0:
        fold.wait(0.005)
    assert (fold.board.eeprom != before, fold.board.half_steps) == (True, 0)
    fold.wait(2)
    assert newest(fold) == (0, 4000)  # the motor may yet be on for 10 s
    fold.board.reset()
    heard = fold.wait(0.05)
    assert states(heard) == ["unfolding"]  # told at once
    fold.wait(0.15)
    assert newest(fold) == (-4000, 8000)
    fold.wait(4)
    assert is_unfolded(fold)
    half_steps, on = newest(fold)
    assert half_steps <= 0
    assert 4000 < on < 6000
    assert "the motor has to rest" in answer(fold, "fold").reason
    fold.wait(62)
    assert newest(fold)[1] == 0
    assert answer(fold, "fold") == Acknowledgement("fold", "")


def test_a_board_with_an_empty_memory_does_not_move_until_it_is_set_up(fold):
    fold.board.write_eeprom(0, b"\xff" * 32)
    fold.board.reset()
    heard = fold.wait(0.1)
    (greeting,) = [event for event in heard if isinstance(event, Identity)]
    assert greeting.entries["setup"] == "no"
    assert states(heard) == ["fault"]
    assert faults(heard) == ["not set up"]
    assert answer(fold, "fold").reason == answer(fold, "unfold").reason == "not set up"
    fold.world.stuck["unfolded"] = False
    fold.wait(2)
    assert faults(fold.say("setup,unfolded")) == ["the switch unfolded alone must be closed"]
    assert fold.board.half_steps == 0
    fold.world.stuck.clear()
    fold.wait(0.1)
    assert "wants unfolded" in fold.say("setup,now")[0].reason
    assert fold.say("setup,unfolded")[0] == Acknowledgement("setup", "unfolded")
    fold.wait(0.1)
    fold.board.reset()
    fold.wait(0.1)
    assert state(fold) == ("unfolded", "unfolded")
    assert answer(fold, "fold") == Acknowledgement("fold", "")


def test_a_broken_wire_reads_as_closed_and_does_not_pull(fold):
    fold.board.break_wire(emulated.PIN_3)
    fold.wait(0.1)
    assert "both end switches are closed" in answer(fold, "fold").reason
    assert fold.board.half_steps == 0


def test_the_page_on_the_serial_line_has_the_firmwares_numbers():
    protocol = (Path(__file__).parents[3] / "docs/protocol.md").read_text(encoding="utf-8")
    header = (emulated.FIRMWARE / "fold" / "origami.h").read_text(encoding="utf-8")
    number = {name: int(value) for name, value in re.findall(r"#define (\w+) (\d+)\b", header)}
    per_s = 1e6 / number["TICK_US"]
    mm = math.pi * 10 / HALF_STEPS_PER_TURN  # of thread on the spool, a half-step
    move_s, longest_s = number["MOVE_MS"] / 1000, number["LONGEST_MS"] / 1000
    on_s, window_s = number["DUTY_ON_MS"] / 1000, number["DUTY_S"]
    release, slack = number["RELEASE_HALF_STEPS"], number["SLACK_HALF_STEPS"]
    for row in (
        f"| speed | {per_s:g} half-steps/s |",
        f"{move_s * per_s * mm:.1f} mm of thread in {move_s:g} s,",
        f"| longest move | {longest_s:g} s | {longest_s * per_s * mm:.1f} mm of thread |",
        f"| {release} half-steps | {release * mm:.1f} mm of thread |",
        f"| {slack} half-steps | {slack * mm:.1f} mm of thread |",
        f"| duty | {on_s:g} s in {window_s} s | {100 * on_s / window_s:.0f} %;",
        f"| lease | {number['LEASE_MS'] / 1000:g} s |",
    ):
        assert row in protocol, row
    assert per_s == HALF_STEPS_PER_S
    assert longest_s * per_s / HALF_STEPS_PER_TURN < 1  # "almost a turn"


def test_normally_open_switches_take_another_build(tmp_path):
    emulated.build_firmware(tmp_path, "-DNORMALLY_CLOSED=0")
    talk = Talk(emulated.FOLD, FoldingOrigami, image=tmp_path / "fold.elf", normally_closed=False)
    assert state(talk) == ("unfolded", "unfolded")
    assert answer(talk, "fold") == Acknowledgement("fold", "")
    talk.wait(6)
    assert is_unfolded(talk) is False
    talk.say("unfold")
    talk.wait(6)
    assert state(talk) == ("unfolded", "unfolded")
