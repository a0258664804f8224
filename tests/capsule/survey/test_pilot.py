"""Decisions of a pilot if sensors fail, boards are silent or the origami does not obey."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.journey import Nodule
from capsule.phantom.parameters import with_values
from capsule.phantom.simulated_bench import bench_with
from capsule.survey.cycle import FOLD, STOP_WAVE, UNFOLD, Cycle
from capsule.survey.gut_evidence import GutEvidence
from capsule.survey.pilot import Pilot
from capsule.survey.sensing import Sensing
from capsule.survey.survey_log import UNFOLDED, Readings

pytestmark = pytest.mark.takes(0.5)

DETECTOR = read_config_file(CONFIG / "config.yaml")["diagonal"]
PHANTOM = read_phantom(DEFAULT_TABLE, [])
AT_MM, LENGTH_MM = 70.0, 150.0
# A gut without any suspicion but that of the nodule.
SEED = 7


class Bench:
    """A simulated bench that changes its readings when it is time, and keeps the commands."""

    def __init__(self, when=None, change=None, nodules=(3.0,), **changes):
        phantom = with_values(PHANTOM, {name.replace("__", "."): v for name, v in changes.items()})
        places = [Nodule(AT_MM, size) for size in nodules]
        self.bench = bench_with(phantom, seed=SEED, length_mm=LENGTH_MM, nodules=places, sensors=4)
        self.when, self.change, self.away = when, change, 0
        self.commands, self.folds = [], []

    def lead(self, **options):
        """Run a survey to its end; return the pilot."""
        pilot = Pilot(DETECTOR, 10.0, 4, **options)
        while not pilot.cycle.over:
            if self.bench.at_end:
                self.tell(pilot.tell("gut_ended", "the end of the gut"))
            readings = self.bench.read(pilot.every)
            self.folds.append(readings.fold)
            if self.when and self.when(self, pilot):
                readings = self.change(readings)
            self.tell(pilot.tick(readings))
        return pilot

    def tell(self, commands):
        """Send the boards commands."""
        self.commands += commands
        for command in commands:
            self.bench.tell(command)


def places_there(pilot):
    """Return what the pilot suspects about the nodule."""
    return [place for place in pilot.suspects.places if abs(place.first_mm - AT_MM) < 8]


def happened(pilot):
    return [event.event for event in pilot.log]


def without(*names, **changes):
    """Return what takes readings away."""

    def change(readings):
        lost = {name: np.full_like(getattr(readings, name), np.nan) for name in names}
        return replace(readings, **lost, **changes)

    return change


def dead_sensor(readings):
    dead = np.arange(len(readings.values))[:, np.newaxis] == 1
    return replace(readings, values=np.where(dead, 512.0, readings.values))


def since(state):
    return lambda bench, pilot: state in [event.after for event in pilot.log]


def for_4_s_of_a_pass(bench, pilot):
    bench.away += pilot.cycle.state == "passing" and bench.bench.head_mm[-1][-1] > AT_MM + 2
    return 0 < bench.away <= 5


def at(from_s, until_s=np.inf):
    return lambda bench, pilot: from_s < pilot.sensing.now_s < until_s


# A pass without evidence is no verdict; one that was spoilt comes again.
@pytest.mark.parametrize(
    ("when", "change", "status", "unknown", "happens"),
    [
        (since("returning"), dead_sensor, "undecided", [False, True, True], ""),
        (for_4_s_of_a_pass, without("values"), "confirmed", [False, True, False], ""),
        (since("finding"), without("wave_mm"), "undecided", [False], "lost"),
        (at(100, 115), without("values", fold="unknown"), "confirmed", [False, False], ""),
        (at(60), without("wave_mm"), None, None, ""),
    ],
)
def test_a_fault_costs_evidence_and_the_survey_ends_unfolded(
    when, change, status, unknown, happens
):
    bench = Bench(when, change)
    pilot = bench.lead()
    places = places_there(pilot)
    found = [(place.status, np.isnan(place.evidence).tolist()) for place in places]
    assert found == ([(status, unknown)] if status else [])
    assert bool(pilot.suspects.places) == (FOLD in bench.commands) == bool(status)
    assert happens in " ".join(happened(pilot))
    assert bench.folds[-1] == "unfolded"
    passed = [event.score for event in pilot.log if event.before == "passing"]
    assert passed == [score for place in places for score in place.evidence[1:]]


@pytest.mark.parametrize(
    ("when", "says", "late", "folds"),
    [
        (lambda bench, pilot: pilot.cycle.state == "folding", "folding", 1, 3),
        (since("unfolding"), "unfolding", 2, 1),
    ],
)
def test_an_origami_that_does_not_obey_costs_a_verdict(when, says, late, folds):
    bench = Bench(when, without(fold=says))
    pilot = bench.lead()
    assert [place.status for place in places_there(pilot)] == ["undecided"]
    assert happened(pilot).count("late") >= late
    assert bench.commands.count(FOLD) == folds
    assert pilot.cycle.no_return == (folds == 3)
    # It is told to unfold as long as anybody listens.
    assert bench.commands[-1] == UNFOLD


@pytest.mark.parametrize(
    ("changes", "targets_mm", "head_mm", "before"),
    [
        # The last one lies where the first was reached.
        ({"folding__speed_mm_s": -0.8}, [100.0, 60.0, 100.0], 100.0, "approaching"),
        # Reckoned from the start, where nothing is felt.
        ({}, [60.0, 1.0], 1.0, "finding"),
    ],
)
def test_it_goes_back_to_a_target_and_stays(changes, targets_mm, head_mm, before):
    bench = Bench(nodules=(), **changes)
    pilot = bench.lead(targets_mm=targets_mm)
    assert happened(pilot)[-2:] == ["arrived", "tick"]
    assert pilot.log[-2].before == before
    assert bench.bench.head_mm[-1][-1] == pytest.approx(head_mm, abs=5 if head_mm > 5 else 3)
    way_mm = np.concatenate(bench.bench.head_mm)
    assert way_mm[np.argmax(way_mm > targets_mm[0] - 5) :].min() < targets_mm[1] + 5
    # The wave is stopped, so the capsule stays.
    assert bench.commands[-1] == STOP_WAVE


# Kills: a position that is one wavelength off, and nobody says so.
def test_a_capsule_that_was_not_felt_for_long_may_be_one_wavelength_off():
    # After 40 s a fast one could have travelled half a wavelength, though this one has not.
    for unfelt_s, may_be_off_mm, is_off_mm in ((30, 0.0, 0.0), (40, 80.0, 0.0), (100, 80.0, -80.0)):
        bench = bench_with(PHANTOM, seed=7, length_mm=200.0, nodules=[], sensors=4)
        sensing = Sensing(DETECTOR, 10.0)
        for seconds, change in ((60, None), (unfelt_s, without("values")), (30, None)):
            for _ in range(round(seconds / 0.8)):
                readings = bench.read(8)
                sensing.take(change(readings) if change else readings)
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
