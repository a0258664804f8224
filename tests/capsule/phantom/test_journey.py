"""A journey along a gut: a run as it was while unfolded, and each nodule caught for itself."""

from dataclasses import dataclass

import numpy as np
import pytest
import yaml

from capsule.phantom import contact as touch
from capsule.phantom.advance import Strokes, draw_holds, draw_strokes, slips_back
from capsule.phantom.bulge import bulge_of
from capsule.phantom.chance import Chance, Nodule, Pass
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.journey import Journey
from capsule.phantom.parameters import with_values
from capsule.phantom.pressing import Pressing, UnevenWalls
from capsule.phantom.seat import reseated_strength, wandering_strength
from capsule.phantom.sensor import Unloaded, draw_unloaded
from capsule.phantom.simulation import SENSORS, simulate_run
from capsule.phantom.wall import draw_unevenness, roughness, wave_period
from capsule.phantom.wave import cam_time, wave_train
from capsule.seeding import generator

PHANTOM = read_phantom(DEFAULT_TABLE, [])
# Every mechanism that keeps a state from sample to sample, or from wave to wave.
BUSY = {
    "advance.slip_probability": 0.3, "seat.strength_spread": 0.2, "seat.reseat_spread": 0.2,
    "sensor.hysteresis": 0.3, "sensor.release_peak": 0.3, "sensor.crosstalk": 0.1,
    "sensor.jump": 0.05, "wave.period_spread": 0.1, "wave.missing_probability": 0.05,
}  # fmt: skip


@dataclass
class FateOfARun:
    """Random numbers of one run of an archive, drawn as `simulate_run` draws them."""

    pressing: Pressing
    strokes: Strokes
    folded_mm: np.ndarray
    slips_mm: np.ndarray
    wander: np.ndarray
    strength: np.ndarray
    unloaded: Unloaded
    only_pass: Pass

    def draw_pass(self, number):
        """Return the only pass of a run."""
        assert number == 1
        return self.only_pass


def fate_of(phantom, nodule_mm, seed, site, samples):
    """Draw the run's numbers from its own streams, in the order of `simulate_run`."""

    def draw(subject):
        return generator(seed, "phantom", site, "1", subject)

    wall, contact, advance = phantom.wall, phantom.contact, phantom.advance
    rate_hz, longest = phantom.electronics.rate_hz, int(advance.longest_samples)
    place = generator(seed, "phantom", site)
    series = generator(seed, "phantom", f"{nodule_mm:g}mm", "series")
    seat = draw("seat")
    lead_mm = advance.lead_mm + seat.normal(0.0, advance.lead_spread_mm)
    coupling = np.exp(seat.normal(0.0, contact.coupling_spread, SENSORS))
    offset_mm = series.normal(0.0, contact.series_offset_mm)
    offset_mm += seat.normal(0.0, contact.height_offset_mm)
    phase = seat.uniform(0.0, 2 * np.pi)
    offset_mm += touch.stray_offset(contact, draw("stray"))
    period_s = wave_period(wall)
    waves = int(np.ceil(longest / rate_hz / period_s)) + 1
    train = wave_train(phantom.wave, draw("waves"), period_s, waves)
    slips_mm = slips_back(advance, draw("slips"), period_s, waves)
    strokes_from = draw("advance")
    strokes = draw_strokes(advance, strokes_from, period_s, waves, train.crests > 0)
    shifts = draw("wander")
    wander = touch.seat_wander(contact, shifts, SENSORS, longest, rate_hz)
    number = (cam_time(train, np.arange(samples) / rate_hz) / period_s).astype(int)
    strength = wandering_strength(phantom.seat, draw("strength"), SENSORS, longest, rate_hz)
    strength = strength[:, :samples] * reseated_strength(
        phantom.seat, draw("reseat"), SENSORS, slips_mm, number
    )
    bulge = bulge_of(
        contact, wall, phantom.origami, nodule_mm=nodule_mm, at_mm=max(lead_mm, 0.0),
        height_offset_mm=offset_mm, coupling=coupling,
    )  # fmt: skip
    rough = roughness(wall, generator(seed, "phantom", site, "roughness"))
    walls = UnevenWalls(rough, draw_unevenness(wall, place), draw_unevenness(wall, place))
    return FateOfARun(
        Pressing(wall, phantom.wave, contact, walls, train, phase),
        strokes,
        np.zeros(waves),
        slips_mm,
        wander[:, :samples],
        strength,
        draw_unloaded(phantom.sensor, draw("sensor"), (SENSORS, samples), rate_hz),
        Pass(
            (bulge,), draw_holds(advance, strokes_from, SENSORS), touch.looseness(contact, shifts)
        ),
    )


@pytest.mark.parametrize("changes", [{}, BUSY], ids=["usual", "busy"])
@pytest.mark.parametrize("nodule_mm", [0, 1, 2, 3, 4, 5])
def test_always_unfolded_over_one_run_it_gives_the_archives_readings(nodule_mm, changes):
    phantom = with_values(PHANTOM, changes)
    for number in (1, 2, 3):
        site = f"{nodule_mm}mm/r{number:02d}"
        run = simulate_run(phantom, nodule_mm, 1, site)
        fate = fate_of(phantom, nodule_mm, 1, site, run.time_s.size)
        journey = Journey(phantom, fate, 1000.0)
        stretches = []
        lengths = np.random.default_rng(number).integers(1, 40, 1000).tolist()
        while journey.samples_left:
            stretches.append(journey.advance(min(lengths.pop(), journey.samples_left)))
        head_mm = np.concatenate([stretch.head_mm for stretch in stretches])
        np.testing.assert_allclose(head_mm, run.head_mm, atol=1e-9)
        readings = np.concatenate([stretch.counts for stretch in stretches], axis=1)
        np.testing.assert_array_equal(readings, run.counts)


def test_all_of_the_folding_is_assumed_within_a_plausible_range():
    table = yaml.safe_load(DEFAULT_TABLE.read_text(encoding="utf-8"))["folding"]
    for name, entry in table.items():
        low, high = entry["plausible"]
        assert entry["source"] == "assumed", name
        assert low <= entry["value"] <= high, name


def journey_over(nodules, length_mm=300.0, samples=9000, seed=1, **changes):
    phantom = with_values(PHANTOM, {name.replace("__", "."): v for name, v in changes.items()})
    return Journey(phantom, Chance(phantom, seed, "test", nodules, SENSORS, samples), length_mm)


def test_the_same_seed_gives_the_same_journey_however_it_is_asked_for():
    one, other = journey_over([Nodule(50, 3)]), journey_over([Nodule(50, 3)])
    whole = one.advance(1000)
    parts = [other.advance(8) for _ in range(125)]
    np.testing.assert_array_equal(whole.counts, np.hstack([part.counts for part in parts]))


def test_each_nodule_holds_the_capsule_for_itself():
    def waits(nodules):
        journey = journey_over(
            nodules, advance__catch_probability=1.0, advance__stroke_spread=0.0,
            advance__stick_probability=0.0, contact__series_offset_mm=0.0,
            contact__height_offset_mm=0.0,
        )  # fmt: skip
        head_mm = journey.advance(6000).head_mm
        return np.array([np.count_nonzero(np.abs(head_mm - at_mm) < 30) for at_mm in (60, 160)])

    free, first, both = waits([]), waits([Nodule(60, 5)]), waits([Nodule(60, 5), Nodule(160, 5)])
    assert first[0] > free[0] + 50
    assert first[1] == pytest.approx(free[1], abs=40)
    assert both[0] == pytest.approx(first[0], abs=40)
    assert both[1] > free[1] + 50


def test_folded_it_goes_back_shows_little_and_goes_on_when_it_is_unfolded():
    journey = journey_over([], sensor__noise=0.0, sensor__drift_per_s=0.0)
    out = journey.advance(1200)
    journey.fold()
    closing = journey.advance(50)
    back = journey.advance(800)
    journey.unfold()
    opening = journey.advance(50)
    again = journey.advance(600)
    assert closing.folded[-1] == 1
    assert opening.folded[-1] == 0
    assert back.head_mm[-1] - back.head_mm[0] == pytest.approx(-0.4 * 80, rel=0.3)
    assert opening.head_mm[-1] == pytest.approx(opening.head_mm[3], abs=1e-9)
    assert again.head_mm[-1] > again.head_mm[0] + 25
    assert np.ptp(back.counts[:, 200:], axis=1).max() < 0.2 * np.ptp(out.counts, axis=1).min()
    np.testing.assert_allclose(np.diff(back.wave_mm), 2.5)


def test_a_folded_capsule_that_is_carried_forward_does_not_come_back():
    journey = journey_over([], folding__speed_mm_s=0.3)
    journey.advance(600)
    journey.fold()
    head_mm = journey.advance(600).head_mm
    assert head_mm[-1] > head_mm[0] + 10


def test_it_stays_at_the_start_of_the_gut_and_stops_at_its_end():
    journey = journey_over([], length_mm=40.0, folding__speed_mm_s=-0.8)
    journey.advance(100)
    journey.fold()
    assert journey.advance(600).head_mm[-1] == pytest.approx(0, abs=1e-9)
    journey.unfold()
    assert not journey.at_end
    assert journey.advance(1500).head_mm[-1] == 40.0
    assert journey.at_end


def test_passes_keep_the_nodules_height_unless_it_is_drawn_anew():
    def heights(redrawn):
        phantom = with_values(PHANTOM, {"folding.height_redrawn": redrawn})
        chance = Chance(phantom, 1, "test", [Nodule(50, 2), Nodule(90, 2)], SENSORS, 100)
        passes = [chance.draw_pass(number) for number in (1, 2, 3)]
        assert len({each.looseness_mm for each in passes}) == 3
        return np.array([[bulge.height_mm for bulge in each.bulges] for each in passes])

    kept, anew = heights(0.0), heights(1.0)
    assert np.ptp(kept, axis=0).max() == 0
    assert kept[0, 0] != kept[0, 1]
    assert np.ptp(anew, axis=0).min() > 0
