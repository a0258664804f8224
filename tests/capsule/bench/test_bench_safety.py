"""Recorder and survey on the real firmware: what moves stops, whoever dies and whenever."""

import itertools
import os
import signal
import time

import pytest

from support.bench import emulated
from support.bench.cable import TerminalCable
from support.bench.recorder import Recorder, count_samples
from support.bench.workbench import Workbench
from support.bench.world import Clock

pytestmark = [pytest.mark.boards, pytest.mark.takes, emulated.needed]
BACK_SOON = "--goto", 11, 3
# The lease, and the ramp from 25 mm/s at 25 mm/s^2.
LEASE_AND_RAMP_S = 5 + 1
# A bench so much faster than the clock still gets a question in each of its seconds.
SPEED = 4


class DrivenBench:
    """A logger and a peristalsis board, both with their firmware, and a recorder."""

    def __init__(self, folder, **settings):
        self.logger = emulated.EmulatedBoard(emulated.LOGGER)
        self.motor = emulated.EmulatedBoard(emulated.PERISTALSIS)
        self.cable = TerminalCable(self.logger, folder / "ttyACM0")
        self.wave = TerminalCable(self.motor, folder / "ttyACM1")
        self.bench = Workbench(self.cable, self.wave, world=Clock(self.logger), speed=SPEED)
        ports = ("--port", self.cable.port, "--drive", self.wave.port)
        self.recorder = Recorder(folder, *ports, "--size", "3", **settings)

    def run(self, until):
        """Run in step with the recorder until a condition holds."""
        self.bench.run(until)

    def has_said(self, frame):
        """Return whether the peristalsis board has sent a frame that begins like this."""
        return any(said.startswith(frame) for said in self.wave.whole)

    def samples(self):
        """Return how many samples have reached the recorder."""
        return count_samples(self.cable.whole)

    def pass_by(self, seconds):
        """Let time pass for the boards alone."""
        self.bench.speed = None
        self.bench.run_for(seconds)
        self.bench.speed = SPEED

    def stands(self):
        """Return whether the coils are off, and stay so."""
        standing = self.motor.half_steps
        self.pass_by(3)
        return self.motor.coils == 0 and self.motor.half_steps == standing


@pytest.fixture
def driven(tmp_path):
    yield DrivenBench(tmp_path)
    Recorder.end_all()


RECORDING = {
    "it sets the wave up": lambda driven: driven.has_said(b"$A,direction"),
    "it has a lease": lambda driven: driven.has_said(b"$A,lease,5"),
    "it starts the wave": lambda driven: driven.motor.coils != 0,
    "the wave has its speed": lambda driven: driven.motor.half_steps > 1000,
    "it records": lambda driven: driven.samples() > 20,
}


@pytest.mark.parametrize("step", RECORDING)
def test_a_recorder_that_is_killed_leaves_no_motor_running(driven, step):
    driven.run(lambda: RECORDING[step](driven))
    driven.recorder.process.kill()
    driven.recorder.process.wait()
    driven.pass_by(LEASE_AND_RAMP_S + 0.5)
    assert driven.stands()


def test_a_recorder_that_is_killed_while_the_wave_ramps_down_leaves_no_motor_running(driven):
    driven.run(lambda: driven.samples() > 20)
    driven.recorder.press_ctrl_c()
    driven.run(lambda: driven.has_said(b"$A,stop"))
    driven.recorder.process.kill()
    driven.recorder.process.wait()
    driven.pass_by(1.5)
    assert driven.stands()


def test_the_wave_starts_only_when_file_log_and_ctrl_c_are_ready(driven):
    driven.run(lambda: driven.motor.coils != 0)
    assert len(driven.recorder.parts()) == 1
    assert driven.recorder.log()
    driven.recorder.press_ctrl_c()
    driven.run(driven.recorder.done)
    # Either no sample had come yet, or the run is archived: never a traceback, never a wave.
    assert driven.recorder.process.returncode in (0, 1)
    assert "Traceback" not in driven.recorder.output[1]
    driven.pass_by(1.5)
    assert driven.stands()


def test_a_board_that_is_reset_in_mid_run_leaves_no_evidence_after_that(driven):
    driven.run(lambda: driven.samples() > 100)
    driven.bench.speed = 1
    driven.motor.reset()
    driven.bench.run_for(2.5)
    driven.recorder.press_ctrl_c()
    driven.run(driven.recorder.done)
    driven.recorder.expect(0, "no wave runs", "so only what came before is evidence")
    until_s = float(driven.recorder.recording().header["wave_until_s"])
    assert 5 < until_s < 11  # a question later or earlier, and this bench is fast
    assert f"the wave runs until {until_s:g}" in driven.recorder.log()


def test_a_wave_that_stopped_while_the_recorder_was_stopped_is_noticed_and_stays_stopped(driven):
    driven.run(lambda: driven.samples() > 20)
    driven.recorder.process.send_signal(signal.SIGSTOP)
    driven.pass_by(LEASE_AND_RAMP_S + 0.5)
    assert driven.motor.coils == 0
    standing = driven.motor.half_steps
    driven.recorder.process.send_signal(signal.SIGCONT)
    driven.bench.speed = 1
    driven.bench.run_for(2)
    assert driven.motor.half_steps == standing
    driven.recorder.press_ctrl_c()
    driven.run(driven.recorder.done)
    driven.recorder.expect(0, "no wave runs", "does not start it again")


def test_a_wave_is_watched_again_after_the_recorder_was_stopped(driven):
    driven.run(lambda: driven.samples() > 20)
    driven.recorder.process.send_signal(signal.SIGSTOP)
    # For the computer it is longer than a board may be silent, for the boards a moment.
    time.sleep(5.5)
    driven.recorder.process.send_signal(signal.SIGCONT)
    driven.bench.speed = 1
    driven.bench.run_for(1)
    driven.recorder.press_ctrl_c()
    driven.run(driven.recorder.done)
    said = driven.recorder.expect(0, "at 25.0 mm/s")
    assert "does not answer" not in said and "no wave" not in said


def test_ctrl_c_is_heard_at_once_while_a_board_comes_back(driven):
    driven.run(lambda: driven.samples() > 20)
    driven.bench.speed = 1
    driven.cable.unplug()
    driven.bench.run_for(0.5)
    driven.cable.spoil = lambda frame: b""  # its board says nothing that arrives
    driven.cable.plug()
    driven.bench.run(lambda: driven.cable.opened)
    driven.bench.run_for(0.5)
    pressed_s = time.monotonic()
    driven.recorder.press_ctrl_c()
    driven.run(driven.recorder.done)
    assert time.monotonic() - pressed_s < 1.5
    driven.recorder.expect(0, "archived")
    driven.pass_by(1.5)
    assert driven.stands()


DEAD_DISK = """
import os, time

fsync = os.fsync
def hang(descriptor):
    while os.path.exists({dead!r}):
        time.sleep(0.01)
    fsync(descriptor)
os.fsync = hang
"""


def test_a_disk_that_hangs_lets_no_wave_run_on_and_a_second_ctrl_c_ends_at_once(tmp_path):
    dead = tmp_path / "dead"
    (tmp_path / "sitecustomize.py").write_text(DEAD_DISK.format(dead=str(dead)))
    driven = DrivenBench(tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)})
    driven.run(lambda: driven.samples() > 20)
    driven.bench.speed = 1
    dead.touch()
    driven.bench.run_for(0.5)
    driven.recorder.press_ctrl_c()
    hung_s = driven.bench.now_s
    driven.bench.run(lambda: driven.motor.coils == 0)
    assert driven.bench.now_s - hung_s < LEASE_AND_RAMP_S
    assert driven.stands()
    assert not driven.recorder.done()
    driven.recorder.press_ctrl_c()
    driven.bench.run(driven.recorder.done)
    driven.recorder.expect(130)
    assert len(driven.recorder.parts()) == 1


SURVEY = {
    "it sets the wave up": lambda bench: bench.has_said("wave", b"$A,direction"),
    "it starts the wave": lambda bench: bench.wave_board.coils != 0,
    "the capsule travels": lambda bench: bench.gut.head_mm > 5,
    "it folds": lambda bench: bench.fold.folded > 0.3,
    "it is folded": lambda bench: bench.fold.folded == 1.0,
}


@pytest.mark.parametrize("step", SURVEY)
def test_a_survey_that_is_killed_leaves_no_motor_running(emulated_rig, step):
    bench = emulated_rig("wave", "fold")
    bench.has_said = lambda name, frame: any(
        said.startswith(frame) for said in getattr(bench.cables, name).whole
    )
    surveyor = bench.survey(*BACK_SOON)
    surveyor.run(lambda: SURVEY[step](bench))
    surveyor.kill()
    # The steepest ramp of a survey is steeper; the fold's lease of 5 s and a move of 5 s.
    bench.pass_by(LEASE_AND_RAMP_S + 0.5)
    assert bench.wave_board.coils == 0
    bench.pass_by(5)
    assert bench.at_rest()
    assert bench.fold_board.coils == 0


@pytest.mark.parametrize("stuck", [False, True], ids=["free thread", "stuck thread"])
def test_ctrl_c_stops_the_wave_before_the_origami_unfolds(emulated_rig, stuck):
    bench = emulated_rig("wave", "fold")
    surveyor = bench.survey(*BACK_SOON)
    surveyor.run(lambda: bench.fold.folded == 1.0)
    bench.fold.origami.stalled = stuck
    surveyor.send_signal()
    pressed_s = bench.now_s
    surveyor.run(lambda: bench.wave_board.coils == 0)
    assert bench.now_s - pressed_s < 1.5
    assert bench.fold.folded > 0.5
    surveyor.expect(14 if stuck else 130)
    assert bench.wave_board.coils == 0
    if not stuck:
        assert bench.at_rest()


def test_ctrl_c_while_a_survey_waits_for_its_boards_ends_it_at_once(emulated_rig):
    bench = emulated_rig("wave", "fold")
    bench.cables.fold.spoil = lambda frame: b""
    surveyor = bench.survey(*BACK_SOON)
    surveyor.run(lambda: bench.cables.fold.opened)
    surveyor.send_signal()
    pressed_s = bench.now_s
    surveyor.expect(130)
    assert bench.now_s - pressed_s < 0.5
    assert not (bench.folder / "tuesday").exists()


def test_ctrl_c_before_the_first_sample_ends_a_survey_at_once(emulated_rig):
    bench = emulated_rig("wave", "fold")
    bench.cables.logger.spoil = lambda frame: b"" if b"$D," in frame else frame
    surveyor = bench.survey(*BACK_SOON)
    surveyor.run(lambda: bench.wave_board.half_steps > 500)
    surveyor.send_signal()
    pressed_s = bench.now_s
    surveyor.expect(130, "before the first sample")
    assert bench.now_s - pressed_s < 3
    assert bench.at_rest()
    assert not (bench.folder / "tuesday").exists()


def test_a_survey_that_was_stopped_starts_nothing_itself_and_is_resumed_by_the_user(emulated_rig):
    bench = emulated_rig("wave", "fold")
    surveyor = bench.survey(*BACK_SOON)
    surveyor.run(lambda: bench.fold.folded == 1.0)
    # Ctrl-Z. A pseudo-terminal that nobody reads is soon full, so the logger is quiet meanwhile.
    bench.cables.logger.spoil = lambda frame: b""
    bench.pass_by(LEASE_AND_RAMP_S + 6)
    assert bench.at_rest()
    bench.cables.logger.spoil = None
    standing = bench.wave_board.half_steps, bench.fold_board.half_steps
    surveyor.expect(1, "this program was stopped for", "capsule survey --resume")
    bench.pass_by(5)
    assert (bench.wave_board.half_steps, bench.fold_board.half_steps) == standing
    bench.resume().expect(0)
    assert bench.at_rest()


def test_a_survey_that_was_stopped_for_a_moment_goes_on(emulated_rig):
    bench = emulated_rig("wave", "fold")
    surveyor = bench.survey(*BACK_SOON)
    surveyor.run(lambda: bench.gut.head_mm > 5)
    bench.pass_by(3)
    surveyor.expect(0)
    assert bench.at_rest()


def test_a_fold_board_whose_identity_does_not_arrive_is_rarely_reset(emulated_rig):
    bench = emulated_rig("fold")
    resets = []
    reset = bench.fold_board.reset
    bench.fold_board.reset = lambda: (resets.append(bench.now_s), reset())
    surveyor = bench.survey(*BACK_SOON, "--patience", 50)
    surveyor.run(lambda: bench.gut.head_mm > 5)
    bench.cables.fold.spoil = lambda frame: b"" if b"$I," in frame else frame
    bench.cables.fold.unplug()
    bench.cables.fold.plug()
    resets.clear()
    surveyor.run(lambda: bool(resets))
    begun_s = bench.now_s
    surveyor.run(lambda: bench.now_s > begun_s + 40)
    gaps_s = [after - before for before, after in itertools.pairwise(resets)]
    assert len(gaps_s) >= 2
    assert min(gaps_s) >= 10
    bench.cables.fold.spoil = None
    surveyor.expect(0, "is back")
    assert bench.at_rest()
