"""Tests of the data that the page holds of each recording: complete, and small."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.detectors.beats import WINDOWS_A_WAVE
from capsule.detectors.occlusion import STEP
from capsule.detectors.wave import wave_of
from capsule.engine.configuration import read_config_file
from capsule.method.particle import Particle, render
from capsule.method.sliding import rmse_at_lag
from capsule.page.evidence import (
    EVIDENCE,
    archive_evidence,
    evidence_among_others,
    in_words,
    nearest_nodule_mm,
    surface,
)
from capsule.page.packing import deflated, inflated, to_json
from capsule.page.plot_data import plot_data
from support.evaluated import UNKNOWN
from support.project import ROOT
from support.stored import Described
from support.synthetic import make_recording

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")
PARTICLE = Particle(np.ones(4) / 3, np.full(4, 0.3), np.full(3, 401 / 3), np.full(4, 29 / 3))
FIT = {"first_peak": 150, "lag": 981, "rmse": 0.1, "rmse_initial": 0.2, "accepted_moves": 3}
ROW = {"accepted": True, "place": 0, "size": "3 mm", "size_mm": 3.0, "nodule_at_mm": 4.5}


def test_1200_recordings_of_full_length_stay_below_8_megabytes():
    values = make_recording(3, "3mm/r01", samples=525).values
    said = {"detector": "diagonal", "scheme": "leave-one-out", "predicted_mm": 3.0}
    said["details"] = "estimated 3.1 mm, probability 97.6 %, place 12.8 s, 5.5 mm"
    said |= dict.fromkeys(EVIDENCE, 1234.567) | {"outcome": "within tolerance"}
    verdicts = [said | {"distances": [0.1234567] * 6}] + [said | {"distances": []}] * 2
    nearest = {"size_mm": 3.0, **surface(PARTICLE, 150, 981, 1000)}
    beats = int(525 / 32 * WINDOWS_A_WAVE)
    stretches = 7.0, np.linspace(0, 1, beats // STEP)
    check = {"header": {}, "sha256": "0" * 64, "at_ends": [0.0] * 4}
    wave = wave_of(values, 10.0, SETTINGS["diagonal"])
    made = plot_data("3mm/r01", values, wave, check, stretches, SETTINGS)
    assert None not in inflated(made["drawn"]).values()
    added = evidence_among_others(ROW, verdicts, nearest, (FIT, PARTICLE), 1000)
    assert None not in added.values()
    one = len(made["drawn"]) + len(deflated(to_json(added)))
    # The figures take 0.9 MB, a recording's row in the table less than 650 bytes.
    assert 1200 * (one + 650) + 0.9e6 < 8e6


def test_the_fit_is_said_in_words():
    added = evidence_among_others(ROW, [], None, (FIT | {"lag": 501}, PARTICLE), 500)
    # At the lag L + 1 the first peak lies at the sample u, counted from 1.
    assert added["fitted"]["peak"][0] == FIT["first_peak"] - 1
    assert added["fit"].startswith("RMSE 0.1000; ") and added["fit"].endswith("; lag 501")
    without = evidence_among_others(ROW, [], None, None, 500)
    assert without["fitted"] is without["fit"] is None


def test_of_an_archive_the_page_shows_every_accepted_recording_with_its_verdicts_and_template():
    rows = [
        ROW | {"recording": "0mm/r01", "size_mm": 0.0, "nodule_at_mm": None},
        ROW | {"recording": "3mm/r01"},
    ]
    first_peak, length = SETTINGS["fit"]["first_peak"], SETTINGS["preprocessing"]["length"]
    verdict = {"detector": "template", "scheme": "leave_one_out", "predicted_mm": 3.0}
    row = verdict | {"rmse_0mm": 0.2, "rmse_3mm": 0.1, "location_s": 15.0}
    verdicts = {"0mm/r01": [row], "3mm/r01": [row] * 2}
    said = dict.fromkeys(EVIDENCE) | verdict | {"scheme": "leave-one-out"}
    said |= {"distances": [0.2, 0.1], "details": "place 15.0 s"}
    matrix = render(PARTICLE, first_peak, length)
    parameters = {name: getattr(PARTICLE, name).tolist() for name in PARTICLE.__dataclass_fields__}
    templates = [
        {"size_mm": 0.0, "parameters": None},
        {"size_mm": 3.0, "parameters": parameters},
    ]
    tables = SimpleNamespace(
        settings=SETTINGS,
        templates=templates,
        described=Described(),
        fits={},
        matrix=lambda name: matrix,
    )
    made = dict(archive_evidence(rows, verdicts, tables))
    assert list(made) == ["0mm/r01", "3mm/r01"]
    assert inflated(json.loads(made["3mm/r01"])["drawn"])["recording"] == "3mm/r01"
    healthy, nodule = (inflated(json.loads(each)["judged"]) for each in made.values())
    assert healthy["title"] == "no nodule" and nodule["title"] == "3 mm nodule"
    assert (healthy["nodule_at_mm"], nodule["nodule_at_mm"]) == (None, 4.5)
    assert healthy["verdicts"] == [said | {"outcome": "false alarm"}]
    assert nodule["verdicts"] == [said | {"outcome": "exact"}] * 2
    # At the lag L + 1 the first peak lies at the sample u, counted from 1.
    drawn = nodule["template"]
    assert (drawn["size_mm"], drawn["peak"][0]) == (3.0, first_peak - 1)
    without = dict(archive_evidence(rows, {}, tables))
    assert inflated(json.loads(without["3mm/r01"])["judged"])["template"] is None


@pytest.mark.parametrize(
    ("distances", "nearest"),
    [
        # The template of no nodule is not drawn.
        ({"rmse_0mm": 0.1, "rmse_2.5mm": 0.3, "rmse_3mm": 0.2}, 3.0),
        ({"rmse_0mm": 0.1, "rmse_2.5mm": 0.3, "rmse_3mm": UNKNOWN}, 2.5),
        ({"rmse_0mm": 0.1, "rmse_3mm": UNKNOWN}, None),
    ],
)
def test_the_nearest_template_is_that_of_the_shortest_distance(distances, nearest):
    verdicts = [{"detector": "diagonal"}, {"detector": "template", **distances}]
    assert nearest_nodule_mm(verdicts) == nearest
    assert nearest_nodule_mm([{"detector": "diagonal", **distances}]) is None


def test_what_is_not_known_of_a_verdict_is_none_and_goes_without_words():
    row = dict.fromkeys(("predicted_mm", "estimate_mm", "probability", "location_s"), UNKNOWN)
    row |= {"detector": "template", "scheme": "all", "score": 1 / 3, "threshold": float("inf")}
    row |= {"rmse_0mm": 0.25, "rmse_3mm": UNKNOWN}
    said = in_words(row, 3.0, 1.0)
    assert (said["predicted_mm"], said["outcome"], said["details"]) == (None, "not judged", "")
    assert in_words(row | {"no_verdict": "no wave"}, 3.0, 1.0)["details"] == "no wave"
    assert (said["score"], said["threshold"]) == (0.3333333, None)
    assert said["distances"] == [0.25, None]
    # The detector by beats compares with no template.
    assert in_words(row | {"detector": "diagonal"}, None, 1.0)["distances"] == []


def test_a_particle_is_drawn_where_the_comparison_found_it():
    spreads = np.array([0.3, 0.4]), np.array([40.0]), np.array([8.0, 9.0])
    particle, length = Particle(np.array([1.0, 0.8]), *spreads), 120
    rendered = render(particle, 30, length)
    matrix = np.zeros_like(rendered)
    matrix[:, 25:] = rendered[:, :-25]
    lag = min(range(1, 2 * length + 1), key=lambda tau: rmse_at_lag(matrix, rendered, tau))
    drawn = surface(particle, 30, lag, length)
    assert drawn["peak"] == matrix.argmax(axis=1).tolist()
    assert (drawn["from"], drawn["to"]) == (25, 25 + length)
    assert [drawn[name] for name in ("amplitude", "vertical", "horizontal")] == [
        [1.0, 0.8],
        [0.3, 0.4],
        [8.0, 9.0],
    ]
