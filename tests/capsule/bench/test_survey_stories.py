"""capsule survey on the real firmware in the emulator: what moves stops, and it ends unfolded."""

import json

import numpy as np
import pytest

from support.bench import emulated

pytestmark = [pytest.mark.boards, emulated.needed]
# The lease, and the ramp from 25 mm/s at 25 mm/s^2.
LEASE_AND_RAMP_S = 5 + 1


@pytest.fixture
def folded(rig):
    """Return a bench on its way back, and the survey that leads it."""
    bench = rig()
    # The first target is reached as soon as the wave is felt.
    surveyor = bench.survey("--goto", 11, 3)
    surveyor.run(lambda: bench.fold.folded == 1.0)
    return bench, surveyor


def check_ended(bench):
    """Check that the wave stands, the origami is unfolded, and the session is whole."""
    assert bench.at_rest()
    assert bench.wave_board.coils == 0
    assert bench.events()[-1]["after"] == "ended"
    assert len({len(row) for row in bench.stream()}) == 1
    assert not list((bench.folder / "tuesday").glob("*.part"))


def test_it_goes_to_a_target_and_stops_the_wave_there(rig):
    bench = rig()
    bench.survey("--goto", 14).expect(0)
    check_ended(bench)
    assert bench.gut.head_mm == pytest.approx(14.0, abs=5)
    time_s = np.array([float(row[0]) for row in bench.stream()])
    np.testing.assert_allclose(np.diff(time_s), 0.1, atol=1e-9)
    # The wave's way is that of the cams, whatever the lines' delays.
    wave_mm = np.array([float(row[5]) for row in bench.stream()[20:-20]])
    np.testing.assert_allclose(np.diff(wave_mm), 2.5, atol=0.3)
    about = json.loads((bench.folder / "tuesday" / "session.json").read_text())
    assert about["index_mm"] is not None
    assert about["header"]["source"] == "recorded by the logger board, firmware 1.1"
    assert about["header"]["wave_speed_mm_s"] == "25"


def test_a_computer_that_dies_leaves_all_at_rest_and_the_next_one_goes_on(folded):
    bench, surveyor = folded
    surveyor.kill()
    before = (bench.folder / "tuesday" / "stream.csv.part").read_bytes()
    bench.pass_by(4)
    assert bench.fold.folded == 1.0
    # The lease of 5 s and a move of 5 s.
    bench.pass_by(8)
    assert bench.at_rest()
    # Opening the ports resets the boards; the index tells where the cams are.
    surveyor = bench.resume()
    surveyor.run(lambda: "mm from the goal" in surveyor.printed)
    head_mm = bench.gut.head_mm
    surveyor.send_signal()
    surveyor.expect(130)
    check_ended(bench)
    found = next(event for event in bench.events() if "from the goal" in event["reason"])
    assert found["position_mm"] == pytest.approx(head_mm, abs=4)
    # What was there stays; the time in which nobody looked is a jump, and no row.
    whole = before[: before.rfind(b"\n", 0, -700) + 1]
    assert (bench.folder / "tuesday" / "stream.csv").read_bytes().startswith(whole)
    steps_s = np.diff([float(row[0]) for row in bench.stream()])
    assert np.count_nonzero(steps_s > 0.15) == 1


def test_a_link_that_is_lost_while_folded_and_returns_costs_time_alone(folded):
    bench, surveyor = folded
    surveyor.run(lambda: " returning " in surveyor.printed)
    bench.cables.fold.unplug()
    pulled_s = bench.now_s
    surveyor.run(lambda: bench.now_s > pulled_s + 6)
    bench.cables.fold.plug()
    surveyor.run(lambda: " finding " in surveyor.printed)
    surveyor.send_signal()
    surveyor.expect(130, "was unplugged")
    check_ended(bench)
    assert "let_go" in [event["event"] for event in bench.events()]
    times_s = [float(row[0]) for row in bench.stream()]
    assert times_s == pytest.approx([number / 10 for number in range(len(times_s))])


def test_an_end_switch_that_never_says_unfolded_ends_the_survey(folded):
    bench, surveyor = folded
    bench.fold.origami.stuck["unfolded"] = False
    surveyor.expect(14, "the switch unfolded did not close", "look before you pull the capsule out")
    # Unfolded it is: only nobody can say so. Of three spare turns, two were let out at most.
    check_ended(bench)
    assert -2 * 4076 < bench.fold.origami.wound < 0


def test_ctrl_c_stops_the_wave_before_the_origami_unfolds(folded):
    bench, surveyor = folded
    bench.fold.origami.stalled = True
    surveyor.send_signal()
    pressed_s = bench.now_s
    surveyor.run(lambda: bench.wave_board.coils == 0)
    assert bench.now_s - pressed_s < 1.5
    assert bench.fold.folded > 0.5
    surveyor.expect(14)
    assert bench.wave_board.coils == 0


def test_ctrl_c_before_the_first_sample_ends_a_survey_at_once(rig):
    bench = rig()
    bench.cables.logger.spoil = lambda frame: b"" if b"$D," in frame else frame
    surveyor = bench.survey("--goto", 11, 3)
    surveyor.run(lambda: bench.wave_board.half_steps > 500)
    surveyor.send_signal()
    pressed_s = bench.now_s
    surveyor.expect(130, "before the first sample")
    assert bench.now_s - pressed_s < 3
    assert bench.at_rest()
    assert not (bench.folder / "tuesday").exists()


def test_a_survey_that_was_stopped_starts_nothing_itself(folded):
    bench, surveyor = folded
    # Ctrl-Z. A pseudo-terminal that nobody reads is soon full, so the logger is quiet meanwhile.
    bench.cables.logger.spoil = lambda frame: b""
    bench.pass_by(LEASE_AND_RAMP_S + 6)
    assert bench.at_rest()
    bench.cables.logger.spoil = None
    standing = bench.wave_board.half_steps, bench.fold_board.half_steps
    surveyor.expect(1, "this program was stopped for", "capsule survey --resume")
    bench.pass_by(5)
    assert (bench.wave_board.half_steps, bench.fold_board.half_steps) == standing
