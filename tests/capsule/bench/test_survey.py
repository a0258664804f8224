"""capsule survey as a user runs it: the files of a finished session, and those of a killed one."""

import argparse
import csv
import io
import json
import subprocess

import pytest

from capsule.bench import survey_command
from capsule.errors import WrongOptionError
from capsule.recordings.recording import read_recording
from support.command import CAPSULE

pytestmark = pytest.mark.boards

SURVEY = [*CAPSULE, "survey"]
GUT = ["--simulate", "--metres", "0.35", "--nodules", "3", "--seed", "5"]


def run(*arguments, cwd, **options):
    return subprocess.run(
        [*SURVEY, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, **options
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Make an undisturbed session."""
    folder = tmp_path_factory.mktemp("sessions") / "whole"
    done = run(*GUT, "--out", folder, "--raw", "raw", cwd=folder.parent)
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


def table(path):
    return list(csv.DictReader(path.read_text().splitlines()))


def test_the_stream_tells_where_the_survey_had_the_head_and_why_it_was_suspicious(whole):
    rows = table(whole[0] / "stream.csv")
    assert ",".join(rows[0]) == (
        "time_s,sensor_1,sensor_2,sensor_3,sensor_4,wave_mm,head_mm,score,threshold,fold"
    )
    assert {row["fold"] for row in rows} == {"unfolded", "folding", "folded", "unfolding"}
    assert all(row["head_mm"] == "" for row in rows if row["fold"] != "unfolded")
    judged = {float(row["time_s"]): row for row in rows[7::8]}
    assert all(row["threshold"] for row in judged.values())
    del rows[7::8]
    assert not any(row["head_mm"] + row["score"] + row["threshold"] for row in rows)
    lines = (whole[0] / "events.jsonl").read_text().splitlines()
    events = [json.loads(line) for line in lines]
    assert events[-1]["after"] == "ended"
    placed = [event for event in events if event["event"] in ("placed", "suspected", "passed")]
    assert len(placed) >= 4
    for event in placed:
        head_mm = float(judged[event["time_s"]]["head_mm"])
        assert head_mm == pytest.approx(event["position_mm"], abs=0.01)
        if event["event"] == "suspected":
            score = float(judged[event["time_s"]]["score"])
            assert score == pytest.approx(event["score"], abs=1e-5)
            assert score > event["threshold"]


def test_a_confirmed_place_has_its_passes_as_recordings_of_samples_of_their_own(whole):
    folder, said = whole
    (place,) = (row for row in table(folder / "places.csv") if row["status"] == "confirmed")
    assert "1 confirmed" in said
    seen = set()
    for name in place["recordings"].split():
        recording = read_recording(io.BytesIO((folder / name).read_bytes()), 4)
        assert recording.header["site"] == f"whole/place-{int(place['place']):02d}"
        assert recording.header["source"] == "simulated survey"
        copy = folder.parent / "raw" / "unlabelled" / f"whole-{name.rpartition('/')[2]}"
        assert copy.read_bytes() == (folder / name).read_bytes()
        assert 300 <= recording.time_s.size < 1000
        pieces = {tuple(recording.values[:, at : at + 20].ravel()) for at in range(250)}
        assert not pieces & seen
        seen |= pieces
    assert len(seen) >= 500


def test_a_target_that_cannot_be_reached_has_its_own_status(tmp_path):
    out = ["--simulate", "--metres", "0.3", "--out", tmp_path / "back"]
    done = run(*out, "--goto", 60, 20, "--set", "folding.speed_mm_s=0.2", cwd=tmp_path)
    assert done.returncode == 13
    assert "cannot go back" in done.stderr
    assert (tmp_path / "back/stream.csv").read_text().endswith("unfolded\n")


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
def test_a_wrong_command_line_is_answered_with_what_is_wrong(arguments, said, capsys):
    parser = argparse.ArgumentParser()
    survey_command.add_arguments(parser)
    with pytest.raises((WrongOptionError, SystemExit)) as refused:
        survey_command.check(parser.parse_args(arguments))
    assert said in f"{refused.value}{capsys.readouterr().err}"
