"""Decisions of a pilot if sensors fail, boards are silent or the origami does not obey."""

from dataclasses import replace

import numpy as np
import pytest

from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.journey import Nodule
from capsule.phantom.parameters import with_values
from capsule.phantom.simulated_bench import bench_with
from capsule.survey.cycle import FOLD, STOP_WAVE, UNFOLD, Cycle
from capsule.survey.pilot import Pilot
from capsule.survey.sensing import Sensing

pytestmark = pytest.mark.takes(0.5)

DETECTOR = read_config_file(CONFIG / "config.yaml")["diagonal"]
PHANTOM = read_phantom(DEFAULT_TABLE, [])
AT_MM = 50.0  # of the nodule, in a gut without any other suspicion
GIVEN_UP = [("undecided", 0, [0])]
COSTLY = {"again", "lost", "late", "not_back"}


def lead(when=lambda *_: False, change=None, phantom=PHANTOM, nodules=True, **options):
    """Run a survey whose readings change when it is time; return pilot, bench and commands."""
    placed = [Nodule(AT_MM, 3.0)] if nodules else []
    bench = bench_with(phantom, seed=7, length_mm=110.0, nodules=placed, sensors=4)
    pilot, commands = Pilot(DETECTOR, 10.0, 4, **options), []
    while not pilot.cycle.over:
        due = [*pilot.tell("gut_ended", "the end of the gut")] if bench.at_end else []
        readings = bench.read(pilot.every)
        due += pilot.tick(change(readings) if when(bench, pilot) else readings)
        commands += due
        for command in due:
            bench.tell(command)
    return pilot, bench, commands


def without(*names, **changes):
    """Return what takes readings away."""

    def change(readings):
        lost = {name: np.full_like(getattr(readings, name), np.nan) for name in names}
        return replace(readings, **lost, **changes)

    return change


def dead_sensor(readings):
    return replace(readings, values=np.vstack([np.full(8, 512.0), readings.values[1:]]))


def since(state):
    return lambda bench, pilot: state in [event.after for event in pilot.log]


def for_4_s_of_a_pass(bench, pilot):
    beyond_mm = bench.head_mm[-1][-1] - AT_MM
    return pilot.cycle == Cycle("passing", retests=1) and 2 < beyond_mm < 4.2


def at(from_s, until_s=np.inf):
    return lambda bench, pilot: from_s < pilot.sensing.now_s < until_s


# A pass without evidence is no verdict; one that was spoilt comes again. A board that says nothing
# while the gut is explored costs nothing, and an origami that does not obey a verdict.
@pytest.mark.parametrize(
    # Of each place the status, the error of its position, and whether a pass has no evidence.
    ("when", "change", "found", "told"),
    [
        (since("returning"), dead_sensor, [("undecided", 0, [0, 1, 1])], ["again"]),
        (for_4_s_of_a_pass, without("values"), [("confirmed", 0, [0, 1, 0])], ["again"]),
        (since("finding"), without("wave_mm"), GIVEN_UP, ["lost"]),
        # Not felt for so long, it may be one wavelength off.
        (at(25, 80), without("values", fold="unknown"), [("confirmed", 80, [0, 0])], []),
        (at(50), without("wave_mm"), [], []),
        (lambda _, pilot: pilot.cycle.state == "folding", without(fold="folding"), GIVEN_UP,
         ["late", "not_back"] * 3),
        (since("unfolding"), without(fold="unfolding"), GIVEN_UP, ["late"] * 2),
    ],
)  # fmt: skip
def test_a_fault_costs_evidence_and_the_survey_ends_unfolded(when, change, found, told):
    pilot, bench, commands = lead(when, change)
    places = pilot.suspects.places
    for place, (status, may_be_off_mm, has_none) in zip(places, found, strict=True):
        assert (place.status, place.may_be_off_mm) == (status, may_be_off_mm)
        assert np.isnan(place.evidence).tolist() == has_none and abs(place.first_mm - AT_MM) < 8
    assert (FOLD in commands) == bool(places)
    assert [event.event for event in pilot.log if event.event in COSTLY] == told
    assert pilot.cycle.no_return == ("not_back" in told)
    # It is told to unfold as long as anybody listens.
    assert (bench.origami, commands[-1]) == ("the origami is unfolded", UNFOLD)
    passed = [event.score for event in pilot.log if event.before == "passing"]
    assert passed == [score for place in places for score in place.evidence[1:]]


def test_it_goes_back_to_a_target_and_stays():
    for speed_mm_s, targets_mm, near_mm, before in (
        # The last one lies where the first was reached.
        (-0.8, [80.0, 50.0, 80.0], 5, "approaching"),
        # Reckoned from the start, where nothing is felt.
        (-0.4, [40.0, 1.0], 3, "finding"),
    ):
        phantom = with_values(PHANTOM, {"folding.speed_mm_s": speed_mm_s})
        pilot, bench, commands = lead(phantom=phantom, nodules=False, targets_mm=targets_mm)
        assert [event.event for event in pilot.log[-2:]] == ["arrived", "tick"]
        assert pilot.log[-2].before == before
        way_mm = np.concatenate(bench.head_mm)
        assert way_mm[-1] == pytest.approx(targets_mm[-1], abs=near_mm)
        assert way_mm[np.argmax(way_mm > targets_mm[0] - 5) :].min() < targets_mm[1] + 5
        # The wave is stopped, so the capsule stays.
        assert commands[-1] == STOP_WAVE


# Kills: a position that is one wavelength off, and nobody says so.
def test_a_capsule_that_was_not_felt_for_long_may_be_one_wavelength_off():
    bench = bench_with(PHANTOM, seed=7, length_mm=200.0, nodules=[], sensors=4)
    sensing = Sensing(DETECTOR, 10.0)
    # After 55 s a fast one could have travelled half a wavelength, though this one has not.
    for unfelt_s, may_be_off_mm, is_off_mm in ((1, 0, 0), (30, 0, 0), (55, 80, 0), (100, 80, -80)):
        sensing.take(without("values")(bench.read(10 * unfelt_s)))
        for _ in range(25):
            sensing.take(bench.read(8))
            sensing.follow()
        assert sensing.position_mm - bench.head_mm[-1][-1] == pytest.approx(is_off_mm, abs=5)
        assert sensing.may_be_off_mm == may_be_off_mm
