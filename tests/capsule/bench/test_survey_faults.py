"""Decisions of a pilot if sensors fail, boards are silent or the origami does not obey."""

from dataclasses import replace

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
        self.fault = fault or (lambda readings, state: readings)
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
            for command in pilot.tick(self.fault(readings, pilot.cycle.state)):
                self.tell(command)
        return pilot

    def tell(self, command):
        """Send the boards a command."""
        self.commands.append(command)
        self.bench.tell(command)


def statuses(pilot):
    return [place.status for place in pilot.suspects.places if abs(place.first_mm - AT_MM) < 8]


def happened(pilot):
    return [event.event for event in pilot.log]


def test_without_a_fault_each_nodule_is_confirmed_where_it_is_and_for_itself():
    bench = Bench(nodules=(3.0, 3.0))
    pilot = bench.lead()
    confirmed = [place for place in pilot.suspects.places if place.status == "confirmed"]
    assert [place.place_mm for place in confirmed] == pytest.approx([AT_MM, AT_MM + 45], abs=5)
    assert [place.passes for place in confirmed] == [2, 2]
    assert bench.folds[-1] == "unfolded"
    assert pilot.sensing.position_mm == pytest.approx(LENGTH_MM, abs=4)


def test_a_sensor_that_dies_before_the_pass_again_gives_no_verdict():
    def die(readings, state):
        dead = die.dead = die.dead or state == "returning"
        if not dead:
            return readings
        values = readings.values.copy()
        values[1] = 512.0
        return replace(readings, values=values)

    die.dead = False
    pilot = Bench(die).lead()
    assert statuses(pilot) == ["undecided"]
    place = next(place for place in pilot.suspects.places if abs(place.first_mm - AT_MM) < 8)
    assert np.isnan(place.evidence[1:]).all()


@pytest.mark.parametrize("missing", ["wave", "samples"])
def test_a_pass_in_which_wave_or_samples_were_away_is_no_evidence_and_comes_again(missing):
    def away(readings, state):
        beyond_mm = bench.bench.head_mm[-1][-1] - AT_MM
        away.judgements += state == "passing" and beyond_mm > 2
        if not 0 < away.judgements <= 5:
            return readings
        if missing == "wave":
            return replace(readings, wave_mm=np.full_like(readings.wave_mm, np.nan))
        return replace(readings, values=np.full_like(readings.values, np.nan))

    away.judgements = 0
    bench = Bench(away)
    pilot = bench.lead()
    place = next(place for place in pilot.suspects.places if abs(place.first_mm - AT_MM) < 8)
    assert [np.isnan(evidence) for evidence in place.evidence] == [False, True, False]
    assert place.status == "confirmed"


def test_a_fold_board_that_never_folds_is_given_up_after_three_tries():
    def stuck(readings, state):
        return replace(readings, fold="folding") if state == "folding" else readings

    bench = Bench(stuck)
    pilot = bench.lead()
    assert bench.commands.count(FOLD) == 3
    assert pilot.cycle.no_return
    assert statuses(pilot) == ["undecided"]
    assert bench.folds[-1] == "unfolded"


def test_an_origami_that_does_not_unfold_ends_the_survey():
    def stuck(readings, state):
        stuck.now = stuck.now or state == "unfolding"
        return replace(readings, fold="unfolding") if stuck.now else readings

    stuck.now = False
    bench = Bench(stuck)
    pilot = bench.lead()
    assert happened(pilot)[-2:] == ["late", "late"]
    # It is told to unfold as long as anybody listens.
    assert bench.commands[-1] == UNFOLD


def test_a_fold_board_that_falls_silent_is_told_to_unfold():
    def silent(readings, state):
        silent.from_s = min(silent.from_s, readings.time_s[0] if state == "returning" else np.inf)
        quiet = 10 < readings.time_s[0] - silent.from_s < 30
        return replace(readings, fold="unknown") if quiet else readings

    silent.from_s = np.inf
    bench = Bench(silent)
    pilot = bench.lead()
    assert "let_go" in happened(pilot)
    assert statuses(pilot) == ["confirmed"]
    assert bench.folds[-1] == "unfolded"


def test_a_lease_that_nobody_renews_unfolds_the_origami():
    bench = Bench().bench
    bench.read(8)
    bench.tell(FOLD)
    said = [bench.read(1).fold for _ in range(int(12 * LEASE_S))]
    assert "unfolding" in said[int(10 * LEASE_S) : int(10 * LEASE_S) + 3]


def test_a_logger_that_was_away_leaves_a_gap_and_the_place_is_found_again():
    def away(readings, state):
        if 100 < readings.time_s[0] < 115:
            gone = np.full_like(readings.values, np.nan)
            return replace(readings, values=gone, fold="unknown")
        return readings

    pilot = Bench(away).lead()
    assert statuses(pilot) == ["confirmed"]


def test_a_drive_whose_phase_is_not_known_is_no_odometer():
    def lost(readings, state):
        if readings.time_s[0] > 60:
            return replace(readings, wave_mm=np.full_like(readings.wave_mm, np.nan))
        return readings

    bench = Bench(lost)
    pilot = bench.lead()
    assert pilot.suspects.places == []
    assert FOLD not in bench.commands


def test_a_capsule_that_folding_carries_forward_goes_on_with_single_passes():
    bench = Bench(folding__speed_mm_s=0.2, nodules=(3.0, 0.0, 0.0, 3.0), length_mm=400.0)
    pilot = bench.lead()
    assert bench.commands.count(FOLD) == 3
    assert [place.status for place in pilot.suspects.places] == ["undecided"] * len(
        pilot.suspects.places
    )
    later = [place.first_mm for place in pilot.suspects.places if place.first_mm > 200]
    assert any(abs(first_mm - AT_MM - 135) < 8 for first_mm in later)


def test_it_goes_back_to_a_target():
    bench = Bench(folding__speed_mm_s=-0.8, nodules=())
    pilot = bench.lead(targets_mm=[100.0, 60.0])
    assert happened(pilot)[-2:] == ["arrived", "tick"]
    assert bench.bench.head_mm[-1][-1] == pytest.approx(60.0, abs=5)
    # The wave is stopped, so the capsule stays.
    wave_mm, head_mm = bench.bench.read(8).wave_mm[-1], bench.bench.head_mm[-1][-1]
    assert bench.bench.read(80).wave_mm[-1] == wave_mm
    assert bench.bench.head_mm[-1][-1] == head_mm


def test_a_target_at_the_start_is_reckoned_from_the_start():
    bench = Bench(nodules=())
    pilot = bench.lead(targets_mm=[60.0, 1.0])
    arrival = pilot.log[-2]
    assert (arrival.before, arrival.event) == ("finding", "arrived")
    assert bench.bench.head_mm[-1][-1] == pytest.approx(1.0, abs=3)


def test_a_target_behind_a_capsule_that_cannot_go_back_is_given_up():
    bench = Bench(folding__speed_mm_s=0.2, nodules=())
    pilot = bench.lead(targets_mm=[60.0, 20.0])
    assert "cannot_arrive" in happened(pilot)
    assert bench.folds[-1] == "unfolded"
