"""What the page carries of each recording: exact where it can be, small, and harmless."""

import base64
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.page import evidence
from capsule.particles import Particle, render
from capsule.sliding import rmse_at_lag
from capsule.stages import preprocess_run
from support.synthetic import make_recording


def unpack(packed):
    """Turn packed numbers back, as the page does."""
    numbers = np.frombuffer(base64.b64decode(packed["data"]), f"<u{packed['bits'] // 8}")
    values = packed["low"] + packed["scale"] * numbers.astype(float)
    values[numbers == 2 ** packed["bits"] - 1] = np.nan
    return values.reshape(packed["rows"], -1)


def test_counts_of_an_adc_come_through_exactly_with_their_gaps():
    values = np.array([[0.0, 512.0, np.nan, 1023.0], [3.0, np.nan, 7.0, 65533.0]])
    assert np.array_equal(unpack(evidence.pack(values)), values, equal_nan=True)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50), st.sampled_from([8, 16]))
def test_other_values_come_through_to_half_a_step(values, bits):
    array = np.array([values])
    packed = evidence.pack(array, bits)
    assert np.allclose(unpack(packed), array, rtol=0, atol=0.5001 * packed["scale"] + 1e-9)
    assert packed["scale"] <= max(1.0, np.ptp(array) / (2**bits - 3))


@pytest.mark.parametrize("fill", [np.nan, 0.0, 2.5])
def test_a_signal_that_never_changes_or_is_missing(fill):
    values = np.full((2, 3), fill)
    assert np.array_equal(unpack(evidence.pack(values)), values, equal_nan=True)


def test_the_fitted_particle_lies_where_the_comparison_found_it():
    particle = Particle(np.ones(2), np.full(2, 0.3), np.array([40.0]), np.full(2, 8.0))
    drawn = render(particle, 30, 120)
    matrix = np.zeros_like(drawn)
    matrix[:, 25:] = drawn[:, :-25]
    lag = min(range(1, 241), key=lambda tau: rmse_at_lag(matrix, drawn, tau))
    fitted = evidence.fitted_matrix(particle, 30, lag, 100, 120)
    assert fitted.shape == (2, 100)
    assert np.allclose(fitted, matrix[:, :100], atol=1e-9)


def test_peaks_say_how_high_when_and_how_long():
    envelope = np.array([[0.5, 1.2, 2.0, 1.1], [0.1, 0.2, 0.3, 0.2]])
    rows = evidence.peaks(envelope, np.array([0.0, 0.5, 1.0, 1.5]), 1.0)
    assert rows == [[2.0, 1.0, 1.5], [0.3, 1.0, 0.0]]


def test_1200_recordings_of_full_length_stay_below_25_megabytes():
    values = make_recording(3, "3mm/r01", samples=1000).values
    run = preprocess_run("3mm/r01", "3 mm", values, rate_hz=10, window=84, threshold=1.0)
    said = {"label": "template_threshold, leave-one-out", "predicted_mm": 3.0}
    said["details"] = "estimated 3.1 mm, probability 97.6 %, place 12.8 s, 5.5 mm"
    verdicts = [said | {"distances": [0.123456789012345] * 6}] * 2 + [said | {"distances": []}] * 4
    content = evidence.recording_evidence(run, 1.0, 1, run.matrix, verdicts, {"SHA-256": "0" * 64})
    one = len(evidence.to_json(content))
    # The figures take 2.5 MB, a row of the table less than 1 kB.
    assert 1200 * (one + 1000) + 2.5e6 < 25e6


def test_of_a_larger_archive_every_nth_reading_is_kept():
    assert evidence.reading_step(1200 * 1000 * 4) == 1
    assert evidence.reading_step(4800 * 1000 * 4) == 4


def test_of_an_archive_the_page_shows_every_accepted_recording_and_the_fit_where_there_is_one():
    values = make_recording(3, "3mm/r01", samples=400).values
    particle = Particle(np.ones(4), np.full(4, 0.3), np.full(3, 100.0), np.full(4, 9.0))
    fit = {"first_peak": 50, "lag": 501, "rmse": 0.1, "rmse_initial": 0.2, "accepted_moves": 3}
    stored = {
        "0mm/r01": evidence.Stored(values, {"site": "a"}),
        "3mm/r01": evidence.Stored(values, {}, (fit, particle)),
    }
    row = {"accepted": True, "samples": 400, "sha256": "0", "verdict": "", "size": "3 mm"}
    rows = [
        row | {"recording": "0mm/r01", "size_mm": 0.0},
        row | {"recording": "2mm/bad", "accepted": False, "samples": 0},
        row | {"recording": "3mm/r01", "size_mm": 3.0},
    ]
    said = {"label": "template", "predicted_mm": 3.0, "details": "", "distances": []}
    settings = {
        "preprocessing": {"window": 40, "threshold": 1.0, "length": 500},
        "recording": {"rate_hz": 10, "sensors": 4},
    }
    made = evidence.archive_evidence(rows, {"3mm/r01": [said]}, stored.__getitem__, settings)
    healthy, nodule = (json.loads(content) for _, content in made)
    assert [each["recording"] for each in (healthy, nodule)] == ["0mm/r01", "3mm/r01"]
    assert healthy["title"] == "no nodule, not judged"
    assert healthy["facts"] == {"File": "raw/0mm/r01.csv", "SHA-256": "0", "# site": "a"}
    assert healthy["fitted"] is None and healthy["verdicts"] == []
    assert "RMSE 0.1000" in nodule["facts"]["Fit"] and nodule["verdicts"] == [said]
    # At the lag L + 1 the first peak, of height 1, lies at the sample u.
    drawn = unpack(nodule["fitted"])[0]
    every = nodule["fitted"]["every"]
    assert abs(int(drawn.argmax()) * every - 50) <= every


def test_json_in_a_script_element_cannot_end_it():
    content = {"source": "</script><!-- & \u2028"}
    text = evidence.to_json(content)
    assert "<" not in text and "&" not in text and "\u2028" not in text
    assert json.loads(text) == content


def test_an_unknown_value_must_be_none_not_nan():
    with pytest.raises(ValueError, match="JSON compliant"):
        evidence.to_json({"predicted_mm": float("nan")})
