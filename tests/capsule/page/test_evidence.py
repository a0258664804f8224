"""Tests of the data that the page holds of each recording: complete, and small."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.detectors.search import passage_of
from capsule.detectors.wave import wave_of
from capsule.method.particle import Particle, render
from capsule.page.evidence import EVIDENCE, archive_evidence, in_words, nearest_nodule_mm
from capsule.page.packing import inflated, unpack
from capsule.page.plot_data import along_gut, peaks, plot_data
from capsule.seeding import generator
from support.evaluated import UNKNOWN
from support.sections import CONFIG
from support.stored import Described
from support.synthetic import make_recording

DIAGONAL = CONFIG["diagonal"]
FIRST_PEAK, LENGTH = CONFIG["fit"]["first_peak"], CONFIG["preprocessing"]["length"]
CHECK = {"header": {}, "sha256": "0" * 64, "at_ends": [0.0] * 4}
PARTICLE = Particle(np.ones(4) / 3, np.full(4, 0.3), np.full(3, 401 / 3), np.full(4, 29 / 3))
PARAMETERS = {name: getattr(PARTICLE, name).tolist() for name in PARTICLE.__dataclass_fields__}
ROW = {"accepted": True, "place": 0, "size": "3 mm", "size_mm": 3.0, "nodule_at_mm": 4.5}


def plotted(values, check=CHECK, stretches=None, **shape):
    """Return what the page shows of one recording alone."""
    settings = CONFIG | {"preprocessing": CONFIG["preprocessing"] | shape}
    wave = wave_of(values, 10.0, DIAGONAL)
    return plot_data("3mm/r01", values, wave, check, stretches, settings)


def test_of_an_archive_the_page_shows_every_accepted_recording_with_its_verdicts_and_template():
    rows = [
        ROW | {"recording": "0mm/r01", "size_mm": 0.0, "size": "no nodule", "nodule_at_mm": None},
        ROW | {"recording": "3mm/r01"},
    ]
    verdict = {"detector": "template", "scheme": "leave_one_out", "predicted_mm": 3.0}
    row = verdict | {"rmse_0mm": 0.2, "rmse_3mm": 0.1, "location_s": 15.0}
    said = dict.fromkeys(EVIDENCE) | {"detector": "template", "scheme": "leave-one-out"}
    said |= {"said": "3 mm", "distances": [0.2, 0.1], "details": "place 15.0 s"}
    # The fit and the template of the nodule lie 25 samples before the sample u.
    fit = {"parameters": PARAMETERS, "first_peak": FIRST_PEAK, "lag": LENGTH + 1 - 25}
    tables = SimpleNamespace(
        settings=CONFIG,
        templates=[{"size_mm": 0, "parameters": None}, {"size_mm": 3, "parameters": PARAMETERS}],
        described=Described(),
        fits={"3mm/r01": fit | {"rmse": 0.1, "rmse_initial": 0.2, "accepted_moves": 3}},
        matrix=lambda name: np.roll(render(PARTICLE, FIRST_PEAK, LENGTH), -25, axis=1),
        by_recording={"0mm/r01": [row], "3mm/r01": [row] * 2},
    )
    made = dict(archive_evidence(rows, tables))
    assert list(made) == ["0mm/r01", "3mm/r01"]
    assert inflated(json.loads(made["3mm/r01"])["drawn"])["facts"] == {"File": "raw/3mm/r01.csv"}
    healthy, nodule = (inflated(json.loads(each)["judged"]) for each in made.values())
    assert healthy["title"] == "no nodule" and nodule["title"] == "3 mm nodule"
    assert (healthy["nodule_at_mm"], nodule["nodule_at_mm"]) == (None, 4.5)
    assert healthy["verdicts"] == [said | {"outcome": "false alarm"}]
    assert nodule["verdicts"] == [said | {"outcome": "exact"}] * 2
    # At the lag L + 1 the first peak lies at the sample u, counted from 1.
    for drawn in (nodule["template"], nodule["fitted"]):
        assert drawn["peak"][0] == FIRST_PEAK - 1 - 25
        assert (drawn["from"], drawn["to"]) == (-25, LENGTH - 25)
        shape = [drawn[name][0] for name in ("amplitude", "vertical", "horizontal")]
        assert shape == [0.33333, 0.3, 9.6667]
    assert nodule["template"]["size"] == "3 mm"
    assert "RMSE 0.1000; " in nodule["fit"] and f"; lag {LENGTH + 1 - 25}" in nodule["fit"]
    assert healthy["fitted"] is healthy["fit"] is None


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
    assert (said["said"], said["outcome"], said["details"]) == ("no verdict", "not judged", "")
    assert in_words(row | {"no_verdict": "no wave"}, 3.0, 1.0)["details"] == "no wave"
    assert (said["score"], said["threshold"]) == (0.3333333, None)
    assert said["distances"] == [0.25, None]
    # The detector by beats compares with no template.
    assert in_words(row | {"detector": "diagonal"}, None, 1.0)["distances"] == []


def wave_readings(samples, deeper):
    """Return readings under a wave, with deeper presses at one place.

    Each sensor passes the place 150 samples after the one before it.
    """
    time = np.arange(samples)
    wave = np.sin(2 * np.pi * time / 32) + 0.2 * np.sin(4 * np.pi * time / 32)
    noise = generator(1, "readings").normal(0, 0.05, (4, samples))
    middle = 150 + 150 * np.arange(4)[:, np.newaxis]
    bump = deeper * np.exp(-(((time - middle) / 40) ** 2))
    return 500 - 20 * (1 + bump) * (wave + noise)


def test_peaks_say_how_high_when_and_how_long():
    envelope = np.array([[0.5, 1.2, 2.0, 1.1], [0.1, 0.2, 0.3, 0.2]])
    rows = peaks(envelope, np.array([0.0, 0.5, 1.0, 1.5]), 1.0)
    assert rows == [[2.0, 1.0, 1.5], [0.3, 1.0, 0.0]]


def test_the_readings_stay_exact_and_what_the_detectors_judged_by_goes_with_them():
    recording = make_recording(3, "3mm/r01", samples=600)
    check = CHECK | {"header": {"site": "a"}}
    plots = plotted(recording.values, check, (7.0, np.array([0.0, 1.0, 0.5])))
    assert (plots["quality"], plots["measures"]["rail"]) == ("", check["at_ends"])
    drawn = inflated(plots["drawn"])
    assert drawn["facts"] == {"File": "raw/3mm/r01.csv", "SHA-256": "0" * 64, "# site": "a"}
    assert (drawn["interval_s"], drawn["threshold"], drawn["unit"]) == (0.1, 1.0, "counts")
    assert np.array_equal(unpack(drawn["readings"]), recording.values)
    # Smooth signals are thinned.
    assert drawn["envelope"]["every"] == 3
    assert unpack(drawn["envelope"]).shape == (4, 200)
    beats, losses = drawn["beats"], drawn["stretches"]
    wave_s = DIAGONAL["wavelength_mm"] / DIAGONAL["wave_speed_mm_s"]
    # The first stretch is two waves long and begins with the first beat.
    assert losses["first_s"] - beats["first_s"] == pytest.approx(7 / 8 * wave_s, abs=1e-3)
    assert losses["step_s"] == pytest.approx(wave_s / 2)
    assert losses["score"] == 7.0
    assert unpack(losses)[0] == pytest.approx([0.0, 1.0, 0.5], abs=0.003)
    assert inflated(plotted(recording.values / 204.8)["drawn"])["unit"] == "V"
    without = inflated(plotted(np.outer([1.0, 2.0, 3.0, 4.0], np.arange(60.0)), window=20)["drawn"])
    assert without["beats"] is without["gut"] is without["stretches"] is None


@pytest.mark.parametrize(("samples", "deeper"), [(800, 0.0), (800, 0.8), (520, 1.5)])
def test_beats_are_usual_depths_and_the_highest_score_along_the_gut_is_the_verdicts(
    samples, deeper
):
    wave = wave_of(wave_readings(samples, deeper), 10, DIAGONAL)
    passage, (beats, gut) = passage_of(wave, DIAGONAL), along_gut(wave, 10, DIAGONAL)
    depth, (evidence,) = unpack(beats), unpack(gut)
    assert evidence.max() == pytest.approx(passage.evidence, abs=1e-5)
    assert gut["step_mm"] * evidence.argmax() == passage.location_mm
    assert beats["passed_s"][0] == round(passage.location_samples / 10, 2)
    assert np.median(depth, axis=1) == pytest.approx(np.ones(4), abs=0.01)
    if samples == 520:
        # The run ends before the fourth sensor reaches the place where the first three pressed.
        assert [each is None for each in beats["passed_s"]] == [False, False, False, True]
    elif deeper:
        deepest_s = beats["first_s"] + beats["step_s"] * depth.argmax(axis=1)
        assert deepest_s == pytest.approx([15.0, 30.0, 45.0, 60.0], abs=1.6)
        assert beats["passed_s"] == pytest.approx([15.0, 30.0, 45.0, 60.0], abs=3.2)
        assert depth.max(axis=1) == pytest.approx(np.full(4, 1.8), abs=0.3)
