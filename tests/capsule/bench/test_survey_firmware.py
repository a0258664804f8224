"""capsule survey on the real firmware in the emulator: the faults that the firmware handles."""

import pytest

from support.bench import emulated

pytestmark = [pytest.mark.boards, emulated.needed]
# The first target is reached as soon as the wave is felt.
BACK_SOON = "--goto", 11, 3


def test_a_computer_that_dies_leaves_all_at_rest_and_the_next_one_goes_on(emulated_rig):
    bench = emulated_rig("wave", "fold")
    surveyor = bench.survey(*BACK_SOON)
    surveyor.run(lambda: bench.fold.folded == 1.0)
    surveyor.kill()
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
    assert bench.at_rest()
    found = next(event for event in bench.events() if "from the goal" in event["reason"])
    assert found["position_mm"] == pytest.approx(head_mm, abs=4)


def test_a_peristalsis_board_that_is_reset_is_started_again_and_its_phase_found(emulated_rig):
    bench = emulated_rig("wave")
    surveyor = bench.survey("--goto", 22)
    surveyor.run(lambda: bench.gut.head_mm > 12)
    bench.cables.wave.press_reset()
    surveyor.expect(0, "was reset", "starts the wave again")
    assert bench.at_rest()
    assert bench.gut.head_mm == pytest.approx(22.0, abs=5)


def test_a_peristalsis_board_whose_supply_is_weak_is_started_three_times_again(emulated_rig):
    bench = emulated_rig("wave")
    surveyor = bench.survey("--goto", 22)
    surveyor.run(lambda: bench.gut.head_mm > 5)
    starts = 1
    while surveyor.returncode is None:
        bench.cables.wave.press_reset()
        surveyor.run(lambda: bench.wave_board.coils == 0)
        surveyor.run(lambda: bench.wave_board.coils != 0)
        starts += bench.wave_board.coils != 0
    assert starts == 1 + 3
    surveyor.expect(1, "check its supply")
    assert bench.wave_board.coils == 0


def test_an_end_switch_that_never_says_folded_is_given_up_after_three_tries(emulated_rig):
    bench = emulated_rig("fold")
    bench.fold.origami.stuck["folded"] = False
    bench.survey(*BACK_SOON).expect(13, "reports a fault", "cannot go back")
    assert bench.at_rest()
    assert "folded" not in {row[-1] for row in bench.stream()}


def test_a_fold_motor_that_hums_is_given_up_after_three_tries(emulated_rig):
    bench = emulated_rig("fold")
    bench.fold.origami.stalled = True
    bench.survey(*BACK_SOON).expect(13, "reports a fault", "cannot go back")
    assert bench.at_rest()
    assert bench.fold.origami.wound == 0


def test_an_end_switch_that_never_says_unfolded_ends_the_survey(emulated_rig):
    bench = emulated_rig("fold")
    surveyor = bench.survey(*BACK_SOON)
    surveyor.run(lambda: bench.fold.folded == 1.0)
    bench.fold.origami.stuck["unfolded"] = False
    surveyor.expect(14, "the switch unfolded did not close", "look before you pull the capsule out")
    # Unfolded it is: only nobody can say so. Of three spare turns, two were let out at most.
    assert bench.at_rest()
    assert -2 * 4076 < bench.fold.origami.wound < 0
    assert bench.events()[-1]["after"] == "ended"
