"""capsule record with a logger imitated in Python behind a socket, which works on every system."""

import os
import shutil
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from capsule.bench.protocol import encode
from support.bench.recorder import Recorder, check_complete, check_times, count_samples, samples_in
from support.bench.workbench import Workbench
from support.bench.world import Clock
from support.marks import needs_signals, needs_terminals

pytestmark = pytest.mark.boards


@pytest.fixture
def bench(cable):
    return Workbench(cable, world=Clock(cable.board))


@pytest.fixture(autouse=True)
def end_recorders():
    yield
    Recorder.end_all()


def test_records_into_the_archive(tmp_path, cable, bench):
    options = ("--unlabelled", "--duration", "20", "--name", "run-1")
    recorder = Recorder(tmp_path, "--port", cable.port, *options)
    bench.run(recorder.done)
    recorder.expect(0, "200 samples", "no gap")
    assert (tmp_path / "raw" / "unlabelled" / "run-1.csv").exists()
    check_times(recorder.recording())
    check_complete(recorder.recording(), cable, ended_early=True)


def test_unplugged_and_plugged_back_in(tmp_path, cable, bench):
    recorder = Recorder(tmp_path, "--port", cable.port, "--size", "2.5", "--duration", "15")
    bench.speed = 20
    bench.run(lambda: count_samples(cable.whole) >= 50)
    cable.unplug()
    bench.speed = 1
    bench.run_for(0.5)
    cable.plug()
    bench.run(lambda: count_samples(cable.whole) >= 52)
    bench.speed = 20
    bench.run(recorder.done)
    recorder.expect(0, "was unplugged", "is back", "1 gap")
    recording = recorder.recording()
    check_complete(recording, cable, ended_early=True)
    # 20 times faster than real time, a sample's arrival tells its time less well.
    check_times(recording, tolerance_s=0.306)
    assert np.isnan(recording.values[0]).sum() > 10


def test_killed_recorder_is_recovered(tmp_path, cable, bench):
    recorder = Recorder(tmp_path, "--port", cable.port, "--size", "0", "--name", "r01")
    bench.speed = 50
    bench.run(lambda: count_samples(cable.whole) >= 100)
    (part,) = recorder.parts()
    bench.run(lambda: part.read_bytes().count(b"\n") >= 100)
    recorder.process.kill()
    recorder.process.wait()
    Recorder(tmp_path, "--recover", part).expect(0, "recovered")
    check_times(recorder.recording())
    check_complete(recorder.recording(), cable, ended_early=True)


def test_end_stop(tmp_path, cable, bench):
    recorder = Recorder(tmp_path, "--port", cable.port, "--size", "5")
    bench.run(lambda: count_samples(cable.whole) >= 30)
    cable.board.set_end_stop(True)
    bench.run(recorder.done)
    recorder.expect(0, "the capsule reached the end stop")


def test_a_folder_deleted_in_mid_run_is_noticed_within_seconds(tmp_path, cable, bench):
    recorder = Recorder(tmp_path, "--port", cable.port, "--size", "5", "--name", "r01")
    bench.speed = 20
    bench.run(lambda: count_samples(cable.whole) >= 30)
    shutil.rmtree(tmp_path / "raw")
    bench.run(lambda: bool(recorder.parts()), limit_s=3)
    recorder.press_ctrl_c()
    bench.run(recorder.done)
    recorder.expect(0, "was deleted", "go on there")
    check_complete(recorder.recording(), cable, ended_early=True)
    assert recorder.recording().time_s.size >= 30


@needs_terminals
def test_a_terminal_that_takes_no_output_holds_nothing_up(tmp_path, cable, bench):
    ours, theirs = os.openpty()  # and nobody reads
    options = ("--size", "5", "--duration", "120")
    recorder = Recorder(tmp_path, "--port", cable.port, *options, stdout=theirs)
    bench.speed = 25  # the terminal's buffer is full after a second
    bench.run(recorder.done)
    recorder.expect(0)
    os.close(ours)
    os.close(theirs)
    assert recorder.recording().time_s.size == 1200
    check_complete(recorder.recording(), cable, ended_early=True)


@pytest.mark.parametrize("closed", ["before", "meanwhile"])
def test_standard_output_that_is_closed_holds_nothing_up(tmp_path, cable, bench, closed):
    settings = {"preexec_fn": lambda: os.close(1)} if closed == "before" else {}
    options = ("--size", "5", "--duration", "30")
    recorder = Recorder(tmp_path, "--port", cable.port, *options, **settings)
    if closed == "meanwhile":
        bench.run(lambda: count_samples(cable.whole) >= 30)
        recorder.process.stdout.close()
    bench.run(recorder.done)
    recorder.expect(0)
    assert recorder.recording().time_s.size == 300


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full to stand for a full disk")
def test_a_log_whose_disk_is_full_holds_nothing_up(tmp_path, cable, bench):
    log = tmp_path / "logs" / "5mm" / "r01.log"
    log.parent.mkdir(parents=True)
    log.symlink_to("/dev/full")
    options = ("--size", "5", "--duration", "30", "--name", "r01")
    recorder = Recorder(tmp_path, "--port", cable.port, *options)
    bench.run(recorder.done)
    recorder.expect(0, "continues without its log", "No space left")
    assert recorder.recording().time_s.size == 300


def test_a_run_longer_than_the_matrix_is_told_when_it_passes(tmp_path, cable, bench):
    log = (tmp_path / "printed").open("w+")
    recorder = Recorder(tmp_path, "--port", cable.port, "--size", "5", stdout=log)
    bench.run(lambda: count_samples(cable.whole) >= 900)
    bench.speed = 20
    printed = tmp_path / "printed"
    bench.run(lambda: "longer than 1000 samples (100 s)" in printed.read_text(), limit_s=10)
    assert not recorder.done()
    recorder.press_ctrl_c()
    bench.run(recorder.done)
    log.close()
    recorder.expect(0)
    assert printed.read_text().count("the workflow will reject it (preprocessing.length)") == 1


@needs_signals
@pytest.mark.parametrize("after_s", [0.08, 0.15, 0.3, 0.6])
def test_an_early_ctrl_c_is_no_traceback(tmp_path, after_s):
    recorder = Recorder(tmp_path, "--port", tmp_path / "fifo", "--size", "5")
    os.mkfifo(tmp_path / "fifo")
    time.sleep(after_s)
    recorder.press_ctrl_c()
    _, errors = recorder.output
    # Before its first line, nobody can speak for the program but Python itself.
    assert "Traceback" not in errors or "capsule record" not in errors, errors
    assert not list(tmp_path.rglob("*.csv*"))


@needs_signals
def test_a_recorder_that_was_stopped_loses_nothing(tmp_path, cable, bench):
    options = ("--size", "5", "--duration", "60", "--patience", "1")
    recorder = Recorder(tmp_path, "--port", cable.port, *options)
    bench.speed = 10
    bench.run(lambda: count_samples(cable.whole) >= 100)
    recorder.process.send_signal(signal.SIGSTOP)
    bench.run_for(20)
    recorder.process.send_signal(signal.SIGCONT)
    bench.run(recorder.done)
    recorder.expect(0, "600 samples", "no gap")
    check_complete(recorder.recording(), cable, ended_early=True)


def test_a_false_frame_that_passed_its_check_costs_no_sample(tmp_path, cable, bench):
    false = {50: 20_000, 80: 3000, 110: 2**31, 140: 4_000_000_000}

    def spoil(frame):
        number = len(samples_in(cable.whole))
        if frame.startswith(b"$D") and number in false:
            return encode(f"D,{number + 1},{false.pop(number)},9,9,9,9,0") + frame
        return frame

    cable.spoil = spoil
    options = ("--size", "5", "--duration", "20")
    recorder = Recorder(tmp_path, "--port", cable.port, *options)
    bench.run(recorder.done)
    recorder.expect(0, "200 samples", "no gap", "damaged frames")
    # The end may have cut off one more frame, of a sample that comes too late.
    assert recorder.log().count("Sample(") == 4
    check_complete(recorder.recording(), cable, ended_early=True)


def test_garbage_for_ever_ends_by_patience(tmp_path, cable, bench):
    options = ("--size", "5", "--patience", "2")
    recorder = Recorder(tmp_path, "--port", cable.port, *options)
    bench.run(lambda: count_samples(cable.whole) >= 100)
    cable.spoil = lambda frame: b"static" * 5 + b"\n"
    bench.run(recorder.done, limit_s=15)
    recorder.expect(11, "sent no sample for 2 s (--patience)", "archived in")
    check_complete(recorder.recording(), cable, ended_early=True)
    assert recorder.recording().time_s.size == 100
