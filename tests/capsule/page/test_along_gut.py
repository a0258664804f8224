"""What the page draws along the gut agrees with the verdict."""

import numpy as np
import pytest

from capsule.configuration import read_config_file
from capsule.detectors.search import passage_of
from capsule.page.along_gut import along_gut
from support.project import ROOT
from support.waves import wave_readings

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")["diagonal"]


@pytest.mark.parametrize("deeper", [0.0, 0.8])
def test_the_highest_score_along_the_gut_is_that_of_the_verdict(deeper):
    values = wave_readings(deeper=deeper)
    along, passage = along_gut(values, 10, SETTINGS), passage_of(values, 10, SETTINGS)
    assert along.evidence.max() == pytest.approx(passage.evidence, abs=1e-5)
    assert along.step_mm * along.evidence.argmax() == passage.location_mm
    assert along.passed[0] == passage.location_samples


def test_beats_are_drawn_in_usual_depths_and_deeper_where_a_sensor_passes_the_place():
    along = along_gut(wave_readings(deeper=0.8), 10, SETTINGS)
    assert np.median(along.depth, axis=1) == pytest.approx(np.ones(4))
    deepest = along.first + along.step * along.depth.argmax(axis=1)
    assert deepest == pytest.approx([150, 300, 450, 600], abs=16)
    assert along.passed == pytest.approx([150, 300, 450, 600], abs=32)
    assert along.depth.max(axis=1) == pytest.approx(np.full(4, 1.8), abs=0.3)


def test_a_sensor_that_never_comes_to_the_place_passes_it_at_no_time():
    # The run ends before the fourth sensor reaches the place where the first three were pressed.
    along = along_gut(wave_readings(samples=520, deeper=1.5), 10, SETTINGS)
    assert not np.isnan(along.passed[:3]).any() and np.isnan(along.passed[3])


def test_without_a_wave_there_is_nothing_to_draw():
    assert along_gut(np.ones((4, 300)), 10, SETTINGS) is None
