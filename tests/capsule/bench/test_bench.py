"""capsule record on the real firmware in the emulator, on a disk that dies, and recovered."""

import os
import signal

import numpy as np
import pytest

from support.bench import emulated
from support.bench.recorder import Recorder
from support.bench.workbench import Clock, TerminalCable, Workbench, taken_at_s

pytestmark = [pytest.mark.boards, pytest.mark.takes, emulated.needed]

# The lease, and the ramp from 25 mm/s at 25 mm/s^2.
LEASE_AND_RAMP_S = 5 + 1
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


def test_a_disk_that_hangs_lets_no_wave_run_on_and_its_samples_are_recovered(tmp_path):
    logger, motor = map(emulated.EmulatedBoard, (emulated.LOGGER, emulated.PERISTALSIS))
    cable, wave_cable = (
        TerminalCable(board, tmp_path / name) for board, name in ((logger, "A"), (motor, "B"))
    )
    # A bench so much faster than the clock still gets a question in each of its seconds.
    bench = Workbench(wave_cable, cable, world=Clock(logger), speed=4)
    words = ("--port", cable.port, "--drive", wave_cable.port, "--size", "3", "--name", "r01")
    dead = tmp_path / "dead"
    (tmp_path / "sitecustomize.py").write_text(DEAD_DISK.format(dead=str(dead)))
    recorder = Recorder(tmp_path, *words, env=os.environ | {"PYTHONPATH": str(tmp_path)})
    bench.run(lambda: cable.samples >= 150)
    recorder.wait_for_samples(100)  # on disk while it records
    Recorder(tmp_path, "--recover").expect(1, "another program is writing", "r01.csv.part")
    bench.speed = 1
    dead.touch()
    bench.run_for(0.5)
    recorder.process.send_signal(signal.SIGINT)
    hung_s = bench.now_s
    bench.run(lambda: motor.coils == 0)
    assert bench.now_s - hung_s < LEASE_AND_RAMP_S
    assert not recorder.done()
    # The second Ctrl-C ends it at once, as a kill does.
    recorder.process.send_signal(signal.SIGINT)
    bench.run(recorder.done)
    recorder.expect(130, "ended at once by a second Ctrl-C")
    bench.speed, standing = None, motor.half_steps
    bench.run_for(LEASE_AND_RAMP_S)
    assert (motor.coils, motor.half_steps) == (0, standing)
    (part,) = recorder.parts()
    with part.open("ab") as stream:
        stream.write(b"99.9,1,2")  # as a power cut leaves it
    Recorder(tmp_path, *words).expect(10, "capsule record --recover")
    recover = Recorder(tmp_path, "--recover")
    recover.expect(0, "recovered", "8 bytes at its end left out: not a whole line")
    recording = recorder.recording()
    assert recording.time_s.size >= 100
    # Each row holds the sample of its time.
    np.testing.assert_allclose(np.diff(recording.time_s), 0.1, atol=1e-9)
    taken_s = np.array([taken_at_s(sample) for sample in recording.values.T])
    assert np.ptp(taken_s - recording.time_s) <= 0.012
    Recorder(tmp_path, "--recover").expect(0, "nothing to recover")
    assert not cable.boot_loader_stuck, "the boot loader heard a byte"
