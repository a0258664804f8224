"""A journey along a gut, folded and unfolded: each nodule is caught for itself."""

import numpy as np
import pytest

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.journey import Journey, Nodule
from capsule.phantom.parameters import with_values
from capsule.phantom.simulated_bench import SimulatedBench, bench_with, nodules_of
from capsule.phantom.simulation import SENSORS
from capsule.phantom.wall import wave_height
from capsule.survey import cycle

PHANTOM = read_phantom(DEFAULT_TABLE, [])
# Every mechanism that keeps a state from sample to sample, or from wave to wave.
BUSY = {
    "advance.slip_probability": 0.3, "seat.strength_spread": 0.2, "seat.reseat_spread": 0.2,
    "sensor.hysteresis": 0.3, "sensor.release_peak": 0.3, "sensor.crosstalk": 0.1,
    "sensor.jump": 0.05, "wave.period_spread": 0.1, "wave.missing_probability": 0.05,
}  # fmt: skip


def journey_over(nodules, changes=(), length_mm=300.0, samples=9000):
    phantom = with_values(PHANTOM, dict(changes))
    return Journey(phantom, 1, "test", nodules, SENSORS, samples, length_mm)


@pytest.mark.parametrize("changes", [{}, BUSY], ids=["usual", "busy"])
def test_the_same_seed_gives_the_same_journey_however_it_is_asked_for(changes):
    one, other = (journey_over([Nodule(50, 3)], changes) for _ in range(2))
    parts = [other.advance(samples)[1] for samples in (1, 7, *[8] * 124)]
    np.testing.assert_array_equal(one.advance(1000)[1], np.hstack(parts))


def test_each_nodule_holds_the_capsule_for_itself():
    even = dict.fromkeys(["advance.stroke_spread", "advance.stick_probability"], 0.0)
    even |= {"contact.series_offset_mm": 0.0, "contact.height_offset_mm": 0.0}

    def waits(*places_mm):
        nodules = [Nodule(at_mm, 5) for at_mm in places_mm]
        head_mm = journey_over(nodules, even | {"advance.catch_probability": 1.0}).press(6000)
        return [np.count_nonzero(np.abs(head_mm.head_mm - at_mm) < 30) for at_mm in (60, 160)]

    free, first, both = waits(), waits(60), waits(60, 160)
    assert first[0] > free[0] + 50
    assert both[1] > free[1] + 50
    assert (first[1], both[0]) == pytest.approx((free[1], first[0]), abs=40)


def test_folded_it_goes_back_shows_little_and_goes_on_when_it_is_unfolded():
    journey = journey_over([], {"sensor.noise": 0.0, "sensor.drift_per_s": 0.0})
    out, felt_out = journey.advance(1200)
    journey.fold()
    closing, _ = journey.advance(50)
    back, felt_back = journey.advance(800)
    journey.unfold()
    opening, again = journey.press(50), journey.press(600)
    assert (closing.folded[-1], opening.folded[-1]) == (1, 0)
    assert back.head_mm[-1] - back.head_mm[0] == pytest.approx(-0.4 * 80, rel=0.3)
    assert opening.head_mm[-1] == pytest.approx(opening.head_mm[3], abs=1e-9)
    assert again.head_mm[-1] > again.head_mm[0] + 25
    assert back.compression_mm.max() < out.compression_mm.max()
    assert np.ptp(felt_back[:, 200:], axis=1).max() < 0.2 * np.ptp(felt_out, axis=1).min()
    np.testing.assert_allclose(np.diff(back.wave_mm), 2.5)
    # A crest is at place 0 whenever the wave has been carried by a whole wavelength.
    chance, place = journey._chance, np.array(0.0)
    height = wave_height(PHANTOM.wall, PHANTOM.wave, chance.train, place, out.time_s, chance.phase)
    np.testing.assert_allclose(height, 3.5 * np.cos(2 * np.pi * out.wave_mm / 80), atol=1e-9)


def test_it_stays_at_the_start_of_the_gut_stops_at_its_end_and_stands_without_a_wave():
    journey = journey_over([], {"folding.speed_mm_s": -0.8}, length_mm=40.0)
    journey.press(100)
    journey.fold()
    assert journey.press(600).head_mm[-1] == pytest.approx(0, abs=1e-9)
    journey.unfold()
    assert not journey.at_end
    assert journey.press(1500).head_mm[-1] == 40.0
    assert journey.at_end
    before_mm = journey.press(1).wave_mm[-1]
    journey.stop_wave()
    # At an even ramp of 0.25 s from 2.5 mm a sample.
    assert journey.press(10).wave_mm[-1] - before_mm == pytest.approx(2.5 * (1 + 2.5 / 2))
    assert np.ptp(journey.press(10).wave_mm) == 0


def test_passes_keep_the_nodules_height_unless_it_is_drawn_anew():
    def heights(redrawn):
        journey = journey_over([Nodule(50, 2)] * 300, {"folding.height_redrawn": redrawn})
        passes = [journey._pass]
        for _ in range(2):
            journey.fold()
            journey.unfold()
            passes.append(journey._pass)
        assert len({each.looseness_mm for each in passes}) == 3
        coupling = np.log([bulge.coupling for each in passes for bulge in each.bulges])
        assert coupling.mean() == pytest.approx(0.0, abs=0.02)
        assert coupling.std() == pytest.approx(PHANTOM.contact.coupling_spread, rel=0.05)
        return np.array([[bulge.height_mm for bulge in each.bulges] for each in passes])

    kept, anew = heights(0.0), heights(1.0)
    assert np.ptp(kept, axis=0).max() == 0
    assert kept[0, 0] != kept[0, 1]
    assert (np.ptp(anew, axis=0) > 0).all()
    # Kills: a height that varies more where it is drawn anew, and a coupling around another mean.
    assert anew.mean() == pytest.approx(kept.mean(), rel=0.1)


def test_a_simulated_bench_unfolds_when_nobody_holds_it_and_ends_with_its_numbers():
    bench = SimulatedBench(journey_over([], samples=260), 10.0, {})
    # It folds within 5 s, and holds for 5 s after each command. After all, 100 samples are left.
    course = [("", 10, "unfolded"), (cycle.FOLD, 49, "folding"), (cycle.HOLD, 50, "folded")]
    course += [("", 1, "unfolding"), ("", 49, "unfolding"), ("", 1, "unfolded")]
    for command, count, state in course:
        bench.tell(command)
        assert (bench.read(count).fold, bench.at_end) == (state, False)
    bench.read(1)
    assert bench.at_end
    # There are numbers for a way that is two and a half times as long, at some 0.4 mm/s.
    bench = bench_with(PHANTOM, seed=1, length_mm=400.0, nodules=[], sensors=SENSORS)
    straight = 400 / PHANTOM.advance.speed_mm_s * 10
    assert bench._journey.samples_left == int(2.5 * straight) + 5000


def test_nodules_lie_apart_from_each_other_and_from_the_ends_if_there_is_room():
    for seed in range(20):
        first, second, third = nodules_of(seed, 400.0, [1, 2, 3])
        assert [each.diameter_mm for each in (first, second, third)] == [1, 2, 3]
        assert min(np.diff([0.0, first.at_mm, second.at_mm, third.at_mm, 400.0])) >= 60
    assert nodules_of(1, 400.0, [1]) == nodules_of(1, 400.0, [1]) != nodules_of(2, 400.0, [1])
    assert [each.at_mm for each in nodules_of(1, 100.0, [1, 2, 3])] == [25, 50, 75]
