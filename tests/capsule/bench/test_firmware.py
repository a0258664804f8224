"""The firmware of logger and wave on emulated boards: times of samples, sleep, and motor steps."""

import ctypes
import re
from pathlib import Path

import numpy as np
import pytest

from capsule.bench.protocol import Acknowledgement, Position, Sample, encode
from support.bench import emulated
from support.bench.emulated import HALF_STEPS_PER_MM, EmulatedBoard, Talk

pytestmark = [pytest.mark.boards, emulated.needed]
DOCS = Path(__file__).parents[3] / "docs"


@pytest.fixture
def motor():
    return Talk(emulated.PERISTALSIS)


def samples(events):
    return [event for event in events if isinstance(event, Sample)]


def test_samples_at_exactly_ten_hertz_whatever_is_asked_and_sleeps_between():
    logger = Talk(emulated.LOGGER)
    logger.board.set_voltages([0, 2500, 4999, 5100], [0, 2500, 4999, 5100])
    assert logger.say("start") == [Acknowledgement("start", "")]
    taken = samples(logger.wait(60))
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
    last = samples(logger.wait(0.3) + logger.say("pause"))[-1]
    assert not samples(logger.wait(2))
    assert samples(logger.say("start", 1))[0].sequence == last.sequence + 1


def test_the_end_stop_is_debounced_and_its_broken_wire_reads_as_pressed():
    logger, told = Talk(emulated.LOGGER), []
    set_switch, break_wire = logger.board.set_switch, logger.board.break_wire
    logger.say("start")
    for act, *how in ((set_switch, True), (set_switch, False), (break_wire,)):
        act(emulated.END_STOP, *how)
        told += [sample.at_end for sample in samples(logger.wait(0.3))]
    assert (told[:2], told[2::3]) == ([False, True], [True, False, True])


def position(talk):
    (answer,) = [event for event in talk.say("position") if isinstance(event, Position)]
    return answer


@pytest.mark.parametrize("speed", ["", "0.5", "47.1"])
def test_the_wave_moves_at_its_speed_in_even_steps(motor, speed):
    if speed:
        assert motor.say(f"speed,{speed}") == [Acknowledgement("speed", speed)]
    motor.say("start", 5)
    first = position(motor)
    motor.wait(32)
    second = position(motor)
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
    motor.wait(4)
    at_rest = position(motor)
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
        motor.wait(1.8)
        assert position(motor).state == "running"
        motor.wait(1.8)
        motor.say(command)
    motor.wait(1.8)
    motor.board.deliver(encode("position").replace(b"n*", b"m*"))  # damaged, it renews nothing
    motor.wait(0.3)
    assert position(motor).state == "stopping"
    motor.wait(2)
    assert (position(motor).state, motor.board.coils) == ("stopped", 0)


@pytest.mark.parametrize(
    ("lease", "fault", "moves_s", "resets"),
    [
        # A board that hears nothing stops after a minute.
        ("", lambda board: None, 58, 0),
        # The watchdog restarts the board once; at rest it is fed.
        ("lease,0", lambda board: board.hang(interrupts=True), 0, 1),
        ("lease,0", lambda board: board.hang(interrupts=False), 0, 1),
        ("lease,0", EmulatedBoard.stop_timer, 0, 1),
        ("lease,2", lambda board: board.hang(interrupts=True, feeds_watchdog=True), 0.8, 0),
    ],
    ids=["nothing heard", "hangs", "hangs uninterrupted", "timer fails", "hangs and feeds"],
)
def test_a_board_without_its_computer_or_program_stops_by_itself(
    motor, lease, fault, moves_s, resets
):
    if lease:
        motor.say(lease)
    motor.say("start", 1)
    fault(motor.board)
    motor.wait(moves_s)
    assert motor.board.coils
    for seconds in (0.6 if resets else 3, 3):
        motor.wait(seconds)
        assert (motor.board.seen.watchdog_resets, motor.board.coils) == (resets, 0)


HALF_STEPS_PER_WAVE = 80 * HALF_STEPS_PER_MM
INDEX_CLOSED = 120.0  # half-steps for which the cam closes its switch


# Backward, the same edge of the cam counts.
def test_the_index_tells_the_phase_again_after_a_reset_in_both_directions(motor):
    motor.board.set_cam(HALF_STEPS_PER_WAVE, 300.3, INDEX_CLOSED)
    assert position(motor).index_half_steps is None
    for resets, direction, seconds in ((0, "forward", 8), (1, "forward", 4), (0, "backward", 6)):
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
        off = (since - (motor.board.half_steps - 300.3)) % HALF_STEPS_PER_WAVE
        assert min(off, HALF_STEPS_PER_WAVE - off) <= 1
        (identity,) = motor.say("identify")
        assert identity.entries["index"] == str(where.index_half_steps)


def test_the_index_is_passed_where_its_switch_first_closes_after_it_was_open(motor):
    motor.board.set_cam(HALF_STEPS_PER_WAVE, -20, INDEX_CLOSED)
    motor.say("start", 2)
    assert position(motor).index_half_steps is None  # it started there
    motor.wait(2)
    assert position(motor).index_half_steps == pytest.approx(HALF_STEPS_PER_WAVE - 20, abs=1)
    motor.board.set_cam(0, 0, 0)
    before = position(motor).index_half_steps
    # It opens; then come a spike, and a switch that bounces.
    for bounces in ([False], [True, False], [True, False, True, False, True]):
        closed_at = motor.board.half_steps if len(bounces) > 2 else before
        for closed in bounces:
            motor.board.set_switch(emulated.PIN_3, closed)
            motor.wait(0.005)
        motor.wait(0.2)
        assert position(motor).index_half_steps == pytest.approx(closed_at, abs=1)


def numbers_of(header):
    """Return the numbers that a header defines."""
    text = (emulated.FIRMWARE / header).read_text(encoding="utf-8")
    values = re.findall(r"#define (\w+) \(?([\dL* ]+?)\)?(?: */\*.*)?\n", text)
    return {name: eval(value.replace("L", ""), {}) for name, value in values}


def test_the_pages_have_the_firmwares_numbers():
    wave, fold = numbers_of("peristalsis/motion.h"), numbers_of("fold/origami.h")
    per_turn = wave["HALF_STEPS_PER_TURN_NUMERATOR"] / wave["HALF_STEPS_PER_TURN_DENOMINATOR"]
    wave_mm, per_s = wave["WAVELENGTH_UM"] / 1000, 1e6 / fold["TICK_US"]
    per_mm = per_turn / (wave["WAVES_PER_MOTOR_TURN"] * wave_mm)
    assert per_mm == pytest.approx(HALF_STEPS_PER_MM)
    longest_s, on_s = fold["LONGEST_MS"] / 1000, fold["DUTY_ON_MS"] / 1000
    told = [
        f"half-steps a turn of the motor's shaft | {per_turn:.2f}",
        f"cam shaft | {wave_mm:g} mm a turn",
        f"half-steps a mm of the wave | {per_mm:.2f}",
        f"half-steps a second at 25 mm/s | {25 * per_mm:.0f}",
        f"half-steps a second at most | {wave['MAX_RATE']}",
        f"ramp | {wave['DEFAULT_RAMP_UM_S2'] / 1000:g} mm/s²",
        f"speed | {per_s:g} half-steps/s",
        f"duty | {on_s:g} s in {fold['DUTY_S']} s | {100 * on_s / fold['DUTY_S']:.0f} %",
        f"lease | {fold['LEASE_MS'] / 1000:g} s",
    ]
    ways = {
        f"{fold[name]} half-steps": fold[name]
        for name in ("RELEASE_HALF_STEPS", "SLACK_HALF_STEPS")
    }
    ways[f"{longest_s:g} s"] = longest_s * per_s
    told += [
        f"{way} | {steps * np.pi * 10 / per_turn:.1f} mm of thread" for way, steps in ways.items()
    ]
    pages = "".join((DOCS / name).read_text("utf-8") for name in ("bench.md", "protocol.md"))
    assert not [statement for statement in told if f"| {statement}" not in pages]
