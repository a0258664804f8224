"""The evidence along a known way."""

import numpy as np
import pytest

from capsule.detectors.search import passage_of
from capsule.detectors.wave import wave_of
from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import simulate_run
from capsule.survey.gut_evidence import GutEvidence, evidence_along

PHANTOM = read_phantom(DEFAULT_TABLE, [])
SETTINGS = read_config_file(CONFIG / "config.yaml")["diagonal"]


@pytest.mark.parametrize("number", range(1, 4))
def test_it_is_highest_at_the_nodule_and_like_the_diagonal_detectors(number):
    run = simulate_run(PHANTOM, 3.0, 900, f"3mm/r{number:02d}")
    values = run.counts.astype(float)
    along = evidence_along(
        values, 10.0, SETTINGS, lambda at: np.interp(at, np.arange(run.head_mm.size), run.head_mm)
    )
    place_mm, evidence = along.best()
    assert place_mm == pytest.approx(run.nodule_at_mm, abs=2.5)
    # The detector searches speeds, so its evidence may be slightly higher.
    assert evidence == pytest.approx(
        passage_of(wave_of(values, 10.0, SETTINGS), SETTINGS).evidence, rel=0.5
    )


def test_without_a_wave_on_every_sensor_there_is_none():
    still = np.full((4, 400), 500.0)
    assert evidence_along(still, 10.0, SETTINGS, lambda at: at) is None
    still[2] = np.nan
    assert evidence_along(still, 10.0, SETTINGS, lambda at: at) is None


def test_the_best_place_is_the_middle_of_the_top():
    places = np.arange(100.0, 120.0)
    evidence = np.zeros(20)
    evidence[[4, 5, 6, 7, 8]] = [0.6, 1.0, 0.9, 0.6, 0.4]
    evidence[15] = 0.8
    place_mm, score = GutEvidence(places, evidence).best()
    assert score == 1.0
    assert place_mm == pytest.approx((0.6 * 104 + 105 + 0.9 * 106 + 0.6 * 107) / 3.1)
    below = GutEvidence(places, evidence - 2).best()
    assert below == (105.0, -1.0)
    assert GutEvidence(places, evidence).without([105.0], 3.0).best() == (115.0, 0.8)
    nothing = GutEvidence(places, evidence).within(200.0, 300.0)
    assert np.isnan(nothing.best()).all()
