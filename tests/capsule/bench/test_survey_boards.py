"""capsule survey on boards without faults: the files of a session, and its end."""

import io
import json
import signal

import numpy as np
import pytest

from capsule.phantom.journey import Nodule
from capsule.recordings.recording import read_recording
from support.bench.rig import needed

pytestmark = [pytest.mark.boards, needed]
AT_MM = 45.0
THERE_AND_BACK = "--goto", 25, 12


def test_a_nodule_is_passed_again_and_confirmed(rig):
    bench = rig(nodules=[Nodule(AT_MM, 3.0)])
    bench.survey().expect(0, "1 confirmed")
    assert bench.at_rest()
    folder = bench.folder / "tuesday"
    (place,) = [place for place in bench.places() if place["status"] == "confirmed"]
    assert float(place["place_mm"]) == pytest.approx(AT_MM, abs=4)
    for name in place["recordings"].split():
        recording = read_recording(io.BytesIO((folder / name).read_bytes()), 4)
        assert recording.header["source"] == "recorded by the logger board, firmware 1.1"
        assert recording.header["site"] == f"tuesday/place-{int(place['place']):02d}"
        assert recording.header["wave_speed_mm_s"] == "25"
    # The end stop ended it, with all samples in their places.
    assert bench.gut.head_mm >= 80.0
    assert bench.events()[-2]["event"] == "gut_ended"
    time_s = np.array([float(row[0]) for row in bench.stream()])
    np.testing.assert_allclose(np.diff(time_s), 0.1, atol=1e-9)
    assert {row[-1] for row in bench.stream()} == {"unfolded", "folding", "folded", "unfolding"}
    assert not any("" in row[:6] for row in bench.stream()[20:-20])
    # The wave's way is that of the cams, whatever the lines' delays.
    wave_mm = np.array([float(row[5]) for row in bench.stream()[20:-20]])
    np.testing.assert_allclose(np.diff(wave_mm), 2.5, atol=0.3)
    assert json.loads((folder / "session.json").read_text())["index_mm"] is not None


def test_it_goes_to_targets_and_stops_the_wave_there(rig):
    bench = rig()
    bench.survey(*THERE_AND_BACK).expect(0)
    assert bench.gut.head_mm == pytest.approx(12.0, abs=5)
    assert bench.at_rest()
    assert "folded" in bench.fold.said


def test_a_target_beyond_the_end_stop_is_not_reached(rig):
    bench = rig(length_mm=20.0)
    bench.survey("--goto", 60).expect(13, "before the capsule reached the target")
    assert bench.at_rest()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_whoever_ends_it_leaves_an_unfolded_origami(rig, number):
    bench = rig()
    surveyor = bench.survey(*THERE_AND_BACK)
    surveyor.run(lambda: bench.fold.folded == 1.0)
    surveyor.send_signal(number)
    surveyor.expect(130)
    assert bench.at_rest()
    assert bench.events()[-1]["after"] == "ended"
    # It did not wait for the lease: it told the board.
    assert bench.fold.said[-2:] == ["unfolding", "unfolded"]


def test_a_disk_that_is_full_ends_it_unfolded(rig):
    bench = rig()
    surveyor = bench.survey(*THERE_AND_BACK)
    surveyor.run(lambda: bench.fold.folded == 1.0)
    surveyor.limit_files(2000)
    surveyor.expect(9, "the disk is full", "capsule survey --resume")
    assert bench.at_rest()
    assert (bench.folder / "tuesday" / "stream.csv.part").exists()


def test_a_board_that_is_another_one_is_named_before_anything_is_written(rig):
    bench = rig()
    bench.survey("--fold", bench.cables.wave.port).expect(8, "is the peristalsis board")
    assert not (bench.folder / "tuesday").exists()


def test_a_speed_that_the_motor_cannot_follow_is_refused(rig):
    bench = rig()
    bench.survey("--speed", 60).expect(12, "needs 1019 half-steps/s")
    assert bench.wave.state == "stopped"
    assert not (bench.folder / "tuesday").exists()
