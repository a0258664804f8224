"""Places from readings: the odometer, the evidence along a way, passes of a known kind."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.detectors.familiar import LEAST_PLACES
from capsule.detectors.files import read_learned
from capsule.detectors.search import passage_of
from capsule.detectors.wave import wave_of
from capsule.engine.configuration import read_config_file
from capsule.engine.project import PROJECT
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import simulate_run
from capsule.survey.gut_evidence import GutEvidence, evidence_along
from capsule.survey.odometer import Odometer, nearest_turn, place_in_wave
from capsule.survey.pass_sizes import PassSizes
from support.learned import healthy_runs, taught_by, teach_familiar, write_learned

CONFIGURATION = read_config_file(PROJECT / "config/config.yaml")
SETTINGS = CONFIGURATION["diagonal"]  # a wave of 80 mm at 25 mm/s, sensors 6.3 mm apart
SPAN = 64
WAVE_MM = 2.5 * np.arange(SPAN)


def felt(head_mm, wave_mm, noise=0.0):
    """Return the readings of four sensors that a wave presses along half of its length."""
    angle = 2 * np.pi * (head_mm - 6.3 * np.arange(4)[:, np.newaxis] - wave_mm) / 80
    gain, rest = np.array([[1.0], [0.7], [1.3], [0.9]]), np.array([[0.2], [1.0], [-3.0], [5.0]])
    return np.random.default_rng(1).normal(rest + gain * np.maximum(np.cos(angle + 0.4), 0), noise)


@given(st.floats(-30, 30), st.floats(0, 80))
def test_a_capsule_at_rest_is_found_whatever_the_phase_of_the_drive(move_mm, phase_mm):
    wave_mm = phase_mm + WAVE_MM
    here, there = (
        place_in_wave(felt(np.full(SPAN, at), wave_mm), wave_mm, 6.3, 80.0) for at in (0.0, move_mm)
    )
    assert nearest_turn(there - here, move_mm, 80.0) == pytest.approx(move_mm, abs=0.05)


def test_it_follows_a_noisy_capsule_over_several_wavelengths():
    time = np.arange(4000)
    head_mm, wave_mm = 0.055 * time, 2.5 * time
    pressed = felt(head_mm, wave_mm, noise=0.05) + 0.0005 * time  # drift
    pressed[2, 3000:3010] = np.nan
    odometer, errors, fix = Odometer(SETTINGS, 10.0, 0.0), [], 0.0
    for end in range(SPAN, time.size, 8):
        some = slice(end - SPAN, end)
        fix = odometer.fix(end - 1, pressed[:, some], wave_mm[some], fix)
        errors.append(fix - head_mm[end - SPAN // 2])
    assert np.std(errors) < 0.3
    assert np.ptp(odometer.way(time[100:-100]) - head_mm[100:-100]) < 2


def test_the_newest_wave_alone_gives_a_newer_position():
    # A jump in the newer half; the fix over two waves shows half of it.
    head_mm = np.where(np.arange(SPAN) < SPAN // 2, 10.0, 13.0)
    pressed = felt(head_mm, WAVE_MM, noise=0.02) + 0.001 * np.arange(SPAN)
    odometer = Odometer(SETTINGS, 10.0, 10.0)
    odometer.origin_mm = place_in_wave(felt(np.zeros(SPAN), WAVE_MM), WAVE_MM, 6.3, 80.0)
    assert np.isnan(odometer.newest(pressed, WAVE_MM))
    assert odometer.fix(63, pressed, WAVE_MM, 10.0) == pytest.approx(11.5, abs=0.4)
    assert odometer.newest(pressed, WAVE_MM) == pytest.approx(13.0, abs=0.4)
    assert np.isnan(odometer.newest(0 * pressed, WAVE_MM))


def test_a_dead_sensor_is_left_out_and_three_dead_ones_say_nothing():
    pressed, places_mm = felt(np.full(SPAN, 12.0), WAVE_MM), []
    for dead, reading in ((slice(0), 0.0), (1, 7.0), (2, np.nan), (3, 0.0)):
        pressed[dead] = reading
        places_mm.append(place_in_wave(pressed, WAVE_MM, 6.3, 80.0))
    assert places_mm == pytest.approx([places_mm[0]] * 3 + [np.nan], abs=0.05, nan_ok=True)


@pytest.mark.parametrize("name", ["3mm/r01", "3mm/r02"])
def test_it_is_highest_at_the_nodule_and_like_the_diagonal_detectors(name):
    run = simulate_run(read_phantom(DEFAULT_TABLE, []), 3.0, 900, name)
    values, time = run.counts.astype(float), np.arange(run.head_mm.size)
    along = evidence_along(values, 10.0, SETTINGS, lambda at: np.interp(at, time, run.head_mm))
    place_mm, evidence = along.best()
    assert place_mm == pytest.approx(run.nodule_at_mm, abs=2.5)
    # The detector searches speeds, so its evidence may be slightly higher.
    passage = passage_of(wave_of(values, 10.0, SETTINGS), SETTINGS)
    assert evidence == pytest.approx(passage.evidence, rel=0.5)
    # Without a wave on every sensor there is none.
    for lost in (500.0, np.nan):
        values[2] = lost
        assert evidence_along(values, 10.0, SETTINGS, lambda at: at) is None


def test_the_best_place_is_the_middle_of_the_top():
    places, evidence = np.arange(100.0, 120.0), np.zeros(20)
    evidence[4:9], evidence[15] = [0.6, 1.0, 0.9, 0.6, 0.4], 0.8
    middle_mm = (0.6 * 104 + 105 + 0.9 * 106 + 0.6 * 107) / 3.1
    assert GutEvidence(places, evidence).best() == (pytest.approx(middle_mm), 1.0)
    assert GutEvidence(places, evidence - 2).best() == (105.0, -1.0)
    assert GutEvidence(places, evidence).without([105.0], 3.0).best() == (115.0, 0.8)
    assert np.isnan(GutEvidence(places, evidence).within(200.0, 300.0).best()).all()


def test_one_strange_pass_makes_the_place_strange(tmp_path):
    write_learned(tmp_path, CONFIGURATION, taught_by())
    teach_familiar(tmp_path, healthy_runs(LEAST_PLACES), CONFIGURATION)
    learned = read_learned(tmp_path / "detectors.json")
    (usual,) = healthy_runs(1).values()
    # A pass too short to show a wave is not known.
    slow, short = np.repeat(usual, 2, axis=1)[:, :900], usual[:, :60]
    sizes = PassSizes(learned, SETTINGS, 10.0)
    assert sizes.familiarity([usual, slow]) == sizes.familiarity([slow])
    passes = ([usual], [usual, slow], [short, slow], [usual, short], [])
    assert [sizes.familiarity(each).familiar for each in passes] == [True, False, False, None, None]
    # Without what was learned on this bench, nobody can tell.
    for known, settings in (({}, SETTINGS), (learned, SETTINGS | {"pitch_mm": 7.0})):
        assert PassSizes(known, settings, 10.0).familiarity([usual]).familiar is None
