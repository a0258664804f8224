"""Tests of the data that the page holds of each recording: complete, and small."""

import json

import numpy as np

from capsule.configuration import read_config_file
from capsule.detectors.beats import WINDOWS_A_WAVE
from capsule.detectors.template import first_peak_sample
from capsule.page.archive_evidence import (
    VERDICT_KEYS,
    accepted_rows,
    archive_evidence,
    evidence_among_others,
    surface,
)
from capsule.page.beside import stands_beside
from capsule.page.nearest_templates import NearestTemplate
from capsule.page.packing import to_json
from capsule.page.recording_evidence import RecordingResults, recording_evidence
from capsule.page.stretches import STEP, Stretches
from capsule.particle import Particle, render
from capsule.sliding import rmse_at_lag
from support.project import ROOT
from support.stored import StoredResults
from support.synthetic import make_recording

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")
PARTICLE = Particle(np.ones(4) / 3, np.full(4, 0.3), np.full(3, 401 / 3), np.full(4, 29 / 3))
FIT = {"first_peak": 150, "lag": 981, "rmse": 0.1, "rmse_initial": 0.2, "accepted_moves": 3}
U, LENGTH = 30, 120
ROW = {"accepted": True, "size": "3 mm", "size_mm": 3.0, "nodule_at_mm": 4.5}


def test_1200_recordings_of_full_length_stay_below_25_megabytes():
    values = make_recording(3, "3mm/r01", samples=1000).values
    said = dict.fromkeys(VERDICT_KEYS)
    said |= {"detector": "template_threshold", "scheme": "leave_one_out", "predicted_mm": 3.0}
    said["details"] = "estimated 3.1 mm, probability 97.6 %, place 12.8 s, 5.5 mm"
    said |= dict.fromkeys(("score", "threshold", "location_mm"), 1234.567)
    verdicts = [said | {"distances": [0.123456789012345] * 6}] * 2
    verdicts += [said | {"distances": []}] * 6
    schemes = ("leave_one_out", "resubstitution")
    nearest = {scheme: NearestTemplate(3.0, PARTICLE, 981) for scheme in schemes}
    beats = int(1000 / 32 * WINDOWS_A_WAVE)
    stretches = Stretches(7.0, np.linspace(0, 1, beats // STEP))
    check = {"header": {}, "sha256": "0" * 64}
    results = RecordingResults(values, check, stretches)
    alone = recording_evidence("3mm/r01", results, 10.0, SETTINGS)
    assert None not in alone.values()
    alone["facts"] = {"SHA-256": "0" * 64}
    added = evidence_among_others(ROW, 0, verdicts, nearest, (FIT, PARTICLE), SETTINGS)
    assert None not in added.values()
    one = len(to_json(alone | added))
    # The figures take 2.5 MB, a recording's rows in the tables less than 900 bytes.
    assert 1200 * (one + 900) + 2.5e6 < 25e6
    assert not stands_beside(1200, SETTINGS)
    too_many = int((25e6 - 2.5e6) / (one + 900)) + 1
    assert stands_beside(too_many, SETTINGS)


def test_the_fit_is_drawn_where_it_lies_and_said_in_words():
    settings = SETTINGS | {"preprocessing": SETTINGS["preprocessing"] | {"length": 500}}
    particle = Particle(np.ones(4), np.full(4, 0.3), np.full(3, 100.0), np.full(4, 9.0))
    fit = FIT | {"first_peak": 50, "lag": 501}
    added = evidence_among_others(ROW, 0, [], {}, (fit, particle), settings)
    # At the lag L + 1 the first peak lies at the sample u, counted from 1.
    assert added["fitted"]["peak"] == [49, 149, 249, 349]
    assert added["fit"].startswith("RMSE 0.1000; ") and added["fit"].endswith("; lag 501")
    without = evidence_among_others(ROW, 0, [], {}, None, settings)
    assert without["fitted"] is without["fit"] is None


def test_of_an_archive_the_page_shows_every_accepted_recording_with_its_verdicts_and_templates():
    rows = [
        ROW | {"recording": "0mm/r01", "size_mm": 0.0, "nodule_at_mm": None},
        ROW | {"recording": "2mm/bad", "accepted": False},
        ROW | {"recording": "3mm/r01"},
    ]
    first_peak, length = SETTINGS["fit"]["first_peak"], SETTINGS["preprocessing"]["length"]
    verdict = {"detector": "template", "scheme": "leave_one_out", "predicted_mm": 3.0}
    # At the lag L + 1 the first peak lies at the sample u, counted from 1.
    location_s = first_peak_sample(length + 1, first_peak, length) / 10
    row = verdict | {"rmse_0mm": 0.2, "rmse_3mm": 0.1, "location_s": location_s}
    verdicts = {"0mm/r01": [row], "3mm/r01": [row] * 2}
    said = dict.fromkeys(VERDICT_KEYS) | verdict
    said |= {"distances": [0.2, 0.1], "details": f"place {location_s:g} s"}
    stored = StoredResults(leave_one_out={3.0: PARTICLE})
    made = archive_evidence(accepted_rows(rows), verdicts, [0.0, 3.0], stored, SETTINGS)
    healthy, nodule = (json.loads(each.joined()) for each in made)
    assert [each["recording"] for each in (healthy, nodule)] == ["0mm/r01", "3mm/r01"]
    assert healthy["title"] == "no nodule" and nodule["title"] == "3 mm nodule"
    assert (healthy["row"], nodule["row"]) == (0, 2)
    assert (healthy["nodule_at_mm"], nodule["nodule_at_mm"]) == (None, 4.5)
    assert healthy["verdicts"] == [said] and nodule["verdicts"] == [said] * 2
    assert healthy["peaks"] == nodule["peaks"] == []
    drawn = nodule["templates"]["leave_one_out"]
    assert (drawn["size_mm"], drawn["peak"][0]) == (3.0, first_peak - 1)


def particle_of_height(height, spacing=40.0):
    return Particle(np.full(2, height), np.full(2, 0.3), np.array([spacing]), np.full(2, 8.0))


def drawn(surface, sensors, samples):
    """Draw a surface as the page does."""
    column, row = np.arange(samples), np.arange(sensors)
    heights = [
        np.exp(-0.5 * ((row[:, np.newaxis] - s) / vertical) ** 2)
        * amplitude
        * np.exp(-0.5 * ((column - peak) / horizontal) ** 2)
        for s, (amplitude, vertical, peak, horizontal) in enumerate(
            zip(*(surface[k] for k in ("amplitude", "vertical", "peak", "horizontal")), strict=True)
        )
    ]
    inside = (column >= surface["from"]) & (column < surface["to"])
    return np.max(heights, axis=0) * inside


def test_a_particle_is_drawn_where_the_comparison_found_it():
    rendered = render(particle_of_height(1.0), U, LENGTH)
    matrix = np.zeros_like(rendered)
    matrix[:, 25:] = rendered[:, :-25]
    lag = min(range(1, 2 * LENGTH + 1), key=lambda tau: rmse_at_lag(matrix, rendered, tau))
    found = surface(particle_of_height(1.0), U, lag, LENGTH)
    assert np.allclose(drawn(found, 2, 100), matrix[:, :100], atol=1e-4)
