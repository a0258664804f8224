"""capsule record with a logger imitated in Python behind a socket, which works on every system."""

import os

import pytest

from support.bench.recorder import Recorder, check_complete, check_times, count_samples
from support.bench.workbench import Workbench
from support.bench.world import Clock
from support.marks import needs_terminals

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


def test_standard_output_that_is_closed_holds_nothing_up(tmp_path, cable, bench):
    options = ("--size", "5", "--duration", "30")
    recorder = Recorder(tmp_path, "--port", cable.port, *options)
    bench.run(lambda: count_samples(cable.whole) >= 30)
    recorder.process.stdout.close()
    bench.run(recorder.done)
    recorder.expect(0)
    assert recorder.recording().time_s.size == 300
