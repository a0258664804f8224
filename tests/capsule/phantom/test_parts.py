"""The parts of the phantom, each against what one can work out by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng

from capsule.phantom.advance import Motion, Strokes, draw_holds, draw_strokes, first_arrival
from capsule.phantom.contact import (
    height_factor,
    pressed_bulge,
    reseated_strength,
    sphere_stiffness,
    stray_offset,
    wandering_strength,
)
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.origami import pitch, vertices
from capsule.phantom.sensor import Sensors
from capsule.phantom.wall import roughness, wave_train

PHANTOM = read_phantom(DEFAULT_TABLE, [])
ADVANCE, CONTACT, WALL, SEAT = PHANTOM.advance, PHANTOM.contact, PHANTOM.wall, PHANTOM.seat
PERIOD_S = 3.2


def test_corners_are_the_papers_and_the_pitch_follows():
    # Along the axis from C: 5 tan 50 to A, 5 tan 5 to B, and the awn leans to the tail.
    corners = {"A": (5.9588, 2.0), "B": (0.4374, 2.0), "C": (0.0, 7.0), "D": (-0.2625, 10.0)}
    for name, corner in vertices(PHANTOM.origami).items():
        assert corner == pytest.approx(corners[name], abs=1e-4)
    # The printed wall (0.5 mm) and the adhesive (0.25 mm) come between two substructures.
    assert pitch(PHANTOM.origami) == pytest.approx(5.9588 - 0.4374 + 0.5 + 0.25, abs=1e-3)


def test_a_sphere_is_carried_as_a_punch_and_a_larger_one_keeps_more_of_its_height():
    # 50 kPa and a volume that does not change: E / (1 - 0.25) = 0.0667 N/mm2.
    for diameter in (1.0, 2.0, 5.0):
        assert sphere_stiffness(WALL, diameter) == pytest.approx(0.05 / 0.75 * diameter)
    kept = [pressed_bulge(CONTACT, WALL, d) / d for d in (1, 2, 3, 4, 5)]
    assert kept == sorted(kept)
    assert 0 < kept[0] < 0.5 < kept[-1] < 1
    assert pressed_bulge(CONTACT, WALL, 0) == 0


def test_the_capsule_bears_on_a_nodule_at_its_middle_and_misses_one_beyond_its_strip():
    wide, narrow = (replace(CONTACT, bearing_height_mm=mm) for mm in (5.0, 1.0))
    # The strip's edge at 2.5 mm halves a nodule centred there.
    factors = [height_factor(wide, 2.0, offset_mm) for offset_mm in (0, 2.5, -2.5, 3.5)]
    assert [*factors, height_factor(wide, 0.0, 0.0)] == pytest.approx([1, 0.5, 0.5, 0, 0])
    assert height_factor(wide, 5.0, 3.5) > 0.1
    assert height_factor(narrow, 5.0, 0.0) == pytest.approx(1.0)
    # A run that strays passes a small nodule without touching it.
    left = [height_factor(CONTACT, size, 1.9) for size in (1.0, 2.0, 3.0, 5.0)]
    assert left[1] == 0.0 < left[2] < left[3] < 1


@pytest.mark.parametrize("probability", [0.0, 0.3])
def test_as_many_runs_stray_as_is_set(probability):
    contact = replace(CONTACT, stray_probability=probability, stray_mm=1.9)
    offsets = [stray_offset(contact, default_rng(seed)) for seed in range(2000)]
    assert set(offsets) <= {0.0, 1.9}
    assert np.mean(offsets) == pytest.approx(probability * 1.9, rel=0.1)


def test_strength_wanders_by_as_much_and_as_slowly_as_is_set_in_each_sensor_for_itself():
    seat = replace(SEAT, strength_spread=0.2, strength_time_s=8.0)
    strength = np.log(wandering_strength(seat, default_rng(3), 4, 200_000, 10.0))
    assert (strength.std(), strength.mean()) == pytest.approx((0.2, 0.0), abs=0.01)
    # The correlation of a first-order noise falls to 1/e in its time.
    later = [np.corrcoef(row[:-80], row[80:])[0, 1] for row in strength]
    assert np.mean(later) == pytest.approx(np.exp(-1), abs=0.03)
    assert np.abs(np.corrcoef(strength)[np.triu_indices(4, 1)]).max() < 0.1


def test_strength_changes_in_the_wave_after_a_slip_and_only_then():
    slips_mm = np.where(np.isin(np.arange(10), [2, 6]), 0.7, 0.0)
    seat, wave = replace(SEAT, reseat_spread=0.3), np.arange(1000) // 100
    many = [reseated_strength(seat, default_rng(run), 4, slips_mm, wave) for run in range(500)]
    for row in many[0]:
        np.testing.assert_array_equal(np.flatnonzero(np.diff(row)) + 1, [300, 700])
    assert np.std(np.log(many)) == pytest.approx(0.3, rel=0.05)


def drawn_strokes(seed, carried, **changes):
    """Draw the strokes of the waves that are carried; each subject has its own numbers."""

    def draw(subject):
        return default_rng([seed, *subject.encode()])

    carried, advance = np.asarray(carried, dtype=bool), replace(ADVANCE, **changes)
    return draw_strokes(advance, PHANTOM.folding, draw, PERIOD_S, carried)


def head_positions(strokes, time_s, rise=lambda position_mm, stroke_mm: np.zeros(4), **changes):
    """Return the way of a head with these strokes."""
    advance = replace(ADVANCE, **changes)
    holds = draw_holds(advance, default_rng(1), 4)
    return Motion(advance, strokes, holds, PERIOD_S, rise).move(time_s)


@pytest.mark.parametrize("probability", [0.0, 0.2, 0.6])
def test_slips_back_are_as_many_as_is_set_and_cost_no_speed(probability):
    changes = {"slip_probability": probability, "slip_back": 1.5}
    drawn = [drawn_strokes(seed, np.ones(200), **changes) for seed in range(300)]
    slips, ahead, folded = (
        np.array([getattr(each, f"{name}_mm") for each in drawn]) / PERIOD_S
        for name in ("slips", "ahead", "folded")
    )
    assert np.mean(slips > 0) == pytest.approx(probability, abs=0.01)
    assert slips.mean() == pytest.approx(probability * 1.5 * ADVANCE.speed_mm_s, rel=0.03)
    assert np.mean(ahead - slips) == pytest.approx(ADVANCE.speed_mm_s, rel=0.03)
    assert folded.mean() == pytest.approx(PHANTOM.folding.speed_mm_s, rel=0.03)


def test_a_missing_wave_carries_nothing_and_leaves_the_other_strokes_as_they_are():
    carried = ~np.isin(np.arange(20), [3, 11])
    whole, lacking = (drawn_strokes(1, each) for each in (np.ones(20), carried))
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
    def distance(steepness, **changes):
        def rise(position_mm, stroke_mm):
            return np.array([steepness * stroke_mm, 0.0, 0.0, 0.0])

        strokes = drawn_strokes(1, np.ones(40))
        return head_positions(strokes, PERIOD_S * np.arange(40), rise, **changes)

    free = distance(0.0)
    uphill = distance(1.0, catch_probability=0.0)
    np.testing.assert_allclose(uphill, free * math.exp(-ADVANCE.snag))
    # An awn that catches on a steep slope holds for some waves, then it slips over for good.
    held = distance(2 * ADVANCE.catch_slope, catch_probability=1.0, snag=0.0, hold_waves=4.0)
    waits = np.count_nonzero(np.diff(held) == 0) - np.count_nonzero(np.diff(free) == 0)
    assert 0 < waits <= 8
    np.testing.assert_allclose(np.diff(held)[8:], np.diff(free)[8:])


def quiet_sensors(rng, samples=500, drift_return_s=0.0, **changes):
    """Return the relative change in resistance of sensors that nothing presses."""
    none = dict.fromkeys(["settling", "drift_per_s", "noise", "resistance_spread"], 0.0)
    sensor = replace(PHANTOM.sensor, **none | changes)
    sensors = Sensors(sensor, rng, (4, samples), 10.0, drift_return_s)
    return sensors.resistance(np.zeros((4, samples))) / sensor.resistance_ohm - 1


def test_a_drift_that_returns_is_as_large_as_its_time_allows():
    drift = quiet_sensors(default_rng(1), 50_000, drift_return_s=5.0, drift_per_s=0.002)
    assert drift.std() == pytest.approx(0.002 * math.sqrt(5.0 / 2), rel=0.05)


def rough(rng, spread):
    return roughness(replace(WALL, unevenness_spread=spread), rng)


def jumping(rng, spread):
    return quiet_sensors(rng, jump=0.01, jumps_per_s=1.0, jump_run_spread=spread).std()


def wandering(rng, spread):
    seat = replace(SEAT, strength_spread=0.2, strength_run_spread=spread)
    return np.log(wandering_strength(seat, rng, 4, 990, 10.0)).std()


def crests(rng, spread, waves, **changes):
    wave = replace(PHANTOM.wave, run_spread=spread, **changes)
    return wave_train(wave, rng, PERIOD_S, waves).crests


def uneven_crests(rng, spread):
    return np.log(crests(rng, spread, 200, amplitude_spread=0.2)).std()


def missing_crests(rng, spread):
    return np.mean(crests(rng, spread, 2000, missing_probability=0.1) == 0)


@pytest.mark.parametrize(
    ("of_run", "runs", "spread", "rel"),
    [(rough, 1000, 0.5, 0.2), (jumping, 300, 0.7, 0.2), (wandering, 100, 1.0, 0.3),
     (uneven_crests, 300, 0.8, 0.2), (missing_crests, 300, 0.5, 0.2)],
)  # fmt: skip
def test_some_runs_vary_more_than_others_by_as_much_as_is_set(of_run, runs, spread, rel):
    varying, alike = (
        np.log([of_run(default_rng(run), each) for run in range(runs)]).std()
        for each in (spread, 0.0)
    )
    assert varying**2 - alike**2 == pytest.approx(spread**2, rel=rel)
