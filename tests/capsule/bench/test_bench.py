"""capsule record against the real firmware in the emulator, with all faults that a lab fears."""

import json
import re
import time
from datetime import datetime, timedelta

import numpy as np
import pytest

from capsule.detectors.familiar import FAMILIAR, learn_familiar
from capsule.detectors.files import write_learned
from capsule.engine.configuration import read_config_file
from capsule.engine.project import PROJECT
from support.bench import emulated
from support.bench.cable import TerminalCable
from support.bench.recorder import (
    Recorder,
    check_complete,
    check_times,
    count_samples,
)
from support.bench.workbench import Workbench
from support.bench.world import Clock

pytestmark = [
    pytest.mark.boards,
    pytest.mark.takes,
    emulated.needed,
]


# Across a restart of the board the computer's clock counts: exact to a sample, and to another one
# where this machine is too busy to keep bench and recorder in step.
GAP_TOLERANCE_S = 0.206


class LoggerBench:
    """A logger on its cable, and the recorder that a test starts."""

    def __init__(self, folder, **cable_settings):
        self.folder = folder
        self.board = emulated.EmulatedBoard(emulated.LOGGER)
        self.cable = TerminalCable(self.board, folder / "ttyACM0", **cable_settings)
        self.bench = Workbench(self.cable, world=Clock(self.board))

    def record(self, *options, size="3", **settings):
        """Start capsule record on the logger's port."""
        return Recorder(
            self.folder, "--port", self.cable.port, "--size", size, *options, **settings
        )

    def run_to_end(self, recorder):
        """Run the bench until the recorder has ended."""
        self.bench.run(recorder.done)

    def slow_down(self):
        """Run in real time until the recorder has noticed the change."""
        self.bench.speed = 1
        self.bench.run_for(0.5)

    def run_until_samples(self, count, limit_s=30.0):
        """Run the bench until this many samples have reached the recorder."""
        self.bench.run(lambda: count_samples(self.cable.whole) >= count, limit_s)


def wait_for(condition, limit_s=5.0):
    deadline = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


@pytest.fixture(autouse=True)
def end_recorders():
    yield
    Recorder.end_all()


@pytest.fixture
def logger_bench(tmp_path):
    made = LoggerBench(tmp_path)
    yield made
    assert not made.cable.boot_loader_stuck, "the boot loader heard a byte"


def test_records_for_a_duration(logger_bench):
    named = ("--session", "monday", "--site", "A", "--setup", "gut-2")
    recorder = logger_bench.record("--duration", "30", *named)
    logger_bench.run_to_end(recorder)
    printed = recorder.expect(0, "300 samples", "no gap", "--duration is over")
    assert "damaged" not in printed
    # The bench counts moments, from whatever moment on; there is no wave in it.
    assert printed.count("warning") == 1
    assert "warning: no detector will judge this recording: no wave on sensor_" in printed
    assert "00:30.0 of 00:30.0" in printed
    recording = recorder.recording()
    assert recording.time_s.size == 300
    assert not np.isnan(recording.values).any()
    check_times(recording)
    check_complete(recording, logger_bench.cable, ended_early=True)
    header = recording.header
    expected = {"rate_hz": "10", "adc_bits": "10", "vref_v": "5", "series_ohm": "12000"}
    assert expected.items() <= header.items()
    assert header["source"].startswith("recorded by the logger board")
    assert [header[key] for key in ("session", "site", "setup")] == ["monday", "A", "gut-2"]
    (path,) = recorder.raw.rglob("*.csv")
    assert path.parent.name == "3mm"
    # The name is the time of the command, and the header has that of the first sample.
    named, started = datetime.fromisoformat(path.stem), datetime.fromisoformat(header["started"])
    assert abs(started - named) < timedelta(seconds=30)
    assert recorder.parts() == []


def test_unplugged_and_plugged_back_in(logger_bench):
    bench, cable = logger_bench.bench, logger_bench.cable
    recorder = logger_bench.record()
    logger_bench.run_until_samples(100)
    logger_bench.slow_down()
    cable.unplug(after_bytes=b"$D,100,10100,12")
    bench.run_for(1.0)
    cable.plug()
    logger_bench.run_until_samples(112)
    recorder.press_ctrl_c()
    logger_bench.run_to_end(recorder)
    recorder.expect(0, "was unplugged", "is back", "1 gap", "1 damaged", "recording.max_gap_s")
    recording = recorder.recording()
    # The recorder lets the board finish: nothing that was under way is thrown away.
    check_complete(recording, cable)
    check_times(recording, tolerance_s=GAP_TOLERANCE_S)
    assert 15 < np.isnan(recording.values[0]).sum() < 60
    assert "by this computer's clock" in recorder.log()


def test_killed_recorder_is_recovered(logger_bench):
    recorder = logger_bench.record("--name", "r01")
    logger_bench.run_until_samples(150)
    logger_bench.cable.wait_until_read()
    (part,) = recorder.parts()
    wait_for(lambda: part.read_text().count("\n") >= 150)  # on disk while it records
    recover = Recorder(logger_bench.folder, "--recover")
    recover.expect(1, "a recorder is writing", "r01.csv.part at this moment")
    logger_bench.run_until_samples(170)
    recorder.process.kill()
    recorder.process.wait()
    with part.open("ab") as stream:
        stream.write(b"99.9,1,2")  # as a power cut leaves it
    again = logger_bench.record("--name", "r01")
    again.expect(10, "capsule record --recover")
    recover = Recorder(logger_bench.folder, "--recover")
    recover.expect(0, "recovered", "8 bytes at its end left out: not a whole line")
    recording = recorder.recording()
    assert recording.time_s.size >= 150
    check_times(recording)
    check_complete(recording, logger_bench.cable, ended_early=True)
    assert recorder.parts() == []
    Recorder(logger_bench.folder, "--recover").expect(0, "nothing to recover")


def test_running_verdict(logger_bench):
    templates = logger_bench.folder / "templates.npz"
    shape = np.zeros((4, 1000))
    shape[:, 200:400] = 0.5
    np.savez(templates, **{"0mm": np.zeros((4, 1000)), "4mm": shape})
    unknown = {"threshold": None, "learned": None, "probability": None, "sizes": None}
    learned = {"recordings": 0, "diagonal": unknown, "taught": unknown}
    learned[FAMILIAR] = learn_familiar(np.empty((0, 6)), np.empty(0, dtype=int)).stored()
    write_learned(logger_bench.folder / "detectors.json", learned, {}, templates)
    # The bench counts moments; there is no wave in it, and none is asked for.
    settings = read_config_file(PROJECT / "config" / "config.yaml")
    settings["recording"]["wave_false_rate"] = 1
    config = logger_bench.folder / "config.yaml"
    config.write_text(json.dumps(settings))
    judging = ("--detect", "--templates", templates, "--config", config)
    recorder = logger_bench.record("--duration", "60", *judging)
    logger_bench.run_to_end(recorder)
    said = recorder.expect(0)
    at_end = said.partition("archived ")[2]
    assert re.search(r"^template +no", at_end, re.MULTILINE)
    # What the bench counts depends on when the recorder begins: it has a score, or none.
    assert re.search(r"^diagonal +no verdict: no (threshold|score)", at_end, re.MULTILINE)
    assert re.search(r"^taught +no verdict: no score", at_end, re.MULTILINE)
