"""A recorder on the real firmware: what moves stops, whoever dies and whenever."""

import os

import pytest

from support.bench import emulated
from support.bench.cable import TerminalCable
from support.bench.recorder import Recorder, count_samples
from support.bench.workbench import Workbench
from support.bench.world import Clock

pytestmark = [pytest.mark.boards, pytest.mark.takes, emulated.needed]
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


def test_a_recorder_that_is_killed_leaves_no_motor_running(driven):
    driven.run(lambda: driven.samples() > 20)
    driven.recorder.process.kill()
    driven.recorder.process.wait()
    driven.pass_by(LEASE_AND_RAMP_S + 0.5)
    assert driven.stands()


def test_a_board_that_is_reset_in_mid_run_leaves_no_evidence_after_that(driven):
    driven.run(lambda: driven.motor.coils != 0)
    assert len(driven.recorder.parts()) == 1 and driven.recorder.log()
    # Sensor 1 reads 0 for the clock's first 5 s: of a shorter run, that would be too much.
    driven.run(lambda: driven.samples() > 160)
    driven.bench.speed = 1
    driven.motor.reset()
    driven.bench.run_for(2.5)
    driven.recorder.press_ctrl_c()
    driven.run(driven.recorder.done)
    driven.recorder.expect(0, "no wave runs", "so only what came before is evidence")
    until_s = float(driven.recorder.recording().header["wave_until_s"])
    assert 11 < until_s < 17  # a question later or earlier, and this bench is fast
    assert f"the wave runs until {until_s:g}" in driven.recorder.log()


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
