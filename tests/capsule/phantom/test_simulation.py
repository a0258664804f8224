"""Whole simulated runs, the command that writes them, and journeys along a gut."""

import io

import numpy as np
import pytest

from capsule.errors import CapsuleError
from capsule.method.preprocessing import preprocess
from capsule.phantom import files as phantom
from capsule.phantom.journey import Journey, Nodule
from capsule.phantom.parameters import with_values
from capsule.phantom.simulated_bench import SimulatedBench, nodules_of
from capsule.phantom.simulation import SENSORS, planned_runs, recording_of, simulate_run
from capsule.phantom.wall import wave_height
from capsule.recordings.recording import format_recording, read_recording, source_of
from capsule.survey import cycle
from support.command import run_command
from support.project import ROOT

PHANTOM = phantom.read_phantom(phantom.DEFAULT_TABLE, [])
RANDOM = """wall.unevenness_mm contact.series_offset_mm contact.height_offset_mm
    contact.coupling_spread contact.wander_mm advance.speed_spread advance.stroke_spread
    advance.stick_probability advance.catch_probability sensor.settling sensor.drift_per_s
    sensor.noise"""
STILL = dict.fromkeys(RANDOM.split(), 0.0)
QUIET = with_values(PHANTOM, STILL)


def test_same_seed_and_bench_same_bytes_whatever_else_is_made(tmp_path):
    def made(*options):
        run_command("simulate", "--force", "--out", tmp_path, "--runs", 1, "--sizes", 3, *options)
        return (tmp_path / "3mm/r01.csv").read_bytes()

    uneven, changed = ["--bench", "uneven-wall"], ["--set", "sensor.noise=0.1"]
    first, *others = (made(*each) for each in ([], ["--seed", 2], uneven, [*uneven, *changed]))
    assert made("--runs", 2, "--sizes", 0, 3) == first
    read = [read_recording(io.BytesIO(each), sensors=4) for each in (first, *others)]
    assert len({recording.values.tobytes() for recording in read}) == 4
    assert "bench uneven-wall, seed 1" in source_of(read[2].header)
    assert b"bench" not in first


def test_a_file_says_that_it_is_simulated_and_of_which_archive_and_reads_back():
    run, healthy = (simulate_run(PHANTOM, size_mm, 7, "2mm/r01") for size_mm in (2.0, 0.0))
    for bench, archive in ((None, "simulated-7"), ("uneven-wall", "uneven-wall-7")):
        content = format_recording(recording_of(run, PHANTOM, 7, "2mm/r01", bench))
        recording = read_recording(io.BytesIO(content), sensors=4)
        header = recording.header
        assert (header["source"], header["simulator_seed"]) == ("simulated phantom", "7")
        assert (header["site"], header["setup"]) == (f"{archive}/2mm/r01", f"{archive}/2mm")
        assert float(header["nodule_at_mm"]) == pytest.approx(run.nodule_at_mm, abs=0.01)
        np.testing.assert_array_equal(recording.values, run.counts)
        np.testing.assert_allclose(np.diff(recording.time_s), 0.1)
    assert "nodule_at_mm" not in recording_of(healthy, PHANTOM, 7, "2mm/r01").header


def test_a_larger_nodule_presses_more_and_gives_a_larger_signal():
    runs = [simulate_run(QUIET, size, 1, "quiet") for size in (0, 1, 2, 4)]
    assert (np.diff([run.compression_mm.max() for run in runs]) > 0).all()
    shape = {"window": 84, "threshold": 1.0, "length": 1000}
    # The matrix is normalized: what 1 mm adds is less than what a run's own length changes.
    healthy, *signals = [preprocess(run.counts.astype(float), **shape).sum() for run in runs]
    assert (np.diff(signals) > 0).all()
    assert signals[-1] > 4 * healthy
    # However fast, a run has two samples.
    fast = with_values(QUIET, {"advance.speed_mm_s": 1e5, "advance.lead_mm": 0.0})
    assert simulate_run(fast, 0.0, 1, "fast").time_s.size == 2


def test_each_pass_has_its_own_draws_and_each_set_up_its_own_height():
    passes = planned_runs([3], 1, 2)
    assert [(run.name, run.site) for run in passes] == [(f"3mm/r01p{n}", "3mm/r01") for n in (1, 2)]
    first, second = (simulate_run(PHANTOM, 3.0, 1, run.site, run.attempt) for run in passes)
    assert first.counts.tobytes() != second.counts.tobytes()
    planned = planned_runs([0, 2], [2, 7], 1, [1, 3], "h")
    assert [run.name for run in planned[1::7]] == ["0mm/h02", "2mm/h07"]
    setups = 2 * ["0mm"] + 3 * ["2mm"] + 2 * ["2mm/2"] + 2 * ["2mm/3"]
    assert [run.setup for run in planned] == setups
    # Numbers that do not fit are refused.
    for runs, setups, told in (([2] * 3, 1, "3 numbers for 2"), (2, [1, 3], "need as many")):
        with pytest.raises(CapsuleError, match=told):
            planned_runs([0, 2], runs, 1, setups)
    set_up = with_values(QUIET, {"contact.series_offset_mm": 0.8})
    usual, *others = (
        [simulate_run(set_up, 2.0, 1, run, setup=name).compression_mm.max() for run in "ab"]
        for name in (None, "2mm", "2mm/2", "2mm/3")
    )
    assert usual == others[0]
    assert np.diff(np.sort(others, axis=0)[:, 0]).min() > 3 * np.ptp(others, axis=1).max()


def test_existing_files_are_kept_unless_forced(tmp_path):
    (kept := tmp_path / "1mm/r01.csv").parent.mkdir()
    kept.write_text("mine")
    options = "simulate", "--out", tmp_path, "--sizes", 0, 1, "--runs", 1
    with pytest.raises(CapsuleError, match=r"r01\.csv exists; nothing was written.*--force"):
        run_command(*options)
    assert kept.read_text() == "mine"
    assert not (tmp_path / "0mm").exists()
    run_command(*options, "--force")
    assert kept.read_text() != "mine"


@pytest.mark.parametrize(
    ("runs", "options"), [(2, ["--runs", 2]), pytest.param(20, [], marks=pytest.mark.slow)]
)
def test_the_archive_that_ships_is_what_seed_1_gives(tmp_path, capsys, runs, options):
    run_command("simulate", "--out", tmp_path, "--seed", 1, *options)
    told = f"\rsimulated {6 * runs} of {6 * runs} recordings in {tmp_path}/\n"
    assert capsys.readouterr().err == told
    made = [f"{size}mm/r{run:02d}.csv" for size in range(6) for run in range(1, runs + 1)]
    assert sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.csv")) == made
    for name in made:
        assert (tmp_path / name).read_bytes() == (ROOT / "raw" / name).read_bytes(), name


# A journey along a gut, folded and unfolded: each nodule is caught for itself.

# Every mechanism that keeps a state from sample to sample, or from wave to wave.
BUSY = {
    "advance.slip_probability": 0.3, "seat.strength_spread": 0.2, "seat.reseat_spread": 0.2,
    "sensor.hysteresis": 0.3, "sensor.release_peak": 0.3, "sensor.crosstalk": 0.1,
    "sensor.jump": 0.05, "wave.period_spread": 0.1, "wave.missing_probability": 0.05,
}  # fmt: skip


def journey_over(nodules, changes=(), length_mm=300.0, samples=9000):
    phantom = with_values(PHANTOM, dict(changes))
    return Journey(phantom, 1, "test", nodules, SENSORS, samples, length_mm)


def test_the_same_seed_gives_the_same_journey_however_it_is_asked_for():
    one, other = (journey_over([Nodule(50, 3)], BUSY) for _ in range(2))
    parts = [other.advance(samples)[1] for samples in (1, 7, *[8] * 124)]
    np.testing.assert_array_equal(one.advance(1000)[1], np.hstack(parts))


def test_each_nodule_holds_the_capsule_for_itself():
    def waits(*places_mm):
        nodules = [Nodule(at_mm, 5) for at_mm in places_mm]
        head_mm = journey_over(nodules, STILL | {"advance.catch_probability": 1.0}).press(6000)
        return [np.count_nonzero(np.abs(head_mm.head_mm - at_mm) < 30) for at_mm in (60, 160)]

    free, first, both = waits(), waits(60), waits(60, 160)
    assert first[0] > free[0] + 50 and both[1] > free[1] + 50
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
    at_start = journey._chance.train, np.array(0.0), out.time_s, journey._chance.phase
    height = wave_height(PHANTOM.wall, PHANTOM.wave, *at_start)
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
        journey.fold()
        journey.unfold()
        passes.append(journey._pass)
        assert passes[0].looseness_mm != passes[1].looseness_mm
        coupling = np.log([bulge.coupling for each in passes for bulge in each.bulges])
        assert coupling.mean() == pytest.approx(0.0, abs=0.025)
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


def test_nodules_lie_apart_from_each_other_and_from_the_ends_if_there_is_room():
    for seed in range(20):
        first, second, third = nodules_of(seed, 400.0, [1, 2, 3])
        assert [each.diameter_mm for each in (first, second, third)] == [1, 2, 3]
        assert min(np.diff([0.0, first.at_mm, second.at_mm, third.at_mm, 400.0])) >= 60
    assert nodules_of(1, 400.0, [1]) == nodules_of(1, 400.0, [1]) != nodules_of(2, 400.0, [1])
    assert [each.at_mm for each in nodules_of(1, 100.0, [1, 2, 3])] == [25, 50, 75]
