"""The firmware on emulated boards: times of samples, sleep, and steps of the motor."""

import re
from pathlib import Path

import numpy as np
import pytest

from capsule.bench.protocol import Acknowledgement, Position, Sample, encode
from support.bench import emulated
from support.bench.emulated import HALF_STEPS_PER_MM, EmulatedBoard, Talk

pytestmark = [pytest.mark.boards, emulated.needed]


@pytest.fixture
def logger():
    return Talk(emulated.LOGGER)


@pytest.fixture
def motor():
    return Talk(emulated.PERISTALSIS)


def samples(events):
    return [event for event in events if isinstance(event, Sample)]


def test_samples_at_exactly_ten_hertz_and_sleeps_between(logger):
    logger.board.set_voltages([0, 2500, 4999, 5100], [0, 2500, 4999, 5100])
    assert logger.say("start") == [Acknowledgement("start", "")]
    taken = samples(logger.wait(60))
    # To the processor's cycle, whatever else it does: the timer starts the conversion.
    assert set(np.diff(logger.board.seen.samples.times_us())) == {100_000.0}
    assert [sample.device_ms for sample in taken] == list(range(100, 60_100, 100))
    assert [sample.sequence for sample in taken] == list(range(600))
    assert {sample.counts for sample in taken} == {(0, 512, 1023, 1023)}  # as of the silicon
    assert logger.board.seen.cycles_asleep > 0.95 * logger.board.seen.cycles


def test_commands_do_not_move_a_sample(logger):
    logger.say("start")
    for _ in range(200):
        logger.say("identify", seconds=0.0137)
    intervals_us = np.diff(logger.board.seen.samples.times_us())
    # An interrupt of the line may be under way when the timer's comes: some microseconds.
    assert np.abs(intervals_us - 100_000).max() < 20


def test_time_runs_on_through_a_pause(logger):
    logger.say("start")
    before = samples(logger.wait(1)) + samples(logger.say("pause"))
    assert not samples(logger.wait(2))
    logger.say("start")
    after = samples(logger.wait(1))
    assert after[0].sequence == before[-1].sequence + 1
    assert after[0].device_ms - before[-1].device_ms > 2000
    assert after[0].device_ms % 100 == 0


def test_the_end_stop_is_debounced_and_its_broken_wire_reads_as_pressed(logger):
    def told(seconds):
        return [sample.at_end for sample in samples(logger.wait(seconds))]

    logger.say("start")
    logger.board.set_end_stop(True)
    assert told(0.2) == [False, True]
    logger.board.set_end_stop(False)
    assert not told(0.2)[-1]
    logger.board.break_wire(emulated.END_STOP)
    assert told(0.3)[-1]


def position(talk):
    (answer,) = [event for event in talk.say("position") if isinstance(event, Position)]
    return answer


def rates(talk, count):
    """Return the last rates in half-steps per second."""
    return 1e6 / np.diff(talk.board.seen.steps.times_us()[-count:])


@pytest.mark.parametrize("speed", ["", "0.5", "3.125", "47.1"])
def test_the_wave_moves_at_its_speed_in_even_steps(motor, speed):
    if speed:
        assert motor.say(f"speed,{speed}") == [Acknowledgement("speed", speed)]
    motor.say("start")
    motor.wait(5)
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
    steady = rates(motor, 200)
    assert steady.mean() == pytest.approx(wanted * HALF_STEPS_PER_MM, rel=1e-3)
    # Two ticks of the timer and an interrupt that has to wait.
    assert steady.max() / steady.min() < 1.02


def test_ramp(motor):
    motor.say("ramp,10")
    motor.say("start")
    motor.wait(6)
    times_us = motor.board.seen.steps.times_us()
    assert len(times_us) < 8192
    speeds = 1e6 / np.diff(times_us) / HALF_STEPS_PER_MM
    moments_s = (times_us[1:] - times_us[0]) / 1e6
    rising = (speeds > 5) & (speeds < 24)
    slope = np.polyfit(moments_s[rising], speeds[rising], 1)[0]
    assert slope == pytest.approx(10, rel=0.05)
    assert speeds[0] < 4
    assert speeds.max() < 25.3


def test_stop_ramps_down_and_lets_the_coils_cool(motor):
    motor.say("start")
    motor.wait(3)
    motor.say("stop", seconds=0.1)
    assert position(motor).state == "stopping"
    motor.wait(2)
    stopped = position(motor)
    assert (stopped.state, stopped.speed_mm_s) == ("stopped", 0)
    assert motor.board.coils == 0
    assert stopped.half_steps == motor.board.half_steps
    motor.say("start")
    motor.wait(1)
    assert motor.board.half_steps > stopped.half_steps
    assert motor.board.seen.illegal_steps == 0


def test_turning_round_passes_through_rest(motor):
    motor.say("start")
    motor.wait(2)
    forward = motor.board.half_steps
    motor.say("direction,backward")
    motor.wait(4)
    backward = position(motor)
    assert backward.speed_mm_s == pytest.approx(-25, abs=0.01)
    assert motor.board.half_steps < forward
    assert motor.board.seen.illegal_steps == 0
    assert rates(motor, 8000).max() < 25.3 * HALF_STEPS_PER_MM


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("speed,47.2", r"47\.200 mm/s needs 802 half-steps/s; the motor follows 800"),
        ("speed,99999", r"99999\.000 mm/s needs 16982\d\d half-steps/s; .*follows 800"),
        ("speed,0.4", r"wants 0\.500 to 47\.107 mm/s"),
        ("speed,-5", "wants"),
        ("speed,", "wants"),
        ("speed,1e3", "wants"),
        ("speed,5.", "wants"),
        ("speed,5.0001", "wants"),
        ("speed,123456789", "wants"),
        ("ramp,0.5", r"wants 1\.000 to 100\.000 mm/s\^2"),
        ("ramp,101", "wants"),
        ("direction,up", "wants forward or backward"),
        ("lease,0.999", r"wants 1\.000 to 60\.000 s, or 0 for none"),
        ("lease,60.001", "wants"),
        ("lease,-1", "wants"),
        ("start,now", "takes no argument"),
        ("dance", "unknown; peristalsis knows"),
    ],
)
def test_what_cannot_be_is_refused_with_a_reason(motor, command, reason):
    motor.say("speed,10")
    (answer,) = motor.say(command, seconds=0.05)
    assert answer.command == command.partition(",")[0]
    assert re.search(reason, answer.reason), answer.reason
    motor.say("start")
    motor.wait(3)
    assert position(motor).speed_mm_s == pytest.approx(10, abs=0.01)


def test_a_lease_that_nobody_renews_stops_the_wave(motor):
    motor.say("lease,2")
    motor.say("lease,0")
    motor.say("ramp,50")
    motor.say("start")
    motor.wait(10)
    assert position(motor).state == "running"
    assert motor.say("lease,2") == [Acknowledgement("lease", "2")]
    renewing = ["position", "identify", "speed,20", "speed,99", "start"]  # even where it is refused
    for command in renewing:
        motor.wait(1.8)
        assert position(motor).state == "running"
        motor.wait(1.8)
        motor.say(command)
    motor.wait(1.8)
    motor.board.deliver(encode("position").replace(b"n*", b"m*"))  # damaged, it renews nothing
    motor.wait(0.3)
    assert position(motor).state == "stopping"
    motor.wait(2)
    stopped = position(motor)
    assert (stopped.state, motor.board.coils) == ("stopped", 0)
    motor.wait(5)
    assert position(motor).half_steps == stopped.half_steps
    motor.say("start")
    motor.wait(1)
    assert position(motor).state == "running"


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
    ids=["nothing heard", "hangs", "hangs without interrupts", "timer fails", "hangs and feeds"],
)
def test_a_board_without_its_computer_or_program_stops_by_itself(
    motor, lease, fault, moves_s, resets
):
    if lease:
        motor.say(lease)
    motor.say("start")
    motor.wait(1)
    fault(motor.board)
    motor.wait(moves_s)
    assert motor.board.coils
    motor.wait(0.6 if resets else 3)
    assert (motor.board.seen.watchdog_resets, motor.board.coils) == (resets, 0)
    motor.wait(3)
    assert (motor.board.seen.watchdog_resets, motor.board.coils) == (resets, 0)


INDEX_AT, INDEX_CLOSED = 300.3, 120.0  # half-steps: where the cam closes its switch, how long
HALF_STEPS_PER_WAVE = 80 * HALF_STEPS_PER_MM


def check_phase(talk):
    """Stop the wave, check the phase that its index tells, and return its position."""
    talk.say("stop")
    talk.wait(1.5)
    where = position(talk)
    assert where.state == "stopped"
    told = where.half_steps - where.index_half_steps
    off = (told - (talk.board.half_steps - INDEX_AT)) % HALF_STEPS_PER_WAVE
    assert min(off, HALF_STEPS_PER_WAVE - off) <= 1
    return where


def test_the_index_tells_the_phase_again_after_a_reset(motor):
    motor.board.set_cam(HALF_STEPS_PER_WAVE, INDEX_AT, INDEX_CLOSED)
    assert position(motor).index_half_steps is None
    motor.say("start")
    motor.wait(8)
    assert check_phase(motor).index_half_steps > HALF_STEPS_PER_WAVE
    motor.board.reset()
    (identity,) = motor.wait(0.05)
    assert identity.entries["index"] == "none"
    assert (position(motor).half_steps, position(motor).index_half_steps) == (0, None)
    motor.say("start")
    motor.wait(4)
    after = check_phase(motor)
    (identity,) = motor.say("identify")
    assert identity.entries["index"] == str(after.index_half_steps)
    # Backward, the same edge of the cam counts.
    motor.say("direction,backward")
    motor.say("start")
    motor.wait(6)
    assert check_phase(motor).index_half_steps < 0
    assert motor.board.seen.illegal_steps == 0


def test_a_board_that_starts_on_its_index_has_not_passed_it(motor):
    motor.board.set_cam(HALF_STEPS_PER_WAVE, -20, INDEX_CLOSED)
    motor.say("start")
    motor.wait(2)
    assert position(motor).index_half_steps is None
    motor.wait(2)
    assert position(motor).index_half_steps == pytest.approx(HALF_STEPS_PER_WAVE - 20, abs=1)


def test_the_index_is_where_a_bouncing_switch_first_closed(motor):
    motor.say("start")
    motor.wait(2)

    def bounce(*closed):
        for each in closed:
            motor.board.set_switch(emulated.PIN_3, each)
            motor.wait(0.005)
        motor.wait(0.2)

    bounce(True, False)  # a spike
    assert position(motor).index_half_steps is None
    closed_at = motor.board.half_steps
    bounce(True, False, True, False, True)
    bounce(False, True, False, True, False)
    assert position(motor).index_half_steps == pytest.approx(closed_at, abs=1)


def test_the_page_on_the_bench_has_the_firmwares_numbers():
    docs = Path(__file__).parents[3] / "docs"
    page = (docs / "bench.md").read_text(encoding="utf-8")
    header = (emulated.FIRMWARE / "peristalsis" / "motion.h").read_text(encoding="utf-8")
    values = dict(re.findall(r"#define (\w+) \(?([\dL* ]+)\)?", header))
    number = {name: eval(text.replace("L", ""), {}) for name, text in values.items()}
    per_turn = number["HALF_STEPS_PER_TURN_NUMERATOR"] / number["HALF_STEPS_PER_TURN_DENOMINATOR"]
    wavelength_mm = number["WAVELENGTH_UM"] / 1000
    per_mm = per_turn / (number["WAVES_PER_MOTOR_TURN"] * wavelength_mm)
    assert per_mm == pytest.approx(HALF_STEPS_PER_MM)
    for statement in (
        f"| half-steps a turn of the motor's shaft | {per_turn:.2f} |",
        f"{number['WAVES_PER_MOTOR_TURN']} turns of the cam shaft a turn of the motor",
        f"| cam shaft | {wavelength_mm:g} mm a turn |",
        f"| half-steps a mm of the wave | {per_mm:.2f} |",
        f"| half-steps a second at 25 mm/s | {25 * per_mm:.0f} |",
        f"| half-steps a second at most | {number['MAX_RATE']} |",
        f"{number['MAX_RATE'] / per_mm:.1f} mm/s; a faster wave is refused",
        f"have to make {25 / wavelength_mm * per_turn:.0f} half-steps/s",
        f"{number['MAX_RATE'] / per_turn * wavelength_mm:.1f} mm/s)",
        f"| ramp | {number['DEFAULT_RAMP_UM_S2'] / 1000:g} mm/s² |",
    ):
        assert statement in page, statement
    protocol = (docs / "protocol.md").read_text(encoding="utf-8")
    assert f"half-steps of a wave ({per_mm * wavelength_mm:.2f})" in protocol
