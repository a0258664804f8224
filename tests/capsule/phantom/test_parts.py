"""The parts of the phantom, each against what one can work out by hand."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.random import default_rng

from capsule.phantom import contact as touch
from capsule.phantom.advance import Motion, Strokes, draw_holds, draw_strokes, first_arrival
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.parameters import with_values
from capsule.phantom.sensor import Sensors, base_line_jumps, counts
from capsule.phantom.wall import cam_time, crest_shape, roughness, wave_height, wave_train
from capsule.seeding import generator

PHANTOM = read_phantom(DEFAULT_TABLE, [])
ADVANCE, CONTACT, WALL, SEAT = PHANTOM.advance, PHANTOM.contact, PHANTOM.wall, PHANTOM.seat
SINE, PERIOD_S = PHANTOM.wave, 3.2


def test_the_capsule_bears_on_a_nodule_at_its_middle_and_misses_one_beyond_its_strip():
    wide, narrow = (replace(CONTACT, bearing_height_mm=mm) for mm in (5.0, 1.0))
    # The strip's edge at 2.5 mm halves a nodule centred there.
    factors = [touch.height_factor(wide, 2.0, offset_mm) for offset_mm in (0, 2.5, -2.5, 3.5)]
    assert [*factors, touch.height_factor(wide, 0.0, 0.0)] == pytest.approx([1, 0.5, 0.5, 0, 0])
    # A run that strays passes a small nodule without touching it.
    left = [touch.height_factor(CONTACT, size, 1.9) for size in (2.0, 3.0, 5.0)]
    assert left[0] == 0.0 < left[1] < left[2] < 1
    assert touch.height_factor(narrow, 5.0, 0.0) == pytest.approx(1.0)
    # As many runs stray as is set.
    contact, rng = replace(CONTACT, stray_probability=0.3, stray_mm=1.9), default_rng(1)
    offsets = [touch.stray_offset(contact, rng) for _ in range(2000)]
    assert set(offsets) == {0.0, 1.9}
    assert np.mean(offsets) == pytest.approx(0.3 * 1.9, rel=0.1)


def test_strength_wanders_by_as_much_and_as_slowly_as_is_set_in_each_sensor_for_itself():
    seat = replace(SEAT, strength_spread=0.2, strength_time_s=8.0)
    strength = np.log(touch.wandering_strength(seat, default_rng(3), 4, 100_000, 10.0))
    assert (strength.std(), strength.mean()) == pytest.approx((0.2, 0.0), abs=0.01)
    # The correlation of a first-order noise falls to 1/e in its time.
    later = [np.corrcoef(row[:-80], row[80:])[0, 1] for row in strength]
    assert np.mean(later) == pytest.approx(np.exp(-1), abs=0.03)
    assert np.abs(np.corrcoef(strength)[np.triu_indices(4, 1)]).max() < 0.1


def test_strength_changes_in_the_wave_after_a_slip_and_only_then():
    slips_mm = np.where(np.isin(np.arange(10), [2, 6]), 0.7, 0.0)
    seat, wave = replace(SEAT, reseat_spread=0.3), np.arange(1000) // 100
    rngs = map(default_rng, range(500))
    many = [touch.reseated_strength(seat, rng, 4, slips_mm, wave) for rng in rngs]
    for row in many[0]:
        np.testing.assert_array_equal(np.flatnonzero(np.diff(row)) + 1, [300, 700])
    assert np.std(np.log(many)) == pytest.approx(0.3, rel=0.05)


def drawn_strokes(seed, carried, **changes):
    """Draw the strokes of the waves that are carried; each subject has its own numbers."""
    advance, carried = replace(ADVANCE, **changes), np.array(carried, dtype=bool)
    return draw_strokes(advance, PHANTOM.folding, partial(generator, seed), PERIOD_S, carried)


def head_positions(strokes, time_s, steepness=0.0, **changes):
    """Return the way of a head with these strokes, whose first awn climbs a slope."""
    advance, slopes = replace(ADVANCE, **changes), np.array([steepness, 0.0, 0.0, 0.0])
    holds = draw_holds(advance, default_rng(1), 4)
    motion = Motion(advance, strokes, holds, PERIOD_S, lambda _, stroke_mm: slopes * stroke_mm)
    return motion.move(time_s)


@pytest.mark.parametrize("probability", [0.0, 0.6])
def test_slips_back_are_as_many_as_is_set_and_cost_no_speed(probability):
    changes = {"slip_probability": probability, "slip_back": 1.5}
    drawn = [drawn_strokes(seed, np.ones(200), **changes) for seed in range(300)]
    speeds = np.array([(each.slips_mm, each.ahead_mm, each.folded_mm) for each in drawn]) / PERIOD_S
    slips, ahead, folded = np.moveaxis(speeds, 1, 0)
    assert np.mean(slips > 0) == pytest.approx(probability, abs=0.01)
    assert slips.mean() == pytest.approx(probability * 1.5 * ADVANCE.speed_mm_s, rel=0.03)
    assert np.mean(ahead - slips) == pytest.approx(ADVANCE.speed_mm_s, rel=0.03)
    assert folded.mean() == pytest.approx(PHANTOM.folding.speed_mm_s, rel=0.03)
    # A missing wave carries nothing, and leaves the other strokes as they are.
    carried, whole = np.arange(200) % 8 != 3, drawn[0]
    lacking = drawn_strokes(0, carried, **changes)
    np.testing.assert_array_equal(lacking.ahead_mm, whole.ahead_mm * carried)
    np.testing.assert_array_equal(lacking.folded_mm, whole.folded_mm * carried)


def test_the_head_moves_with_the_wave_rests_and_slips_back_and_arrives_where_it_first_stands():
    time_s = np.arange(0, 12.8, 0.1)
    ahead_mm, slips_mm = np.array([[1.0, 1.0, 0.0, 2.0], [0.0, 1.8, 0.0, 0.0]])
    head = head_positions(Strokes(1.0, ahead_mm, slips_mm, np.zeros(4)), time_s)
    resting = (time_s > PERIOD_S * ADVANCE.grip_fraction) & (time_s < PERIOD_S)
    np.testing.assert_array_equal(head[resting], 1.0)
    # To 0.2 + 1.8 mm with the second wave, and back to where the third begins.
    second = head[(time_s >= 3.2) & (time_s < 6.4)]
    assert (second.max(), second[-1]) == pytest.approx((2.0, 0.2), abs=0.02)
    assert head[[65, 95, -1]] == pytest.approx([0.2, 0.2, 2.2])
    arrival = first_arrival(head, np.array([0.5, 1.5, 9.0]))
    assert arrival.tolist() == [np.argmax(head >= 0.5), np.argmax(head >= 1.5), time_s.size]


def test_a_climb_shortens_the_stroke_and_a_caught_awn_holds_the_capsule():
    way = partial(head_positions, drawn_strokes(1, np.ones(40)), PERIOD_S * np.arange(40))
    free, uphill = way(), way(1.0, catch_probability=0.0)
    np.testing.assert_allclose(uphill, free * math.exp(-ADVANCE.snag))
    # An awn that catches on a steep slope holds for some waves, then it slips over for good.
    held = way(2 * ADVANCE.catch_slope, catch_probability=1.0, snag=0.0, hold_waves=4.0)
    waits = np.count_nonzero(np.diff(held) == 0) - np.count_nonzero(np.diff(free) == 0)
    assert 0 < waits <= 8
    np.testing.assert_allclose(np.diff(held)[8:], np.diff(free)[8:])


# The wave: a clock's sine where nothing is irregular, and each irregularity for itself.


@pytest.mark.parametrize("skew", [-0.9, 0.0, 0.4])
def test_a_skewed_wave_moves_inwards_for_its_share_of_the_period(skew):
    wave, angles = replace(SINE, skew=skew), np.linspace(-20, 20, 4001)
    assert np.abs(np.diff(crest_shape(wave, angles))).max() < 0.025 / (1 - abs(skew))
    # A place's angle falls with time, so what rises in time falls along the angle.
    one_period = crest_shape(wave, np.linspace(0, 2 * np.pi, 20_001))
    assert np.mean(np.diff(one_period) < 0) == pytest.approx((1 + skew) / 2, abs=1e-3)
    assert one_period[0] == one_period.max() == 1
    assert np.mean(one_period > 0) == pytest.approx(0.5, abs=1e-3)
    # A sharp one keeps height and sign, and presses for a shorter time.
    sharp, power = (crest_shape(replace(wave, sharpness=each), angles) for each in (3, 1))
    np.testing.assert_allclose(sharp, power**3, atol=1e-12)


def test_periods_jitter_around_the_motors_mean_and_time_never_turns_back():
    train = wave_train(replace(SINE, period_spread=0.3), default_rng(1), PERIOD_S, 40)
    periods = np.diff(train.starts_s)
    assert np.log(periods).std() == pytest.approx(0.3, rel=0.3)
    assert periods.mean() == pytest.approx(PERIOD_S)
    cams_s = cam_time(train, np.linspace(0, 40 * PERIOD_S, 5000))
    assert (np.diff(cams_s) > 0).all()
    # Where a wave really starts, the cams stand as evenly turning ones at that wave's turn.
    np.testing.assert_allclose(cam_time(train, train.starts_s), PERIOD_S * np.arange(41), atol=1e-9)


def test_crests_differ_and_some_are_missing_while_nothing_else_changes():
    wave = replace(SINE, amplitude_spread=0.2, missing_probability=0.25)
    waves = SINE, wave, replace(SINE, amplitude_spread=2.0)
    trains = [wave_train(each, default_rng(1), PERIOD_S, 4000) for each in waves]
    crests, time_s = trains[1].crests, np.arange(0, 100, 0.05)
    assert np.mean(crests == 0) == pytest.approx(0.25, abs=0.02)
    assert np.log(crests[crests > 0]).std() == pytest.approx(0.2, rel=0.05)
    drawn, place = zip(waves, trains, strict=True), np.array(0.0)
    sine, height, highest = (wave_height(WALL, *each, place, time_s, 0.0) for each in drawn)
    np.testing.assert_array_equal(height[sine <= 0], sine[sine <= 0])
    # At phase 0 crest n passes place 0 at n periods.
    at_crests = [np.argmin(np.abs(time_s - number * PERIOD_S)) for number in range(25)]
    assert height[at_crests] == pytest.approx(sine[at_crests] * crests[:25], abs=1e-9)
    # The walls meet halfway.
    assert highest.max() == WALL.lumen_mm / 2


# The sensors.

RANDOM = ["resistance_spread", "settling", "drift_per_s", "noise", "jump"]
SENSOR = replace(PHANTOM.sensor, **dict.fromkeys(RANDOM, 0.0))
IMPERFECT = {
    "hysteresis": 0.4, "hysteresis_mm": 0.6, "release_peak": 0.25, "release_s": 0.5,
    "crosstalk": 0.2, "saturation_mm": 2.0, "creep_fraction": 0.3, "creep_s": 2.0, "lag_s": 0.3,
    "gauge_per_mm": 0.05,
}  # fmt: skip


def test_converter_floors_and_ends_at_its_rails():
    ohms = np.array([[0.0, 12000.0, 1e22, 11999.0]])
    # 12 kOhm against 12 kOhm is half the reference: 512; just below it is floored to 511.
    np.testing.assert_array_equal(counts(PHANTOM.electronics, ohms), [[0, 512, 1023, 511]])


def response(sensor, pressed_mm, rate_hz=10.0):
    """Return the response of each sensor, sample by sample; before the first all was constant."""
    times_s = np.array([sensor.release_s, sensor.lag_s, sensor.creep_s])
    decays = np.exp(-1 / (rate_hz * np.maximum(times_s, 1e-9)))
    above, _, below = (np.pad(pressed_mm, ((1, 1), (0, 0)))[at : at + 4] for at in range(3))
    strained = (pressed_mm + sensor.crosstalk * (above + below)) / sensor.saturation_mm
    all_felt = sensor.saturation_mm * np.tanh(strained.T)
    before = held = quick = slow = all_felt[0]
    peak, half, responses = 0.0, sensor.hysteresis_mm / 2, []
    for felt in all_felt:
        held = np.clip(held, felt - half, felt + half)
        peak = decays[0] * peak + sensor.release_peak * np.maximum(before - felt, 0.0)
        load = (1 - sensor.hysteresis) * felt + sensor.hysteresis * held + peak
        quick = load + decays[1] * (quick - load)
        slow = load + decays[2] * (slow - load)
        responses.append(quick + sensor.creep_fraction * (slow - quick))
        before = felt
    return np.transpose(responses)


@pytest.mark.parametrize("changes", [{}, IMPERFECT, IMPERFECT | {"lag_s": 0}])
def test_compression_lowers_the_resistance_by_its_response_however_it_is_asked_for(changes):
    sensor = replace(SENSOR, **changes)
    steps = default_rng(1).normal(0, 0.5, (4, 200))
    pressed_mm = np.abs(np.cumsum(steps, axis=1))
    sensors = Sensors(sensor, default_rng(1), (4, 200), 10.0)
    parts = np.split(pressed_mm, [1, 8, 60], axis=1)
    ohms = np.hstack([sensors.resistance(part) for part in parts])
    # With the usual gauge some are pressed to nothing: no compression makes a resistance negative.
    share = np.maximum(1 - sensor.gauge_per_mm * response(sensor, pressed_mm), 0.0)
    np.testing.assert_allclose(ohms, sensor.resistance_ohm * share, rtol=1e-9)


def base_line(sensor, rng, samples=500, drift_return_s=0.0):
    """Return the resistance of sensors that nothing presses, in parts of the usual one."""
    sensors = Sensors(sensor, rng, (4, samples), 10.0, drift_return_s)
    return sensors.resistance(np.zeros((4, samples))) / sensor.resistance_ohm


def test_jumps_are_as_many_and_as_large_as_is_set_and_jumps_and_drift_return():
    # What returns within a sample leaves the bare jumps.
    set_to = (4, 100_000), 0.02, 0.1
    bare, slow = (base_line_jumps(default_rng(2), *set_to, after_s, 10.0) for after_s in (1e-3, 10))
    jumped = np.abs(bare) > 1e-9
    assert jumped.mean() == pytest.approx(0.02 / 10, rel=0.1)
    assert bare[jumped].std() == pytest.approx(0.1, rel=0.1)
    np.testing.assert_allclose(bare[:, 0], 0.0, atol=1e-15)
    first, following = np.flatnonzero(jumped[0])[:2]
    decay = np.exp(-np.arange(following - first) / 100)
    np.testing.assert_allclose(slow[0, first:following], bare[0, first] * decay, atol=1e-9)
    # Each sensor jumps for itself, and jumps that overlap add up.
    assert not (jumped[0] & jumped[1]).all()
    assert slow.std() == pytest.approx(0.1 * math.sqrt(0.02 * 10.0 / 2), rel=0.1)
    # A drift that returns is as large as its time allows.
    drift = base_line(replace(SENSOR, drift_per_s=0.002), default_rng(1), 50_000, 5.0)
    assert drift.std() == pytest.approx(0.002 * math.sqrt(5.0 / 2), rel=0.05)


# What a run has of each: its name, other values, and how it is measured in a run.
VARYING = [
    ("wall.unevenness_spread", 0.5, 1000, {}, lambda run, rng: roughness(run.wall, rng)),
    ("sensor.jump_run_spread", 0.7, 100, {"sensor.jump": 0.01, "sensor.jumps_per_s": 1.0},
     lambda run, rng: base_line(run.sensor, rng).std()),
    ("seat.strength_run_spread", 1.0, 100, {"seat.strength_spread": 0.2},
     lambda run, rng: np.log(touch.wandering_strength(run.seat, rng, 4, 990, 10.0)).std()),
    ("wave.run_spread", 0.8, 300, {"wave.amplitude_spread": 0.2},
     lambda run, rng: np.log(wave_train(run.wave, rng, PERIOD_S, 200).crests).std()),
    ("wave.run_spread", 0.5, 300, {"wave.missing_probability": 0.1},
     lambda run, rng: np.mean(wave_train(run.wave, rng, PERIOD_S, 1000).crests == 0)),
]  # fmt: skip


@pytest.mark.parametrize(("name", "spread", "runs", "values", "measured"), VARYING)
def test_some_runs_vary_more_than_others_by_as_much_as_is_set(name, spread, runs, values, measured):
    quiet = replace(PHANTOM, sensor=SENSOR)
    varying, alike = (
        np.log([measured(phantom, default_rng(run)) for run in range(runs)]).std()
        for phantom in (with_values(quiet, values | {name: each}) for each in (spread, 0.0))
    )
    assert varying**2 - alike**2 == pytest.approx(spread**2, rel=0.3 if runs == 100 else 0.2)
