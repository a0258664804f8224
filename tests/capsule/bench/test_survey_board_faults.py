"""capsule survey on boards that fail: the origami unfolds, and missing samples give no verdict."""

import itertools
import json

import numpy as np
import pytest

from capsule.phantom.journey import Nodule
from support.bench.rig import needed

pytestmark = [pytest.mark.boards, needed]
AT_MM = 45.0
THERE_AND_BACK = "--goto", 25, 12
SOON = "--patience", 15


def folded(bench):
    """Return a function that returns whether the origami is folded."""
    return lambda: bench.fold.folded == 1.0


def happened_so_far(bench):
    lines = (bench.folder / "tuesday" / "events.jsonl.part").read_text().splitlines()
    return [json.loads(line)["event"] for line in lines]


def happened(bench):
    return [event["event"] for event in bench.events()]


def check_ended(bench):
    """Check that the origami is unfolded, and that the session can be read."""
    assert bench.at_rest()
    assert bench.events()[-1]["after"] == "ended"
    assert len({len(row) for row in bench.stream()}) == 1
    assert (bench.folder / "tuesday" / "places.csv").exists()
    assert not list((bench.folder / "tuesday").glob("*.part"))


# The capsule.


def test_an_awn_that_is_caught_holds_up_but_misleads_nobody(rig):
    sticky = {"catch_probability": 1.0, "catch_slope": 0.2, "hold_waves": 12.0}
    changes = {f"advance__{name}": value for name, value in sticky.items()}
    bench = rig(nodules=[Nodule(12.0, 4.0)], **changes)
    bench.survey("--goto", 25).expect(0)
    check_ended(bench)
    assert bench.gut.head_mm == pytest.approx(25.0, abs=5)
    # Free, it comes there in less than a minute.
    assert bench.now_s > 100


def test_an_awn_that_is_caught_folded_is_no_way_back(rig):
    bench = rig(folding__speed_mm_s=0.0, length_mm=150.0)
    bench.survey(*THERE_AND_BACK).expect(13, "cannot go back")
    check_ended(bench)
    assert bench.fold.said.count("folded") == 3


def test_the_start_of_the_gut_holds_it_up_and_is_no_fault(rig):
    bench = rig(folding__speed_mm_s=-0.8)
    surveyor = bench.survey("--goto", 20, 9)
    surveyor.run(folded(bench))
    surveyor.run(lambda: bench.gut.head_mm <= 0)
    surveyor.expect(0)
    check_ended(bench)
    assert bench.gut.head_mm == pytest.approx(9.0, abs=5)


def test_a_sensor_that_dies_in_mid_cycle_leaves_the_place_undecided(rig):
    bench = rig(nodules=[Nodule(AT_MM, 3.0)])
    surveyor = bench.survey()
    surveyor.run(folded(bench))
    bench.gut.dead[1] = 512.0
    surveyor.expect(0, "0 confirmed, 0 dismissed")
    check_ended(bench)
    assert {place["status"] for place in bench.places()} == {"undecided"}
    assert {place["passes"] for place in bench.places()} == {"1"}


def test_a_second_nodule_passed_in_the_return_is_judged_for_itself(rig):
    nodules = [Nodule(AT_MM, 3.0), Nodule(AT_MM + 25, 4.0)]
    bench = rig(nodules=nodules, length_mm=110.0)
    bench.survey().expect(0)
    check_ended(bench)
    confirmed = [float(row["place_mm"]) for row in bench.places() if row["status"] == "confirmed"]
    assert confirmed == pytest.approx([AT_MM, AT_MM + 25], abs=5)


# The origami.


def test_a_thread_that_is_stuck_halfway_ends_the_survey(rig):
    bench = rig()
    surveyor = bench.survey(*THERE_AND_BACK)
    surveyor.run(lambda: bench.fold.folded > 0.5)
    bench.fold.stalled = True
    surveyor.expect(14, "reports a fault", "look before you pull the capsule out")
    assert bench.events()[-1]["after"] == "ended"
    assert "folding" in {row[-1] for row in bench.stream()}
    # It was told to unfold to the last.
    assert bench.fold.said[-1] in ("unfolding", "fault")


def test_a_fold_board_that_is_reset_while_it_folds_is_noticed_at_once(rig):
    bench = rig()
    surveyor = bench.survey(*THERE_AND_BACK)
    surveyor.run(lambda: bench.fold.folded > 0.3)
    bench.cables.fold.press_reset()
    reset_s = bench.now_s
    surveyor.run(lambda: "let_go" in happened_so_far(bench))
    # The boot loader takes a second, a judgement 0.8 s.
    assert bench.now_s - reset_s < 3
    surveyor.expect(0)
    check_ended(bench)
    assert "let_go" in happened(bench)
    assert "late" not in happened(bench)
    assert bench.gut.head_mm == pytest.approx(12.0, abs=5)


def test_a_motor_that_has_to_rest_is_waited_for_and_is_no_fault(rig):
    bench = rig()
    surveyor = bench.survey(*THERE_AND_BACK)
    surveyor.run(lambda: bench.gut.head_mm > 20)
    bench.fold.has_run(10.0, ago_s=40.0)
    surveyor.expect(0, "the motor has to rest")
    check_ended(bench)
    assert bench.gut.head_mm == pytest.approx(12.0, abs=5)
    assert "resting" in {row[-1] for row in bench.stream()}
    assert "late" not in happened(bench)


# The wave.


def test_without_an_index_switch_a_reset_ends_the_survey(rig):
    # Its firmware is older than lease and index.
    bench = rig(indexed=False)
    bench.wave.commands = tuple(name for name in bench.wave.commands if name != "lease")
    surveyor = bench.survey(*THERE_AND_BACK, *SOON)
    surveyor.run(lambda: bench.gut.head_mm > 15)
    bench.cables.wave.press_reset()
    surveyor.expect(11, "if this computer fails", "has no index switch")
    check_ended(bench)


def test_a_wave_motor_that_hums_is_noticed_by_the_missing_index(rig):
    bench = rig()
    surveyor = bench.survey(*THERE_AND_BACK)
    surveyor.run(lambda: bench.gut.head_mm > 15)
    bench.wave.stalled = True
    hummed_s = bench.now_s
    surveyor.run(lambda: bench.now_s > hummed_s + 12)
    bench.wave.stalled = False
    surveyor.expect(0)
    check_ended(bench)
    assert bench.gut.head_mm == pytest.approx(12.0, abs=5)
    unknown = [float(row[0]) for row in bench.stream() if row[5] == ""]
    assert unknown[-1] - unknown[0] > 8


# The links.


def test_noise_on_all_lines_costs_samples_and_no_more(rig):
    bench = rig()
    numbers = itertools.count()

    def spoil(frame):
        return frame[:-5] + b"\xff\n" if next(numbers) % 12 == 0 else frame

    for cable in vars(bench.cables).values():
        cable.spoil = spoil
    bench.survey(*THERE_AND_BACK).expect(0)
    check_ended(bench)
    assert bench.gut.head_mm == pytest.approx(12.0, abs=5)
    assert 0.05 < np.mean([row[1] == "" for row in bench.stream()]) < 0.12


@pytest.mark.parametrize(
    ("name", "when"),
    [("logger", "folded"), ("wave", "unfolded"), ("fold", "folded"), ("fold", "unfolded")],
)
def test_a_link_that_is_lost_and_returns_costs_time_alone(rig, name, when):
    bench = rig()
    surveyor = bench.survey(*THERE_AND_BACK)
    surveyor.run(folded(bench) if when == "folded" else lambda: bench.gut.head_mm > 15)
    cable = getattr(bench.cables, name)
    cable.unplug()
    pulled_s = bench.now_s
    surveyor.run(lambda: bench.now_s > pulled_s + 8)
    cable.plug()
    surveyor.expect(0, "was unplugged", "is back")
    check_ended(bench)
    assert bench.gut.head_mm == pytest.approx(12.0, abs=5)
    times_s = [float(row[0]) for row in bench.stream()]
    assert times_s == pytest.approx([number / 10 for number in range(len(times_s))])


@pytest.mark.parametrize("name", ["logger", "wave", "fold"])
def test_a_link_that_is_lost_for_good_ends_the_survey(rig, name):
    bench = rig()
    surveyor = bench.survey(*THERE_AND_BACK, *SOON)
    surveyor.run(folded(bench))
    getattr(bench.cables, name).unplug()
    surveyor.expect(11, "was unplugged", "(--patience)")
    assert bench.events()[-1]["after"] == "ended"
    # A board that has lost its supply stops, or unfolds, as soon as it has it again.
    getattr(bench.cables, name).plug()
    bench.pass_by(10)
    assert bench.at_rest()
