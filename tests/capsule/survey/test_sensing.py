"""The position of the capsule after it was not felt for some time."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulated_bench import bench_with
from capsule.survey.cycle import Cycle
from capsule.survey.gut_evidence import GutEvidence
from capsule.survey.pilot import Pilot
from capsule.survey.sensing import Sensing
from capsule.survey.survey_log import UNFOLDED, Readings

DETECTOR = read_config_file(CONFIG / "config.yaml")["diagonal"]


# Kills: a position that is one wavelength off, and nobody says so.
# After 40 s a fast one could have travelled half a wavelength, though this one has not.
@pytest.mark.parametrize(
    ("unfelt_s", "may_be_off_mm", "is_off_mm"),
    [(30, 0.0, 0.0), (40, 80.0, 0.0), (100, 80.0, -80.0)],
)
def test_a_capsule_that_was_not_felt_for_long_may_be_one_wavelength_off(
    unfelt_s, may_be_off_mm, is_off_mm
):
    phantom = read_phantom(DEFAULT_TABLE, [])
    bench = bench_with(phantom, seed=7, length_mm=200.0, nodules=[], sensors=4)
    sensing = Sensing(DETECTOR, 10.0)
    for from_s, until_s, felt in ((0, 60, True), (60, 60 + unfelt_s, False), (160, 190, True)):
        for _ in range(round((until_s - from_s) / 0.8)):
            readings = bench.read(8)
            if not felt:
                readings = replace(readings, values=np.full_like(readings.values, np.nan))
            sensing.take(readings)
            sensing.follow()
    assert sensing.may_be_off_mm == may_be_off_mm
    error_mm = sensing.position_mm - bench.head_mm[-1][-1]
    assert error_mm == pytest.approx(is_off_mm, abs=5)


# Kills: a suspected place that does not say what the sensing knows of its position.
def test_a_place_that_is_found_after_that_may_be_off_as_well():
    pilot = Pilot(DETECTOR, 10.0, 4)
    pilot.cycle = Cycle("exploring")
    evidence = GutEvidence(np.arange(30.0), np.where(np.arange(30) == 20, 9.0, 0.0))
    felt = {"take": lambda readings: None, "follow": lambda: True, "evidence": lambda: evidence}
    known = {"now_s": 0.7, "may_be_off_mm": 80.0, "fix_mm": 20.0, "position_mm": 21.0}
    pilot.sensing = SimpleNamespace(**felt, **known)
    pilot.tick(Readings(np.zeros((4, 8)), np.zeros(8), UNFOLDED))
    (place,) = pilot.suspects.places
    assert (place.first_mm, place.may_be_off_mm) == (20.0, 80.0)
