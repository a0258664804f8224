"""Simulated bench and recorder together, from the motor's steps to an accepted recording."""

import numpy as np
import pytest

from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.recordings.acceptance import readings_of
from support.bench import emulated
from support.bench.cable import TerminalCable
from support.bench.closed_loop import ClosedLoop
from support.bench.recorder import Recorder, check_complete
from support.bench.workbench import Workbench

pytestmark = [
    pytest.mark.boards,
    emulated.needed,
]


def test_a_run_over_a_3_mm_nodule_is_archived_and_accepted(tmp_path):
    motor = emulated.EmulatedBoard(emulated.PERISTALSIS)
    logger = emulated.EmulatedBoard(emulated.LOGGER)
    wave_cable = TerminalCable(motor, tmp_path / "ttyACM1")
    cable = TerminalCable(logger, tmp_path / "ttyACM0")
    phantom = read_phantom(DEFAULT_TABLE, [])
    world = ClosedLoop(phantom, 3.0, 1, motor, logger)
    # The emulator would outrun the recorder, which renews the lease of the wave.
    bench = Workbench(wave_cable, cable, world=world, speed=5)

    places = ("--port", cable.port, "--drive", wave_cable.port)
    recorder = Recorder(tmp_path, *places, "--size", "3", "--name", "bench")
    bench.run(recorder.done, limit_s=300, stretch_us=10_000)
    recorder.expect(0, "the capsule reached the end stop", "3mm/bench")

    # What was archived is what the phantom felt, sample by sample.
    recording = recorder.recording_named("3mm/bench")
    check_complete(recording, cable, ended_early=True)
    # A fast machine ends the run before a line of the terminal names the speed.
    assert recording.header["wave_speed_mm_s"] == "25"
    # 16.98 half-steps a mm, for the seconds that were recorded and a few of the start and the end.
    assert 0.95 < motor.half_steps / 16.982 / (25 * recording.time_s[-1]) < 1.2
    begun_s = logger.sample_times_us()[: recording.time_s.size] / 1e6
    expected = world.expected_counts(begun_s)
    assert np.abs(recording.values - expected).max() <= 2
    # Some seconds of the bench may pass between the start of the wave and that of the logger.
    assert recording.time_s.size > 0.9 * world.time_s.size
    assert np.ptp(recording.values, axis=1).min() > 20
    readings_of(recording, read_config_file(CONFIG / "config.yaml"))  # or raises why it is rejected
