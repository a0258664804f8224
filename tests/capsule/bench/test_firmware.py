"""The boards' firmware in the emulator: samples, the wave's motor, the thread of the origami."""

import binascii
import ctypes
import re
import struct

import numpy as np
import pytest

from capsule.bench.protocol import Acknowledgement, FoldState, Identity, Position, Refusal, Sample
from support.bench import emulated
from support.bench.emulated import HALF_STEPS_PER_MM, EmulatedBoard, Talk
from support.bench.folding import SWITCH_TRAVEL, TRAVEL, FoldingOrigami
from support.documents import text_of

pytestmark = [pytest.mark.boards, emulated.needed]

HALF_STEPS_PER_WAVE = 80 * HALF_STEPS_PER_MM
UNFOLDED = "unfolded", "unfolded", True  # as `at_rest` tells it


@pytest.fixture
def motor():
    return Talk(emulated.PERISTALSIS)


@pytest.fixture
def fold():
    return Talk(emulated.FOLD, FoldingOrigami)


def of_kind(kind, events):
    return [event for event in events if isinstance(event, kind)]


def position(talk, after_s=0.0):
    talk.wait(after_s)
    (answer,) = of_kind(Position, talk.say("position"))
    return answer


def test_samples_at_exactly_ten_hertz_whatever_is_asked_and_sleeps_between():
    logger = Talk(emulated.LOGGER)
    logger.board.set_voltages(0, 2500, 4999, 5100)
    assert logger.say("start") == [Acknowledgement("start", "")]
    taken = of_kind(Sample, logger.wait(60))
    # To the processor's cycle: the timer starts the conversion.
    assert set(np.diff(logger.board.seen.samples.times_us())) == {100_000.0}
    assert [sample.device_ms for sample in taken] == list(range(100, 60_100, 100))
    assert [sample.sequence for sample in taken] == list(range(600))
    assert {sample.counts for sample in taken} == {(0, 512, 1023, 1023)}  # as of the silicon
    assert logger.board.seen.cycles_asleep > 0.95 * logger.board.seen.cycles
    for _ in range(200):
        logger.say("identify", seconds=0.0137)
    # An interrupt of the line may be under way when the timer's comes: some microseconds.
    assert np.abs(np.diff(logger.board.seen.samples.times_us()) - 100_000).max() < 20
    last = of_kind(Sample, logger.wait(0.3) + logger.say("pause"))[-1]
    assert not of_kind(Sample, logger.wait(2))
    assert of_kind(Sample, logger.say("start", 1))[0].sequence == last.sequence + 1


def test_the_end_stop_is_debounced_and_its_broken_wire_reads_as_pressed():
    logger, told = Talk(emulated.LOGGER), []
    logger.say("start")
    for act, *pressed in (("set_switch", True), ("set_switch", False), ("break_wire",)):
        getattr(logger.board, act)(emulated.END_STOP, *pressed)
        told += [sample.at_end for sample in of_kind(Sample, logger.wait(0.3))]
    assert (told[:2], told[2::3]) == ([False, True], [True, False, True])


@pytest.mark.parametrize("speed", ["", "0.5", "47.1"])
def test_the_wave_moves_at_its_speed_in_even_steps(motor, speed):
    if speed:
        assert motor.say(f"speed,{speed}") == [Acknowledgement("speed", speed)]
    motor.say("start", 5)
    first = position(motor)
    second = position(motor, after_s=32)
    elapsed_s, wanted = (second.device_ms - first.device_ms) / 1000, float(speed or 25)
    way_mm = second.position_mm - first.position_mm
    assert way_mm / elapsed_s == pytest.approx(wanted, rel=1e-4, abs=0.01)
    # What the board believes is what the rotor did.
    assert motor.board.seen.illegal_steps == 0
    assert second.half_steps == pytest.approx(motor.board.half_steps, abs=30)
    assert second.position_mm == pytest.approx(second.half_steps / HALF_STEPS_PER_MM, abs=0.001)
    steady = 1e6 / np.diff(motor.board.seen.steps.times_us()[-200:])
    assert steady.mean() == pytest.approx(wanted * HALF_STEPS_PER_MM, rel=1e-3)
    # Two ticks of the timer and an interrupt that has to wait.
    assert steady.max() / steady.min() < 1.02


def test_it_starts_stops_and_turns_round_by_its_ramp_and_lets_the_coils_cool(motor):
    motor.say("ramp,10")
    motor.say("start", 4)
    times_us = motor.board.seen.steps.times_us()
    speeds = 1e6 / np.diff(times_us) / HALF_STEPS_PER_MM
    rising = (speeds > 5) & (speeds < 24)
    slope = np.polyfit(times_us[1:][rising] / 1e6, speeds[rising], 1)[0]
    assert slope == pytest.approx(10, rel=0.05)
    assert speeds[0] < 4
    forward = motor.board.half_steps
    motor.say("direction,backward", 8)
    assert position(motor).speed_mm_s == pytest.approx(-25, abs=0.01)
    assert motor.board.half_steps < forward
    assert np.diff(motor.board.seen.steps.times_us()).min() > 1e6 / HALF_STEPS_PER_MM / 25.8
    motor.say("stop", seconds=0.1)
    assert position(motor).state == "stopping"
    at_rest = position(motor, after_s=4)
    assert (at_rest.state, at_rest.speed_mm_s, motor.board.coils) == ("stopped", 0, 0)
    assert at_rest.half_steps == motor.board.half_steps
    assert motor.board.seen.illegal_steps == 0


# Kills: a position of 32 bits, which runs backward after a day.
def test_the_boards_position_is_that_of_its_half_steps_for_as_long_as_it_counts_them():
    gearing = emulated.build_host_library(emulated.FIRMWARE / "peristalsis" / "gearing.c")
    gearing.wave_um.restype = ctypes.c_int64
    for steps in (1, -1, 36_000_000, -40_000_000, 2**31 - 1, 1 - 2**31):
        assert abs(gearing.wave_um(steps, 1) - 1000 * steps / HALF_STEPS_PER_MM) <= 1


def test_a_lease_that_nobody_renews_stops_the_wave(motor):
    for command in ("lease,2", "lease,0", "ramp,50", "start"):
        motor.say(command)
    motor.wait(10)
    assert motor.say("lease,2") == [Acknowledgement("lease", "2")]
    for command in ("position", "identify", "speed,20", "speed,99", "start"):  # even if refused
        assert position(motor, after_s=1.8).state == "running"
        motor.wait(1.8)
        motor.say(command)
    motor.wait(1.8)
    motor.board.deliver(b"$position*0000\n")  # damaged, it renews nothing
    assert position(motor, after_s=0.3).state == "stopping"
    assert (position(motor, after_s=2).state, motor.board.coils) == ("stopped", 0)


@pytest.mark.parametrize(
    ("lease_s", "fault", "moves_s", "resets"),
    [
        # A board that hears nothing stops after a minute.
        (60, lambda board: None, 58, 0),
        # The watchdog restarts the board once; at rest it is fed.
        (0, lambda board: board.hang(interrupts=True), 0, 1),
        (0, lambda board: board.hang(interrupts=False), 0, 1),
        (0, EmulatedBoard.stop_timer, 0, 1),
        (2, lambda board: board.hang(interrupts=True, feeds_watchdog=True), 0.8, 0),
    ],
    ids=["nothing heard", "hangs", "hangs uninterrupted", "timer fails", "hangs and feeds"],
)
def test_a_board_without_its_computer_or_program_stops(motor, lease_s, fault, moves_s, resets):
    if lease_s != 60:  # which it has
        motor.say(f"lease,{lease_s}")
    motor.say("start", 1)
    fault(motor.board)
    motor.wait(moves_s)
    assert motor.board.coils
    for seconds in (0.6 if resets else 3, 3):
        motor.wait(seconds)
        assert (motor.board.seen.watchdog_resets, motor.board.coils) == (resets, 0)


# Backward, the same edge of the cam counts.
def test_the_index_tells_the_phase_again_after_a_reset_in_both_directions(motor):
    motor.board.set_cam(HALF_STEPS_PER_WAVE, -20, 120.0)
    motor.say("start", 2)
    assert position(motor).index_half_steps is None  # it started there
    for resets, direction, seconds in ((0, "forward", 6), (1, "forward", 4), (0, "backward", 6)):
        if resets:
            motor.board.reset()
            (identity,) = motor.wait(0.05)
            assert identity.entries["index"] == "none"
            assert (position(motor).half_steps, position(motor).index_half_steps) == (0, None)
        motor.say(f"direction,{direction}")
        motor.say("start", seconds)
        motor.say("stop", 1.5)
        where = position(motor)
        since = where.half_steps - where.index_half_steps
        assert abs(since) <= HALF_STEPS_PER_WAVE
        off = (since - (motor.board.half_steps + 20)) % HALF_STEPS_PER_WAVE
        assert min(off, HALF_STEPS_PER_WAVE - off) <= 1
        (identity,) = motor.say("identify")
        assert identity.entries["index"] == str(where.index_half_steps)


def test_the_index_is_passed_where_its_switch_first_closes_and_not_at_a_spike(motor):
    motor.say("start", 1)
    # A spike, and a switch that bounces.
    for contacts in ([True, False], [True, False, True, False, True]):
        first = motor.board.half_steps
        for closed in contacts:
            motor.board.set_switch(emulated.PIN_3, closed)
            motor.wait(0.005)
        passed = pytest.approx(first, abs=1) if contacts[-1] else None
        assert position(motor, after_s=0.2).index_half_steps == passed


def states(events):
    """Return the successive states in the frames of a board."""
    names = [report.state for report in of_kind(FoldState, events)]
    return [name for name, before in zip(names, [None, *names], strict=False) if name != before]


def answer(talk, command, after_s=0.0):
    """Send a command, and return the reason why the board refuses it, or its confirmation."""
    talk.wait(after_s)
    name = command.partition(",")[0]
    (answered,) = [event for event in talk.say(command) if getattr(event, "command", "") == name]
    return getattr(answered, "reason", answered)


def at_rest(talk, after_s=0.0):
    """Return state and switches of a board whose coils stay off, and whether it is unfolded."""
    talk.wait(after_s)
    before = talk.board.half_steps
    report = of_kind(FoldState, talk.wait(1) + talk.say("state"))[-1]
    assert (talk.board.coils, talk.board.half_steps) == (0, before)
    return report.state, report.switches, talk.world.wound < SWITCH_TRAVEL


def test_folds_holds_unfolds_and_says_where_it_is(fold):
    quiet = of_kind(FoldState, fold.wait(3))
    assert set(np.diff([report.device_ms for report in quiet])) == {1000}
    told_us = fold.now_us
    heard = fold.say("fold", 4)
    # What the board believes is what the thread did, until a switch counts.
    last = of_kind(FoldState, fold.say("state", seconds=0.01))[-1]
    assert last.half_steps == pytest.approx(fold.world.wound, abs=6)
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
    assert at_rest(talk, after_s=6) == UNFOLDED


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
    fold.say("fold", seconds=0.005)
    while fold.board.coils == 0:
        fold.wait(0.005)
    # Written before it moves; the motor may yet be on for 10 s.
    assert (fold.board.half_steps, *newest(fold)) == (0, 0, 4000)
    fold.board.write_eeprom(16, b"\xff" * 5)  # as if the power had failed during this write
    fold.board.reset()
    (greeting,) = of_kind(Identity, fold.wait(0.1))
    assert (greeting.entries["setup"], newest(fold)) == ("yes", (0, 0))
    fold.say("fold", seconds=2.1)
    fold.board.reset()
    fold.wait(0.2)
    assert newest(fold) == (-4000, 8000)
    assert at_rest(fold, after_s=4) == UNFOLDED
    assert "the motor has to rest" in answer(fold, "fold")


def test_a_board_with_an_empty_memory_does_not_move_until_it_is_set_up(fold):
    fold.board.write_eeprom(0, b"\xff" * 32)
    fold.board.reset()
    heard = fold.wait(0.1)
    assert of_kind(Identity, heard)[0].entries["setup"] == "no"
    assert (states(heard), of_kind(Refusal, heard)) == (["fault"], [Refusal("fold", "not set up")])
    assert answer(fold, "fold") == answer(fold, "unfold") == "not set up"
    assert answer(fold, "setup,now") == "wants unfolded"
    must, done = "the switch unfolded alone must be closed", Acknowledgement("setup", "unfolded")
    for wound, said in ((TRAVEL / 2, must), (0, done)):
        fold.world.wound = wound
        assert (answer(fold, "setup,unfolded", after_s=2), fold.board.half_steps) == (said, 0)
    fold.board.reset()
    assert answer(fold, "fold", after_s=0.1) == Acknowledgement("fold", "")


def test_a_broken_wire_reads_as_closed_but_with_the_build_for_open_switches(fold, tmp_path):
    fold.board.break_wire(emulated.PIN_3)
    assert "both end switches are closed" in answer(fold, "fold", after_s=0.1)
    assert fold.board.half_steps == 0  # it does not pull
    emulated.build_firmware(tmp_path, "-DNORMALLY_CLOSED=0")
    talk = Talk(emulated.FOLD, FoldingOrigami, image=tmp_path / "fold.elf", normally_closed=False)
    assert answer(talk, "fold") == Acknowledgement("fold", "")
    assert states(talk.wait(6)) == ["folding", "folded", "unfolding"]


def test_the_pages_have_the_firmwares_numbers():
    headers = [emulated.FIRMWARE / name for name in ("peristalsis/motion.h", "fold/origami.h")]
    text = "".join(header.read_text("utf-8") for header in headers)
    defined = re.findall(r"#define (\w+) \(?([\dL* ]+?)\)?(?: */\*.*)?\n", text)
    has = {name: eval(value.replace("L", ""), {}) for name, value in defined}
    per_turn = has["HALF_STEPS_PER_TURN_NUMERATOR"] / has["HALF_STEPS_PER_TURN_DENOMINATOR"]
    wave_mm, on_s = has["WAVELENGTH_UM"] / 1000, has["DUTY_ON_MS"] / 1000
    per_s = 1e6 / has["TICK_US"]
    per_mm = per_turn / (has["WAVES_PER_MOTOR_TURN"] * wave_mm)
    assert per_mm == pytest.approx(HALF_STEPS_PER_MM)
    longest_s, mm = has["LONGEST_MS"] / 1000, np.pi * 10 / per_turn
    release, slack = has["RELEASE_HALF_STEPS"], has["SLACK_HALF_STEPS"]
    told = [
        f"half-steps a turn of the motor's shaft | {per_turn:.2f}",
        f"cam shaft | {wave_mm:g} mm a turn",
        f"half-steps a mm of the wave | {per_mm:.2f}",
        f"half-steps a second at 25 mm/s | {25 * per_mm:.0f}",
        f"half-steps a second at most | {has['MAX_RATE']}",
        f"ramp | {has['DEFAULT_RAMP_UM_S2'] / 1000:g} mm/s²",
        f"speed | {per_s:g} half-steps/s",
        f"duty | {on_s:g} s in {has['DUTY_S']} s | {100 * on_s / has['DUTY_S']:.0f} %",
        f"lease | {has['LEASE_MS'] / 1000:g} s",
        f"{release} half-steps | {release * mm:.1f} mm of thread",
        f"{slack} half-steps | {slack * mm:.1f} mm of thread",
        f"{longest_s:g} s | {longest_s * per_s * mm:.1f} mm of thread",
    ]
    pages = text_of("docs/bench.md") + text_of("docs/protocol.md")
    assert not [statement for statement in told if f"| {statement}" not in pages]
