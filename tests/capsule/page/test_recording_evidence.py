"""Tests of what the page holds of one recording alone: its signals and what was judged by."""

import numpy as np
import pytest

from capsule.configuration import read_config_file
from capsule.page.recording_evidence import RecordingResults, peaks, recording_evidence
from capsule.page.stretches import Stretches
from support.packed import unpack
from support.project import ROOT
from support.synthetic import make_recording

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")
CHECK = {"header": {}, "sha256": "0"}


def evidence_of(values, check=CHECK, stretches=None, **shape):
    settings = SETTINGS | {"preprocessing": SETTINGS["preprocessing"] | shape}
    results = RecordingResults(values, check, stretches)
    return recording_evidence("3mm/r01", results, 10.0, settings)


def test_peaks_say_how_high_when_and_how_long():
    envelope = np.array([[0.5, 1.2, 2.0, 1.1], [0.1, 0.2, 0.3, 0.2]])
    rows = peaks(envelope, np.array([0.0, 0.5, 1.0, 1.5]), 1.0)
    assert rows == [[2.0, 1.0, 1.5], [0.3, 1.0, 0.0]]


def test_the_readings_stay_exact_and_the_smooth_signals_are_thinned():
    values = make_recording(3, "3mm/r01", samples=600).values
    drawn = evidence_of(values)
    assert np.array_equal(unpack(drawn["readings"]), values)
    assert drawn["envelope"]["every"] == drawn["matrix"]["every"] == 3
    assert unpack(drawn["envelope"]).shape == unpack(drawn["matrix"]).shape == (4, 200)
    assert (drawn["recording"], drawn["interval_s"], drawn["threshold"]) == ("3mm/r01", 0.1, 1.0)


def test_the_facts_are_those_of_the_file_and_its_header():
    values = make_recording(3, "3mm/r01", samples=400).values
    drawn = evidence_of(values, CHECK | {"header": {"site": "a"}})
    assert drawn["facts"] == {"File": "raw/3mm/r01.csv", "SHA-256": "0", "# site": "a"}


def test_what_the_detectors_judged_by_goes_together():
    recording = make_recording(3, "3mm/r01", samples=600)
    stretches = Stretches(7.0, np.array([0.0, 1.0, 0.5]))
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
