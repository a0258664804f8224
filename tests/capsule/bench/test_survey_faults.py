"""Decisions of a pilot if sensors fail, boards are silent or the origami does not obey."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.journey import Nodule
from capsule.phantom.parameters import with_values
from capsule.phantom.simulated_bench import LEASE_S, bench_with
from capsule.survey.cycle import FOLD, UNFOLD
from capsule.survey.pilot import Pilot

pytestmark = pytest.mark.boards

DETECTOR = read_config_file(CONFIG / "config.yaml")["diagonal"]
PHANTOM = read_phantom(DEFAULT_TABLE, [])
AT_MM, LENGTH_MM = 70.0, 150.0
# A gut without any suspicion but that of the nodule.
SEED = 7


class Bench:
    """A simulated bench with a fault, which keeps the commands and the true fold states."""

    def __init__(self, fault=None, nodules=(3.0,), length_mm=LENGTH_MM, **changes):
        phantom = with_values(PHANTOM, {name.replace("__", "."): v for name, v in changes.items()})
        places = [Nodule(AT_MM + 45 * number, size) for number, size in enumerate(nodules)]
        self.bench = bench_with(phantom, seed=SEED, length_mm=length_mm, nodules=places, sensors=4)
        self.fault = fault or (lambda bench, readings, state: readings)
        self.now_s = 0.0
        self.began_s = {}
        self.away = 0
        self.commands = []
        self.folds = []

    def lead(self, **options):
        """Run a survey to its end; return the pilot."""
        pilot = Pilot(DETECTOR, 10.0, 4, **options)
        while not pilot.cycle.over:
            if self.bench.at_end:
                for command in pilot.tell("gut_ended", "the end of the gut"):
                    self.tell(command)
            readings = self.bench.read(pilot.every)
            self.folds.append(readings.fold)
            state, self.now_s = pilot.cycle.state, pilot.sensing.now_s
            self.began_s.setdefault(state, self.now_s)
            for command in pilot.tick(self.fault(self, readings, state)):
                self.tell(command)
        return pilot

    def tell(self, command):
        """Send the boards a command."""
        self.commands.append(command)
        self.bench.tell(command)


def happened(pilot):
    return [event.event for event in pilot.log]


def without(readings, name):
    return replace(readings, **{name: np.full_like(getattr(readings, name), np.nan)})


def sensor_dies_before_the_pass_again(bench, readings, state):
    values = readings.values.copy()
    values[1] = 512.0
    return replace(readings, values=values) if "returning" in bench.began_s else readings


def away_in_a_pass(bench, readings, state, name):
    bench.away += state == "passing" and bench.bench.head_mm[-1][-1] > AT_MM + 2
    return without(readings, name) if 0 < bench.away <= 5 else readings


def never_folds(bench, readings, state):
    return replace(readings, fold="folding") if state == "folding" else readings


def never_unfolds(bench, readings, state):
    return replace(readings, fold="unfolding") if "unfolding" in bench.began_s else readings


def logger_was_away(bench, readings, state):
    away = 100 < bench.now_s < 115
    return replace(without(readings, "values"), fold="unknown") if away else readings


def phase_of_the_drive_is_lost(bench, readings, state):
    return without(readings, "wave_mm") if bench.now_s > 60 else readings


def never_finds_its_position(bench, readings, state):
    return without(readings, "wave_mm") if "finding" in bench.began_s else readings


# A pass without evidence is no verdict; one that was spoilt comes again.
@pytest.mark.parametrize(
    ("fault", "status", "unknown", "happens"),
    [
        (sensor_dies_before_the_pass_again, "undecided", [False, True, True], ""),
        (partial(away_in_a_pass, name="wave_mm"), "confirmed", [False, True, False], ""),
        (partial(away_in_a_pass, name="values"), "confirmed", [False, True, False], ""),
        (never_folds, "undecided", [False], "late"),
        (never_unfolds, "undecided", [False], "late late"),
        (never_finds_its_position, "undecided", [False], "lost"),
        (logger_was_away, "confirmed", [False, False], ""),
        (phase_of_the_drive_is_lost, None, None, ""),
    ],
)
def test_a_fault_costs_evidence_and_the_survey_ends_unfolded(fault, status, unknown, happens):
    bench = Bench(fault)
    pilot = bench.lead()
    places = [place for place in pilot.suspects.places if abs(place.first_mm - AT_MM) < 8]
    found = [(place.status, np.isnan(place.evidence).tolist()) for place in places]
    assert found == ([(status, unknown)] if status else [])
    assert bool(pilot.suspects.places) == (FOLD in bench.commands) == bool(status)
    assert happens in " ".join(happened(pilot))
    if fault is never_folds:
        assert bench.commands.count(FOLD) == 3
        assert pilot.cycle.no_return
    if fault is never_unfolds:
        # It is told to unfold as long as anybody listens.
        assert bench.commands[-1] == UNFOLD
    else:
        assert bench.folds[-1] == "unfolded"


def test_a_lease_that_nobody_renews_unfolds_the_origami():
    bench = Bench().bench
    bench.read(8)
    bench.tell(FOLD)
    said = [bench.read(1).fold for _ in range(int(12 * LEASE_S))]
    assert "unfolding" in said[int(10 * LEASE_S) : int(10 * LEASE_S) + 3]


def test_a_capsule_that_folding_carries_forward_goes_on_with_single_passes():
    bench = Bench(folding__speed_mm_s=0.2, nodules=(3.0, 0.0, 0.0, 3.0), length_mm=400.0)
    places = bench.lead().suspects.places
    assert bench.commands.count(FOLD) == 3
    assert {place.status for place in places} == {"undecided"}
    assert any(abs(place.first_mm - AT_MM - 135) < 8 for place in places)


@pytest.mark.parametrize(
    ("changes", "targets_mm", "head_mm", "before"),
    [
        ({"folding__speed_mm_s": -0.8}, [100.0, 60.0], 60.0, "approaching"),
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
    wave_mm, stands_mm = bench.bench.read(8).wave_mm[-1], bench.bench.head_mm[-1][-1]
    assert bench.bench.read(80).wave_mm[-1] == wave_mm
    assert bench.bench.head_mm[-1][-1] == stands_mm
