"""capsule record on the real firmware in the emulator, with all faults that a lab fears."""

import os

import numpy as np
import pytest

from support.bench import emulated
from support.bench.recorder import Recorder
from support.bench.workbench import Clock, TerminalCable, Workbench, taken_at_s

pytestmark = [pytest.mark.boards, pytest.mark.takes, emulated.needed]

# The lease, and the ramp from 25 mm/s at 25 mm/s^2.
LEASE_AND_RAMP_S = 5 + 1
# A bench so much faster than the clock still gets a question in each of its seconds.
SPEED = 4


class Bench(Workbench):
    """A logger and a peristalsis board on their cables, and recorders on them."""

    def __init__(self, folder):
        self.folder = folder
        self.logger = emulated.EmulatedBoard(emulated.LOGGER)
        self.motor = emulated.EmulatedBoard(emulated.PERISTALSIS)
        self.cable = TerminalCable(self.logger, folder / "ttyACM0")
        wave_cable = TerminalCable(self.motor, folder / "ttyACM1")
        self.options = "--port", self.cable.port, "--drive", wave_cable.port, "--size", "3"
        super().__init__(wave_cable, self.cable, world=Clock(self.logger), speed=SPEED)

    def record(self, *options, **settings):
        """Start capsule record."""
        return Recorder(self.folder, *self.options, *options, **settings)

    def run_until_samples(self, count):
        """Run until this many samples have reached the recorder."""
        self.run(lambda: self.cable.samples >= count)

    def stands(self, seconds=0.0):
        """Let time pass for the boards alone; return whether the coils are off, and stay so."""
        self.speed = None
        self.run_for(seconds)
        standing = self.motor.half_steps
        self.run_for(3)
        self.speed = SPEED
        return self.motor.coils == 0 and self.motor.half_steps == standing


@pytest.fixture
def bench(tmp_path):
    made = Bench(tmp_path)
    yield made
    Recorder.end_all()
    assert not made.cable.boot_loader_stuck, "the boot loader heard a byte"


def test_a_killed_recorder_leaves_no_motor_running_and_is_recovered(bench):
    recorder = bench.record("--name", "r01")
    bench.run_until_samples(150)
    (part,) = recorder.parts()
    recorder.wait_for_samples(100)  # on disk while it records
    Recorder(bench.folder, "--recover").expect(1, "another program is writing", "r01.csv.part")
    recorder.process.kill()
    recorder.process.wait()
    assert bench.stands(LEASE_AND_RAMP_S + 0.5)
    with part.open("ab") as stream:
        stream.write(b"99.9,1,2")  # as a power cut leaves it
    bench.record("--name", "r01").expect(10, "capsule record --recover")
    recover = Recorder(bench.folder, "--recover")
    recover.expect(0, "recovered", "8 bytes at its end left out: not a whole line")
    recording = recorder.recording()
    assert recording.time_s.size >= 100
    # Each row holds the sample of its time.
    np.testing.assert_allclose(np.diff(recording.time_s), 0.1, atol=1e-9)
    taken_s = np.array([taken_at_s(sample) for sample in recording.values.T])
    assert np.ptp(taken_s - recording.time_s) <= 0.012
    assert recorder.parts() == []
    Recorder(bench.folder, "--recover").expect(0, "nothing to recover")


# A call that never returns, which no signal ends: Python runs no handler meanwhile.
DEAD_DISK = """
import ctypes, os

fsync, libc, mutex = os.fsync, ctypes.CDLL(None), ctypes.create_string_buffer(256)
def hang(descriptor):
    for _ in range(2 if os.path.exists({dead!r}) else 0):
        libc.pthread_mutex_lock(mutex)
    fsync(descriptor)
os.fsync = hang
"""


def test_a_disk_that_hangs_lets_no_wave_run_on_and_a_second_ctrl_c_ends_at_once(bench):
    dead = bench.folder / "dead"
    (bench.folder / "sitecustomize.py").write_text(DEAD_DISK.format(dead=str(dead)))
    recorder = bench.record(env=os.environ | {"PYTHONPATH": str(bench.folder)})
    bench.run_until_samples(20)
    bench.speed = 1
    dead.touch()
    bench.run_for(0.5)
    recorder.press_ctrl_c()
    hung_s = bench.now_s
    bench.run(lambda: bench.motor.coils == 0)
    assert bench.now_s - hung_s < LEASE_AND_RAMP_S
    assert bench.stands()
    assert not recorder.done()
    recorder.press_ctrl_c()
    bench.run(recorder.done)
    recorder.expect(130, "ended at once by a second Ctrl-C")
    assert len(recorder.parts()) == 1
