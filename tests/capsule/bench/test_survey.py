"""capsule survey as a user runs it: the files of a finished session, and those of a killed one."""

import csv
import io
import json
import signal
import subprocess
import time

import pytest

from capsule.recording import read_recording
from support.command import CAPSULE
from support.marks import needs_signals

pytestmark = pytest.mark.boards

SURVEY = [*CAPSULE, "survey"]
GUT = ["--simulate", "--metres", "0.35", "--nodules", "3", "--seed", "5"]


def run(*arguments, cwd, **options):
    return subprocess.run(
        [*SURVEY, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, **options
    )


def content(folder):
    """Return the bytes of all files of a session."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Make an undisturbed session."""
    folder = tmp_path_factory.mktemp("sessions") / "whole"
    done = run(*GUT, "--out", folder, "--raw", "raw", cwd=folder.parent)
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


def test_the_stream_tells_where_the_survey_had_the_head_and_why_it_was_suspicious(whole):
    folder, _ = whole
    rows = list(csv.DictReader((folder / "stream.csv").read_text().splitlines()))
    assert all(row["threshold"] for row in rows[7::8])
    judged = {float(row["time_s"]): row for row in rows[7::8]}
    assert not any(
        row["head_mm"] + row["score"] + row["threshold"]
        for row in rows
        if float(row["time_s"]) not in judged
    )
    assert all(row["head_mm"] == "" for row in rows if row["fold"] != "unfolded")
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    placed = [event for event in events if event["event"] in ("placed", "suspected", "passed")]
    assert len(placed) >= 4
    for event in placed:
        assert float(judged[event["time_s"]]["head_mm"]) == pytest.approx(
            event["position_mm"], abs=0.01
        )
    suspected = [event for event in placed if event["event"] == "suspected"]
    assert suspected
    for event in suspected:
        score = float(judged[event["time_s"]]["score"])
        assert score == pytest.approx(event["score"], abs=1e-5)
        assert score > event["threshold"]


def test_a_session_holds_stream_events_places_and_recordings(whole):
    folder, said = whole
    places = list(csv.DictReader((folder / "places.csv").read_text().splitlines()))
    confirmed = [place for place in places if place["status"] == "confirmed"]
    assert len(confirmed) == 1
    assert "1 confirmed" in said
    lines = (folder / "stream.csv").read_text().splitlines()
    assert lines[0] == (
        "time_s,sensor_1,sensor_2,sensor_3,sensor_4,wave_mm,head_mm,score,threshold,fold"
    )
    assert {line.rpartition(",")[2] for line in lines[1:]} == {
        "unfolded", "folding", "folded", "unfolding",
    }  # fmt: skip
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    confirming = next(event for event in events if event["event"] == "confirmed")
    assert confirming["before"] == "passing"
    assert confirming["score"] > confirming["threshold"]
    assert events[-1]["after"] == "ended"
    for name in confirmed[0]["recordings"].split():
        recording = read_recording(io.BytesIO((folder / name).read_bytes()), 4)
        assert recording.header["site"] == f"whole/place-{int(confirmed[0]['place']):02d}"
        assert recording.header["source"] == "simulated survey"
        copy = folder.parent / "raw" / "unlabelled" / f"whole-{name.rpartition('/')[2]}"
        assert copy.read_bytes() == (folder / name).read_bytes()
        assert 300 <= recording.time_s.size < 1000


@pytest.mark.parametrize("share", [0.3, 0.7])
@needs_signals
def test_a_killed_session_is_taken_up_and_ends_as_if_nothing_had_happened(whole, tmp_path, share):
    folder = tmp_path / "whole"
    part = folder / "stream.csv.part"
    enough = share * (whole[0] / "stream.csv").stat().st_size
    process = subprocess.Popen(
        [*SURVEY, *GUT, "--out", str(folder), "--raw", "raw"], stdout=subprocess.PIPE, cwd=tmp_path
    )
    deadline = time.monotonic() + 120
    while not part.exists() or part.stat().st_size < enough:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.kill()
    process.communicate()
    assert not (folder / "stream.csv").exists()
    # A power cut takes what the disk had not yet kept, in the middle of a line.
    with part.open("r+b") as stream:
        stream.truncate(part.stat().st_size - 25)
    done = run("--resume", folder, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert content(folder) == content(whole[0])
    assert content(tmp_path / "raw") == content(whole[0].parent / "raw")


def test_no_two_passes_hold_the_same_samples(whole):
    recordings = [
        read_recording(io.BytesIO(path.read_bytes()), 4)
        for path in sorted((whole[0] / "recordings").iterdir())
    ]
    assert len(recordings) >= 2
    stretches = [
        {tuple(recording.values[:, start : start + 20].ravel()) for start in range(250)}
        for recording in recordings
    ]
    for number, stretch in enumerate(stretches):
        for other in stretches[number + 1 :]:
            assert not stretch & other


def test_what_cannot_be_taken_up_is_left_as_it_is(whole, tmp_path):
    done = run("--resume", whole[0], cwd=tmp_path)
    assert done.returncode == 1
    assert "finished" in done.stderr
    done = run(*GUT, "--out", whole[0], cwd=tmp_path)
    assert done.returncode == 10
    assert "--resume" in done.stderr
    assert run("--resume", tmp_path, cwd=tmp_path).returncode == 1


def test_a_session_of_other_parameters_is_not_mixed_with_this_one(whole, tmp_path):
    folder = tmp_path / "other"
    folder.mkdir()
    about = json.loads((whole[0] / "session.json").read_text())
    (folder / "session.json").write_text(json.dumps(about | {"seed": 6}))
    first = (whole[0] / "stream.csv").read_bytes()[:2000]
    (folder / "stream.csv.part").write_bytes(first)
    done = run("--resume", folder, cwd=tmp_path)
    assert done.returncode == 1
    assert "differs in the resumed session" in done.stderr
    assert (folder / "stream.csv.part").read_bytes() == first[: first.rfind(b"\n") + 1]


@needs_signals
def test_ctrl_c_ends_a_session_with_an_unfolded_origami(tmp_path):
    folder = tmp_path / "stopped"
    process = subprocess.Popen(
        [*SURVEY, *GUT, "--out", str(folder)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    for line in process.stdout:
        if " returning " in line:
            process.send_signal(signal.SIGINT)
            break
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 130, said
    assert (folder / "stream.csv").read_text().splitlines()[-1].endswith("unfolded")


def test_a_target_that_cannot_be_reached_has_its_own_status(tmp_path):
    out = ["--simulate", "--metres", "0.3", "--out", tmp_path / "there"]
    reached = run(*out, "--goto", 60, cwd=tmp_path)
    assert reached.returncode == 0, reached.stderr
    out[-1] = tmp_path / "back"
    done = run(*out, "--goto", 60, 20, "--set", "folding.speed_mm_s=0.2", cwd=tmp_path)
    assert done.returncode == 13
    assert "cannot go back" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--out", "x"], "give either --simulate, or the ports of the boards"),
        (["--drive", "p", "--out", "x"], "needs --fold PORT"),
        (["--simulate"], "--out FOLDER"),
        (["--simulate", "--out", "x", "--goto", "1500"], "the gut is 1000 mm long"),
        (["--simulate", "--out", "x", "--metres", "50"], "'50' is not a number from 0.2 to 10 m"),
        (["--simulate", "--out", "x", "--nodules", "9"], "'9' is not a number from 0.1 to 5 mm"),
    ],
)
def test_a_wrong_command_line_is_answered_with_what_is_wrong(tmp_path, arguments, said):
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert not any(tmp_path.iterdir())


def test_a_session_can_take_over_the_map_of_earlier_ones(whole, tmp_path):
    earlier = json.loads((whole[0] / "session.json").read_text())
    gut = ["--simulate", "--metres", "0.35", "--seed", "6", "--goto", "60"]
    taken = run(*gut, "--map", whole[0], "--out", "taken", cwd=tmp_path)
    own = run(*gut, "--out", "own", cwd=tmp_path)
    assert (taken.returncode, own.returncode) == (0, 0), taken.stderr + own.stderr
    taken, own = (
        json.loads((tmp_path / name / "session.json").read_text()) for name in ("taken", "own")
    )
    assert taken["origin_mm"] == taken["earlier_origin_mm"] == earlier["origin_mm"]
    # Its own map begins elsewhere, by where its first stroke has led.
    assert 0 < abs(own["origin_mm"] - earlier["origin_mm"]) < 5


def test_a_map_that_is_not_there_is_refused(whole, tmp_path):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "session.json").write_text("{}")
    for folder, reason in [("none", "holds no session"), ("old", "does not tell where its map")]:
        done = run(*GUT, "--map", folder, "--out", "x", cwd=tmp_path)
        assert done.returncode == 1
        assert f"error: --map: {folder} {reason}" in done.stderr
        assert not (tmp_path / "x").exists()
