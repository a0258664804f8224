"""Simulated bench and workflow together, from the motor's steps to the report."""

import csv

import numpy as np
import pytest

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from support.bench import emulated
from support.bench.cable import TerminalCable
from support.bench.closed_loop import ClosedLoop
from support.bench.recorder import Recorder, check_complete
from support.bench.workbench import Workbench
from support.project import Project

pytestmark = [
    pytest.mark.slow,
    pytest.mark.workflow,
    emulated.needed,
]


@pytest.fixture
def project(tmp_path):
    names = ["0mm/r01", "3mm/r01"]
    made = Project.create(tmp_path / "project", names, particles=20, iterations=20)
    return made


def test_a_run_over_a_3_mm_nodule_reaches_the_report(project, tmp_path):
    motor = emulated.EmulatedBoard(emulated.PERISTALSIS)
    logger = emulated.EmulatedBoard(emulated.LOGGER)
    wave_cable = TerminalCable(motor, tmp_path / "ttyACM1")
    cable = TerminalCable(logger, tmp_path / "ttyACM0")
    phantom = read_phantom(DEFAULT_TABLE, [])
    world = ClosedLoop(phantom, 3.0, 1, motor, logger)
    # The emulator would outrun the recorder, which renews the lease of the wave.
    bench = Workbench(wave_cable, cable, world=world, speed=5)

    places = ("--port", cable.port, "--drive", wave_cable.port)
    recorder = Recorder(project.folder, *places, "--size", "3", "--name", "bench")
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

    done = project.snakemake("results/report.html")
    assert done.status == 0, done.output
    with (project.results / "recordings.csv").open(encoding="utf-8") as stream:
        rows = {row["recording"]: row for row in csv.DictReader(stream)}
    assert rows["3mm/bench"]["status"] == "accepted", rows["3mm/bench"]["reason"]
    assert rows["3mm/bench"]["source"].startswith("recorded by the logger board")
    with (project.results / "evaluation/predictions.csv").open(encoding="utf-8") as stream:
        predicted = {row["recording"] for row in csv.DictReader(stream)}
    assert "3mm/bench" in predicted
    assert (project.results / "report.html").stat().st_size > 10_000
