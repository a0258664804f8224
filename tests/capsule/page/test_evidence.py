"""Tests of the data that the page holds of each recording: exact, small and harmless."""

import json

import numpy as np
import pytest

from capsule.detectors.beat_series import WINDOWS_A_WAVE
from capsule.detectors.stretches import STEP, Stretches
from capsule.page import evidence
from capsule.page.beside import stands_beside
from capsule.page.nearest_templates import NearestTemplate
from capsule.particles import Particle
from capsule.stages import preprocess_run
from edges.config_files import read_config_file
from support.packed import unpack
from support.project import ROOT
from support.synthetic import make_recording

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")
PARTICLE = Particle(np.ones(4) / 3, np.full(4, 0.3), np.full(3, 401 / 3), np.full(4, 29 / 3))


def test_peaks_say_how_high_when_and_how_long():
    envelope = np.array([[0.5, 1.2, 2.0, 1.1], [0.1, 0.2, 0.3, 0.2]])
    rows = evidence.peaks(envelope, np.array([0.0, 0.5, 1.0, 1.5]), 1.0)
    assert rows == [[2.0, 1.0, 1.5], [0.3, 1.0, 0.0]]


def test_1200_recordings_of_full_length_stay_below_25_megabytes():
    values = make_recording(3, "3mm/r01", samples=1000).values
    run = preprocess_run("3mm/r01", "3 mm", values, rate_hz=10, window=84, threshold=1.0)
    said = dict.fromkeys(evidence.VERDICT_KEYS)
    said |= {"detector": "template_threshold", "scheme": "leave_one_out", "predicted_mm": 3.0}
    said["details"] = "estimated 3.1 mm, probability 97.6 %, place 12.8 s, 5.5 mm"
    said |= dict.fromkeys(("score", "threshold", "location_mm"), 1234.567)
    verdicts = [said | {"distances": [0.123456789012345] * 6}] * 2
    verdicts += [said | {"distances": []}] * 6
    fit = {"first_peak": 150, "lag": 981}
    by_size = dict.fromkeys((1.0, 2.0, 3.0, 4.0, 5.0), PARTICLE)
    templates = {"leave_one_out": by_size, "resubstitution": by_size}
    beats = int(1000 / 32 * WINDOWS_A_WAVE)
    stretches = Stretches(7.0, 3.5, STEP, np.linspace(0, 1, beats // STEP))
    stored = evidence.Stored(values, {}, (fit, PARTICLE), templates, stretches)
    nearest = {scheme: NearestTemplate(3.0, PARTICLE, 981) for scheme in templates}
    judged = evidence.what_was_judged(run, stored, nearest, SETTINGS)
    assert None not in judged.values()
    content = evidence.recording_evidence(run, 1.0, judged, verdicts, {"SHA-256": "0" * 64})
    one = len(evidence.to_json(content))
    # The figures take 2.5 MB, a row of the table less than 1 kB.
    assert 1200 * (one + 1000) + 2.5e6 < 25e6
    assert not stands_beside(1200, SETTINGS)
    too_many = int((25e6 - 2.5e6) / (one + 1000)) + 1
    assert stands_beside(too_many, SETTINGS)


def test_of_an_archive_the_page_shows_every_accepted_recording_and_the_fit_where_there_is_one():
    values = make_recording(3, "3mm/r01", samples=400).values
    particle = Particle(np.ones(4), np.full(4, 0.3), np.full(3, 100.0), np.full(4, 9.0))
    fit = {"first_peak": 50, "lag": 501, "rmse": 0.1, "rmse_initial": 0.2, "accepted_moves": 3}
    stored = {
        "0mm/r01": evidence.Stored(values, {"site": "a"}),
        "3mm/r01": evidence.Stored(values, {}, (fit, particle)),
    }
    row = {"accepted": True, "samples": 400, "sha256": "0", "size": "3 mm", "nodule_at_mm": 4.5}
    rows = [
        row | {"recording": "0mm/r01", "size_mm": 0.0, "nodule_at_mm": None},
        row | {"recording": "2mm/bad", "accepted": False, "samples": 0},
        row | {"recording": "3mm/r01", "size_mm": 3.0},
    ]
    said = dict.fromkeys(evidence.VERDICT_KEYS) | {"detector": "template", "predicted_mm": 3.0}
    settings = SETTINGS | {
        "preprocessing": {"window": 40, "threshold": 1.0, "length": 500},
        "recording": {"rate_hz": 10, "sensors": 4},
    }
    made = evidence.archive_evidence(rows, {"3mm/r01": [said]}, [], stored.__getitem__, settings)
    healthy, nodule = (json.loads(content) for _, content in made)
    assert [each["recording"] for each in (healthy, nodule)] == ["0mm/r01", "3mm/r01"]
    assert healthy["title"] == "no nodule" and nodule["title"] == "3 mm nodule"
    assert (healthy["row"], nodule["row"]) == (0, 2)
    assert (healthy["nodule_at_mm"], nodule["nodule_at_mm"]) == (None, 4.5)
    assert healthy["facts"] == {"File": "raw/0mm/r01.csv", "SHA-256": "0", "# site": "a"}
    assert healthy["fitted"] is None and healthy["verdicts"] == []
    assert "RMSE 0.1000" in nodule["facts"]["Fit"] and nodule["verdicts"] == [said]
    # At the lag L + 1 the first peak lies at the sample u, counted from 1.
    assert nodule["fitted"]["peak"] == [49, 149, 249, 349]


def test_what_the_detectors_judged_by_goes_together():
    recording = make_recording(3, "3mm/r01", samples=600)
    run = preprocess_run("3mm/r01", "", recording.values, rate_hz=10, window=84, threshold=1.0)
    stretches = Stretches(7.0, 3.5, STEP, np.array([0.0, 1.0, 0.5]))
    stored = evidence.Stored(recording.values, recording.header, stretches=stretches)
    judged = evidence.what_was_judged(run, stored, {}, SETTINGS)
    assert judged["unit"] == "counts"
    assert judged["fitted"] is None and judged["templates"] == {}
    beats, drawn = judged["beats"], judged["stretches"]
    wave_s = SETTINGS["diagonal"]["wavelength_mm"] / SETTINGS["diagonal"]["wave_speed_mm_s"]
    # The first stretch is two waves long and begins with the first beat.
    assert drawn["first_s"] - beats["first_s"] == pytest.approx(7 / 8 * wave_s, abs=1e-3)
    assert drawn["step_s"] == pytest.approx(wave_s / 2)
    assert drawn["score"] == 7.0
    assert unpack(drawn)[0] == pytest.approx([0.0, 1.0, 0.5], abs=0.003)
    in_volts = evidence.Stored(recording.values / 204.8, {})
    assert evidence.what_was_judged(run, in_volts, {}, SETTINGS)["unit"] == "V"


def test_without_a_wave_there_are_no_beats_to_draw():
    values = np.outer([1.0, 2.0, 3.0, 4.0], np.arange(60.0))
    run = preprocess_run("3mm/r01", "", values, rate_hz=10, window=20, threshold=1.0)
    judged = evidence.what_was_judged(run, evidence.Stored(values, {}), {}, SETTINGS)
    assert judged["beats"] is judged["gut"] is judged["stretches"] is None


def test_json_in_a_script_element_cannot_end_it():
    content = {"source": "</script><!-- & \u2028"}
    text = evidence.to_json(content)
    assert "<" not in text and "&" not in text and "\u2028" not in text
    assert json.loads(text) == content


def test_an_unknown_value_must_be_none_not_nan():
    with pytest.raises(ValueError, match="JSON compliant"):
        evidence.to_json({"predicted_mm": float("nan")})
