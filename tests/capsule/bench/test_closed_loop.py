"""Simulated bench and recorder together, from the motor's steps to an accepted recording."""

import numpy as np
import pytest

from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import simulate_run
from capsule.recordings.acceptance import readings_of
from support.bench import emulated
from support.bench.cable import TerminalCable
from support.bench.recorder import Recorder, check_complete
from support.bench.workbench import Workbench

pytestmark = [
    pytest.mark.boards,
    emulated.needed,
]


class ClosedLoop:
    """A world that couples a peristalsis board to a logger through the phantom.

    The wave is the phantom's clock: one run of the simulator advances by the time that the wave has
    travelled, so it stands still while the motor does.
    """

    def __init__(self, phantom, nodule_mm, seed, motor, logger):
        run = simulate_run(phantom, nodule_mm, seed, "closed loop")
        self.time_s, self.counts = run.time_s, run.counts
        electronics = phantom.electronics
        # Voltage in the middle of a step of the converter.
        self._voltages_mv = (run.counts + 0.5) * 1000 * electronics.vref_v / 2**electronics.adc_bits
        self._speed_mm_s = phantom.wall.speed_mm_s
        self._motor, self._logger = motor, logger
        self._phantom_s = 0.0
        self.progress_s = [(0.0, 0.0)]

    def __call__(self, start_s, end_s):
        """Move the capsule according to the motor's half-steps in the last stretch of time."""
        before_s = self._phantom_s
        travelled_mm = self._motor.half_steps / emulated.HALF_STEPS_PER_MM
        self._phantom_s = travelled_mm / self._speed_mm_s
        self._logger.set_voltages(self._at(before_s), self._at(self._phantom_s))
        self._logger.set_end_stop(self._phantom_s >= self.time_s[-1])
        self.progress_s.append((end_s, self._phantom_s))

    def _at(self, phantom_s):
        return np.array([np.interp(phantom_s, self.time_s, sensor) for sensor in self._voltages_mv])

    def expected_counts(self, moments_s):
        """Return the counts (S, K) of the sensors at moments of the bench."""
        bench_s, phantom_s = np.array(self.progress_s).T
        moments_s = np.interp(moments_s, bench_s, phantom_s)
        return np.array([np.interp(moments_s, self.time_s, sensor) for sensor in self.counts])


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
    begun_s = logger.seen.samples.times_us()[: recording.time_s.size] / 1e6
    expected = world.expected_counts(begun_s)
    assert np.abs(recording.values - expected).max() <= 2
    # Some seconds of the bench may pass between the start of the wave and that of the logger.
    assert recording.time_s.size > 0.9 * world.time_s.size
    assert np.ptp(recording.values, axis=1).min() > 20
    readings_of(recording, read_config_file(CONFIG / "config.yaml"))  # or raises why it is rejected
