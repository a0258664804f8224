"""Tests of what the page holds of one recording alone: its signals and what was judged by."""

import numpy as np
import pytest

from capsule.detectors.search import passage_of
from capsule.detectors.wave import wave_of
from capsule.engine.configuration import read_config_file
from capsule.page.packing import inflated, unpack
from capsule.page.plot_data import along_gut, peaks, plot_data
from capsule.seeding import generator
from support.project import ROOT
from support.synthetic import make_recording

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")
DIAGONAL = SETTINGS["diagonal"]
CHECK = {"header": {}, "sha256": "0", "at_ends": [0.0] * 4}


def wave_readings(samples=800, deeper=0.0, sensors=4):
    """Return readings under a wave, with deeper presses at one place.

    Each sensor passes the place 150 samples after the one before it.
    """
    time = np.arange(samples)
    wave = np.sin(2 * np.pi * time / 32) + 0.2 * np.sin(4 * np.pi * time / 32)
    noise = generator(1, "readings").normal(0, 0.05, (sensors, samples))
    middle = 150 + 150 * np.arange(sensors)[:, np.newaxis]
    bump = deeper * np.exp(-(((time - middle) / 40) ** 2))
    return 500 - 20 * (1 + bump) * (wave + noise)


def evidence_of(values, check=CHECK, stretches=None, **shape):
    settings = SETTINGS | {"preprocessing": SETTINGS["preprocessing"] | shape}
    wave = wave_of(values, 10.0, settings["diagonal"])
    made = plot_data("3mm/r01", values, wave, check, stretches, settings)
    assert made["quality"] == "no gap, no loose sensor"
    assert made["measures"]["rail"] == check["at_ends"]
    return inflated(made["drawn"])


def test_peaks_say_how_high_when_and_how_long():
    envelope = np.array([[0.5, 1.2, 2.0, 1.1], [0.1, 0.2, 0.3, 0.2]])
    rows = peaks(envelope, np.array([0.0, 0.5, 1.0, 1.5]), 1.0)
    assert rows == [[2.0, 1.0, 1.5], [0.3, 1.0, 0.0]]


def test_the_readings_stay_exact_the_smooth_signals_are_thinned_and_the_file_is_named():
    values = make_recording(3, "3mm/r01", samples=600).values
    drawn = evidence_of(values, CHECK | {"header": {"site": "a"}})
    assert np.array_equal(unpack(drawn["readings"]), values)
    assert drawn["envelope"]["every"] == 3
    assert unpack(drawn["envelope"]).shape == (4, 200)
    assert (drawn["recording"], drawn["interval_s"], drawn["threshold"]) == ("3mm/r01", 0.1, 1.0)
    assert drawn["facts"] == {"File": "raw/3mm/r01.csv", "SHA-256": "0", "# site": "a"}


def test_what_the_detectors_judged_by_goes_together():
    recording = make_recording(3, "3mm/r01", samples=600)
    stretches = 7.0, np.array([0.0, 1.0, 0.5])
    check = CHECK | {"header": recording.header}
    drawn = evidence_of(recording.values, check, stretches=stretches)
    assert drawn["unit"] == "counts"
    beats, losses = drawn["beats"], drawn["stretches"]
    wave_s = SETTINGS["diagonal"]["wavelength_mm"] / SETTINGS["diagonal"]["wave_speed_mm_s"]
    # The first stretch is two waves long and begins with the first beat.
    assert losses["first_s"] - beats["first_s"] == pytest.approx(7 / 8 * wave_s, abs=1e-3)
    assert losses["step_s"] == pytest.approx(wave_s / 2)
    assert losses["score"] == 7.0
    assert unpack(losses)[0] == pytest.approx([0.0, 1.0, 0.5], abs=0.003)
    assert evidence_of(recording.values / 204.8)["unit"] == "V"


def test_without_a_wave_there_are_no_beats_to_draw():
    drawn = evidence_of(np.outer([1.0, 2.0, 3.0, 4.0], np.arange(60.0)), window=20)
    assert drawn["beats"] is drawn["gut"] is drawn["stretches"] is None


def gut_of(**wave):
    """Return beats and gut as the page draws them, with their unpacked values."""
    beats, gut = along_gut(wave_of(wave_readings(**wave), 10, DIAGONAL), 10, DIAGONAL)
    return beats, gut, unpack(beats), unpack(gut)[0]


@pytest.mark.parametrize("deeper", [0.0, 0.8])
def test_the_highest_score_along_the_gut_is_that_of_the_verdict(deeper):
    passage = passage_of(wave_of(wave_readings(deeper=deeper), 10, DIAGONAL), DIAGONAL)
    beats, gut, _, evidence = gut_of(deeper=deeper)
    assert evidence.max() == pytest.approx(passage.evidence, abs=1e-5)
    assert gut["step_mm"] * evidence.argmax() == passage.location_mm
    assert beats["passed_s"][0] == round(passage.location_samples / 10, 2)


def test_beats_are_drawn_in_usual_depths_and_deeper_where_a_sensor_passes_the_place():
    beats, _, depth, _ = gut_of(deeper=0.8)
    assert np.median(depth, axis=1) == pytest.approx(np.ones(4), abs=0.01)
    deepest_s = beats["first_s"] + beats["step_s"] * depth.argmax(axis=1)
    assert deepest_s == pytest.approx([15.0, 30.0, 45.0, 60.0], abs=1.6)
    assert beats["passed_s"] == pytest.approx([15.0, 30.0, 45.0, 60.0], abs=3.2)
    assert depth.max(axis=1) == pytest.approx(np.full(4, 1.8), abs=0.3)


def test_a_sensor_that_never_comes_to_the_place_passes_it_at_no_time():
    # The run ends before the fourth sensor reaches the place where the first three were pressed.
    *passed, last = gut_of(samples=520, deeper=1.5)[0]["passed_s"]
    assert None not in passed and last is None
