"""The parts of the phantom, each against what one can work out by hand."""

import dataclasses
import math

import numpy as np
import pytest
import yaml

from capsule.errors import CapsuleError
from capsule.phantom.advance import (
    Motion,
    Strokes,
    draw_holds,
    draw_strokes,
    first_arrival,
    one_stroke,
    slips_back,
)
from capsule.phantom.contact import (
    bulge_profile,
    compression,
    height_factor,
    looseness,
    pressed_bulge,
    seat_wander,
    sphere_stiffness,
    stray_offset,
    wandering_strength,
)
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.origami import half_width, pitch, vertices
from capsule.phantom.parameters import (
    parameter_names,
    phantom_from_table,
)
from capsule.phantom.sensor import counts, resistance
from capsule.phantom.wall import draw_unevenness, overlap, roughness, uneven_height, wave_train

PHANTOM = read_phantom(DEFAULT_TABLE, [])


def angle_between(first, second):
    cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
    return math.degrees(math.acos(cosine))


def test_corners_have_the_papers_angles_and_width():
    corner = vertices(PHANTOM.origami)
    to_a, to_b = corner["A"] - corner["C"], corner["B"] - corner["C"]
    assert angle_between(to_a, to_b) == pytest.approx(45)
    assert angle_between(corner["D"] - corner["B"], np.array([0.0, 1.0])) == pytest.approx(5)
    # C lies on the line from B to D, and the awn leans to the tail.
    assert angle_between(corner["D"] - corner["C"], -to_b) == pytest.approx(0, abs=1e-4)
    assert corner["D"][0] < corner["B"][0]
    assert 2 * half_width(PHANTOM.origami) == 20


def test_pitch_follows_from_the_drawing():
    # Along the axis: C to A is 5 tan 50 = 5.959 mm, C to B 5 tan 5 = 0.437 mm; the printed wall
    # (0.5 mm) and the adhesive (0.25 mm) come between two substructures.
    assert pitch(PHANTOM.origami) == pytest.approx(5.959 - 0.437 + 0.5 + 0.25, abs=1e-3)
    assert pitch(PHANTOM.origami) == pytest.approx(6.3, abs=0.1)


def test_the_wave_touches_the_capsule_only_when_it_narrows_the_gut():
    height_mm = np.array([-3.5, 0.0, 3.5])
    np.testing.assert_allclose(overlap(PHANTOM.wall, 10.0, height_mm), [0.0, 0.0, 3.5])


def test_the_wall_is_uneven_by_as_much_as_is_set():
    places = np.linspace(0, 2000, 4000)
    heights = [
        uneven_height(
            PHANTOM.wall, draw_unevenness(PHANTOM.wall, np.random.default_rng(seed)), places
        )
        for seed in range(20)
    ]
    assert np.std(heights) == pytest.approx(PHANTOM.wall.unevenness_mm, rel=0.1)


def test_a_sphere_is_carried_as_a_punch_of_its_diameter_by_a_deep_sheet():
    # 50 kPa and a volume that does not change: E / (1 - 0.25) = 0.0667 N/mm2.
    for diameter in (1.0, 2.0, 5.0):
        assert sphere_stiffness(PHANTOM.wall, diameter) == pytest.approx(0.05 / 0.75 * diameter)
    # A column of 5 mm diameter over the 3 mm sheet comes to the same.
    column = 0.05 * math.pi * 5.0**2 / 4 / 3.0
    assert sphere_stiffness(PHANTOM.wall, 5.0) == pytest.approx(column, rel=0.03)


def test_a_larger_sphere_keeps_a_larger_part_of_its_height():
    kept = [pressed_bulge(PHANTOM.contact, PHANTOM.wall, d) / d for d in (1, 2, 3, 4, 5)]
    assert kept == sorted(kept)
    assert 0 < kept[0] < 0.5 < kept[-1] < 1
    assert pressed_bulge(PHANTOM.contact, PHANTOM.wall, 0) == 0


def test_bulge_is_highest_above_the_nodule():
    profile = bulge_profile(2.0, 1.5, np.array([-1.5, 0.0, 1.5]))
    np.testing.assert_allclose(profile, [2 * math.exp(-0.5), 2.0, 2 * math.exp(-0.5)])


def test_wall_and_substructure_share_the_overlap_as_springs_in_series():
    contact, wall = PHANTOM.contact, PHANTOM.wall
    small = np.array([1e-6])
    cushion = 0.05 * contact.patch_mm2 / 4.0
    share = cushion / (cushion + contact.unit_stiffness_n_mm)
    np.testing.assert_allclose(compression(contact, wall, small), share * small, rtol=1e-9)
    assert compression(contact, wall, np.array([1e6])) == pytest.approx(contact.fold_limit_mm)


def test_the_capsule_bears_on_a_nodule_at_its_middle_and_misses_one_beyond_its_strip():
    contact = dataclasses.replace(PHANTOM.contact, bearing_height_mm=5.0)
    assert height_factor(contact, 2.0, 0.0) == pytest.approx(1.0)
    # The strip's edge at 2.5 mm halves a nodule centred there.
    assert height_factor(contact, 2.0, 2.5) == pytest.approx(0.5)
    assert height_factor(contact, 2.0, -2.5) == pytest.approx(0.5)
    assert height_factor(contact, 2.0, 3.5) == pytest.approx(0.0)
    assert height_factor(contact, 5.0, 3.5) > 0.1
    assert height_factor(contact, 0.0, 0.0) == 0
    narrow = dataclasses.replace(PHANTOM.contact, bearing_height_mm=1.0)
    assert height_factor(narrow, 5.0, 0.0) == pytest.approx(1.0)


def test_seat_wander_has_the_spread_that_is_set():
    wander = seat_wander(PHANTOM.contact, np.random.default_rng(3), 4, 100_000, 10.0)
    assert wander.shape == (4, 100_000)
    assert wander.std() == pytest.approx(1.0, rel=0.05)
    numbers = np.random.default_rng(4)
    loose_mm = np.log([looseness(PHANTOM.contact, numbers) for _ in range(2000)])
    assert np.exp(loose_mm.mean()) == pytest.approx(PHANTOM.contact.wander_mm, rel=0.05)
    assert loose_mm.std() == pytest.approx(PHANTOM.contact.wander_spread, rel=0.05)


def test_as_many_runs_stray_as_is_set_and_a_small_nodule_is_then_passed_without_touch():
    def offsets(probability):
        contact = dataclasses.replace(PHANTOM.contact, stray_probability=probability, stray_mm=1.9)
        return [stray_offset(contact, np.random.default_rng(seed)) for seed in range(2000)]

    assert set(offsets(0.0)) == {0.0}
    assert np.mean(offsets(0.3)) == pytest.approx(0.3 * 1.9, rel=0.1)
    assert set(offsets(0.3)) == {0.0, 1.9}
    left = [height_factor(PHANTOM.contact, size, 1.9) for size in (1.0, 2.0, 3.0, 5.0)]
    assert left[:2] == [0.0, 0.0]
    assert 0 < left[2] < left[3] < 1


def level_way(position_mm, stroke_mm):
    return np.zeros(4)


def stroke_positions(advance, numbers, waves, rise=level_way, slips_mm=0.0, carried=True):
    """Return the position of the head at the start of each wave."""
    strokes = draw_strokes(advance, numbers, 3.2, waves, carried)
    holds, positions = draw_holds(advance, numbers, 4), [0.0]
    for wave, slip_mm in enumerate(np.broadcast_to(slips_mm, waves)):
        climbs_mm = rise(positions[-1], strokes.stroke_mm)
        moved_mm, holds = one_stroke(advance, strokes, wave, climbs_mm, holds)
        positions.append(positions[-1] + moved_mm - slip_mm)
    return np.array(positions)


def head_position(factors, time_s, slips_mm=(0.0, 0.0, 0.0)):
    """Return the way of a head whose strokes are some mm long."""
    strokes = Strokes(1.0, np.array(factors), np.array(factors) > 0)
    return Motion(PHANTOM.advance, strokes, np.zeros(4), np.array(slips_mm), 3.2, level_way).move(
        time_s
    )


@pytest.mark.parametrize("probability", [0.0, 0.2, 0.6])
def test_slips_back_are_as_many_as_is_set_and_cost_no_speed(probability):
    advance = dataclasses.replace(PHANTOM.advance, slip_probability=probability, slip_back=1.5)
    runs, slips = [], []
    for seed in range(300):
        slips.append(slips_back(advance, np.random.default_rng([seed, 1]), 3.2, 200))
        numbers = np.random.default_rng(seed)
        way = stroke_positions(advance, numbers, 200, slips_mm=slips[-1])
        runs.append(way[-1] / (200 * 3.2))
    assert np.mean(np.array(slips) > 0) == pytest.approx(probability, abs=0.01)
    usual_mm = probability * 1.5 * advance.speed_mm_s * 3.2
    assert np.mean(slips) == pytest.approx(usual_mm, rel=0.03)
    assert np.mean(runs) == pytest.approx(advance.speed_mm_s, rel=0.03)


def test_a_missing_wave_carries_nothing_and_leaves_the_other_strokes_as_they_are():
    carried = np.ones(20, dtype=bool)
    carried[[3, 11]] = False
    whole, lacking = (
        np.diff(stroke_positions(PHANTOM.advance, np.random.default_rng(1), 20, carried=each))
        for each in (True, carried)
    )
    np.testing.assert_array_equal(lacking[~carried], 0.0)
    np.testing.assert_allclose(lacking[carried], whole[carried])


def test_the_head_slips_back_while_it_would_rest_and_arrives_where_it_first_stands():
    time_s = np.arange(0, 9.6, 0.1)
    head = head_position([1.0, 1.0, 2.8], time_s, [0.0, 1.8, 0.0])
    in_second = (time_s >= 3.2) & (time_s < 6.4)
    # To 0.2 + 1.8 mm with the wave, and back to where the third wave begins.
    assert head[in_second].max() == pytest.approx(2.0, abs=0.01)
    assert head[in_second][-1] == pytest.approx(0.2, abs=0.02)
    assert head[~in_second][31:33] == pytest.approx([1.0, 0.2])
    arrival = first_arrival(head, np.array([0.5, 1.5, 9.0]))
    np.testing.assert_array_equal(
        arrival, [np.argmax(head >= 0.5), np.argmax(head >= 1.5), time_s.size]
    )


def test_a_climb_shortens_the_stroke():
    advance = dataclasses.replace(PHANTOM.advance, catch_probability=0.0)

    def uphill_way(position_mm, stroke_mm):
        return np.array([stroke_mm, 0.0, 0.0, 0.0])

    free = stroke_positions(advance, np.random.default_rng(1), 20)
    uphill = stroke_positions(advance, np.random.default_rng(1), 20, uphill_way)
    np.testing.assert_allclose(uphill, free * math.exp(-advance.snag))


def test_an_awn_that_catches_on_a_steep_slope_holds_the_capsule():
    def steep_way(position_mm, stroke_mm):
        return np.array([0.0, 2 * stroke_mm * PHANTOM.advance.catch_slope, 0.0, 0.0])

    def distance(seed, catch_probability):
        advance = dataclasses.replace(
            PHANTOM.advance, catch_probability=catch_probability, hold_waves=4.0, snag=0.0
        )
        return stroke_positions(advance, np.random.default_rng(seed), 40, steep_way)[-1]

    # Held for four waves of the forty on average, then it slips over for good.
    free, caught = ([distance(seed, each) for seed in range(1000)] for each in (0.0, 1.0))
    assert np.mean(caught) == pytest.approx(36 / 40 * np.mean(free), rel=0.03)


def test_the_head_moves_with_the_wave_and_then_rests():
    advance = PHANTOM.advance
    time_s = np.arange(0, 9.6, 0.1)
    head = head_position([1.0, 0.0, 2.0], time_s)
    assert np.all(np.diff(head) >= 0)
    resting = (time_s > 3.2 * advance.grip_fraction) & (time_s < 3.2)
    np.testing.assert_array_equal(head[resting], 1.0)


def test_converter_floors_and_ends_at_its_rails():
    ohms = np.array([[0.0, 12000.0, 1e12, 11999.0]])
    # 12 kOhm against 12 kOhm is half the reference: 512; just below it is floored to 511.
    np.testing.assert_array_equal(counts(PHANTOM.electronics, ohms), [[0, 512, 1023, 511]])


def test_every_parameter_says_its_unit_its_source_and_its_meaning():
    table = yaml.safe_load(DEFAULT_TABLE.read_text(encoding="utf-8"))
    names = [f"{part}.{key}" for part, entries in table.items() for key in entries]
    assert names == parameter_names()
    assert all(entry["meaning"] for entries in table.values() for entry in entries.values())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t["wall"].update(lumen_m=t["wall"].pop("lumen_mm")), r"wall\.lumen_m.*lumen_mm"),
        (lambda t: t["wall"].pop("lumen_mm"), r"wall\.lumen_mm is missing"),
        (lambda t: t["wall"]["lumen_mm"].pop("unit"), r"wall\.lumen_mm: write it as"),
        (lambda t: t["wall"]["lumen_mm"].update(value="wide"), r"'wide' is not a number"),
        (lambda t: t["wall"]["lumen_mm"].update(source="hearsay"), r"'hearsay' is not one of"),
        (lambda t: t.update(wall=None), r"wall: needs parameters"),
    ],
)
def test_a_wrong_table_is_answered_with_name_and_remedy(change, message):
    table = yaml.safe_load(DEFAULT_TABLE.read_text(encoding="utf-8"))
    change(table)
    with pytest.raises(CapsuleError, match=message):
        phantom_from_table(table)


def roughnesses(spread):
    wall = dataclasses.replace(PHANTOM.wall, unevenness_spread=spread)
    return np.log([roughness(wall, np.random.default_rng(seed)) for seed in range(1000)])


def jumps(run_spread):
    jumping = dataclasses.replace(
        PHANTOM.sensor, settling=0.0, drift_per_s=0.0, noise=0.0, resistance_spread=0.0,
        jump=0.01, jumps_per_s=1.0, jump_run_spread=run_spread,
    )  # fmt: skip
    still = np.zeros((4, 500))
    runs = [resistance(jumping, np.random.default_rng(run), still, 10.0) for run in range(300)]
    return np.log(np.std(runs, axis=(1, 2)))


def wanderings(run_spread):
    seat = dataclasses.replace(PHANTOM.seat, strength_spread=0.2, strength_run_spread=run_spread)
    runs = [
        wandering_strength(seat, np.random.default_rng(run), 4, 990, 10.0) for run in range(100)
    ]
    return np.log(np.std(np.log(runs), axis=(1, 2)))


def crests(run_spread):
    wave = dataclasses.replace(PHANTOM.wave, amplitude_spread=0.2, run_spread=run_spread)
    runs = [wave_train(wave, np.random.default_rng(run), 3.2, 200) for run in range(300)]
    return np.log([np.log(run.crests).std() for run in runs])


@pytest.mark.parametrize(
    ("logarithms", "spread", "rel"),
    [(roughnesses, 0.5, 0.2), (jumps, 0.7, 0.2), (wanderings, 1.0, 0.3), (crests, 0.8, 0.2)],
)
def test_some_runs_vary_more_than_others_by_as_much_as_is_set(logarithms, spread, rel):
    varying = logarithms(spread).std() ** 2 - logarithms(0.0).std() ** 2
    assert varying == pytest.approx(spread**2, rel=rel)


def test_the_sensors_settle_together_by_as_much_as_is_set():
    quiet = dataclasses.replace(
        PHANTOM.sensor, settling=0.05, settling_spread=0.0, settling_s=2.0,
        drift_per_s=0.0, noise=0.0, resistance_spread=0.0,
    )  # fmt: skip
    still = np.zeros((4, 100))
    changes = np.array(
        [resistance(quiet, np.random.default_rng(run), still, 10.0) for run in range(400)]
    )
    changes = changes / quiet.resistance_ohm - 1
    assert changes[:, 0, 0].std() == pytest.approx(0.05, rel=0.1)
    np.testing.assert_array_equal(changes, changes[:, :1].repeat(4, axis=1))
    np.testing.assert_allclose(changes[..., 20], changes[..., 0] * math.exp(-1), rtol=1e-9)
