"""A survey of a simulated gut: its files, also on a full disk, and those of one that was killed."""

import csv
import errno
import json
from dataclasses import replace
from datetime import datetime
from functools import partial
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from capsule.bench import bench_errors, survey_command, survey_folder
from capsule.bench.bench_errors import AcquisitionError, BoardLostError
from capsule.bench.protocol import Identity
from capsule.bench.survey_folder import SessionFolder, check_new, read_about
from capsule.engine.configuration import read_settings
from capsule.interface.archive import read_recording
from capsule.phantom.simulated_bench import SimulatedBench, nodules_of
from capsule.survey.files import parse_session
from support.bench.scripted import ENTRIES
from support.command import parsers
from support.surveys import session_contents

GUT = ["--metres", 0.2, "--nodules", 3, "--seed", 7]
TO_AND_FRO = ["--metres", 0.2, "--goto", 60, 20, "--set", "folding.speed_mm_s=0.2"]
READ = SimulatedBench.read
SILENT = {"trouble": BoardLostError("the fold board is silent")}
DISOBEYS = {"read": lambda *of: replace(READ(*of), fold="folded"), "at_end": True}
BEGUN = "2026-01-01T10:00:00Z"
KEPT = ("stream.csv", "events.jsonl")


def survey(*words):
    options = parsers()["survey"].parse_args(list(map(str, words)))
    survey_command.check(options)
    survey_command.survey(options)


def rounded(bench, samples):
    """Read a simulated bench whose wave is rounded as that of boards is."""
    readings = READ(bench, samples)
    return replace(readings, wave_mm=np.round(readings.wave_mm, 2))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Make an undisturbed session."""
    folder = tmp_path_factory.mktemp("sessions") / "whole"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(SimulatedBench, "read", rounded)
        survey("--simulate", *GUT, "--out", folder, "--raw", folder.parent / "raw")
    return folder


def events_of(folder):
    return [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]


def table(path):
    return list(csv.DictReader(path.read_text().splitlines()))


def test_the_stream_tells_where_the_survey_had_the_head_and_why_it_was_suspicious(whole):
    rows = table(whole / "stream.csv")
    columns = "time_s,sensor_1,sensor_2,sensor_3,sensor_4,wave_mm,head_mm,score,threshold,fold"
    assert ",".join(rows[0]) == columns
    assert {row["fold"] for row in rows} == {"unfolded", "folding", "folded", "unfolding"}
    assert all(row["head_mm"] == "" for row in rows if row["fold"] != "unfolded")
    judged = {float(row["time_s"]): row for row in rows if row["threshold"]}
    assert [*judged.values()] == rows[7::8]
    assert not any(row["head_mm"] + row["score"] for row in rows if not row["threshold"])
    events = events_of(whole)
    assert events[-1]["after"] == "ended"
    suspected = [event for event in events if event["event"] == "suspected"]
    assert len(suspected) >= 2
    for event in suspected:
        row = judged[event["time_s"]]
        assert float(row["head_mm"]) == pytest.approx(event["position_mm"], abs=0.01)
        assert float(row["score"]) == pytest.approx(event["score"], abs=1e-5)
        assert float(row["score"]) > event["threshold"]


# Kills: a pass whose first samples are the last ones of the place before.
def test_each_place_has_its_passes_as_recordings_of_samples_of_their_own(whole):
    places = table(whole / "places.csv")
    assert [place["status"] for place in places] == ["dismissed", "confirmed"]
    (nodule,) = nodules_of(7, 200.0, [3.0])
    assert float(places[1]["place_mm"]) == pytest.approx(nodule.at_mm, abs=5)
    seen = set()
    for name in " ".join(place["recordings"] for place in places).split():
        recording = read_recording(whole / name, 4)
        assert recording.header["site"] == f"whole/{name[11:19]}"
        assert recording.header["source"] == "simulated survey"
        copy = whole.parent / "raw" / "unlabelled" / f"whole-{name.rpartition('/')[2]}"
        assert copy.read_bytes() == (whole / name).read_bytes()
        assert 300 <= recording.time_s.size < 1000
        pieces = {tuple(recording.values[:, at : at + 20].ravel()) for at in range(250)}
        assert not pieces & seen
        seen |= pieces
    assert len(seen) >= 1000


def kill(whole, folder, stream=None, events=None):
    """Make a session on boards as a kill leaves it, cut to some bytes, and return its folder."""
    about = {"metres": 0.2, "goto": [], "raw": None, "index_mm": 0.0, "begun": BEGUN}
    about["wave"] = {"speed_mm_s": 25.0, "ramp_mm_s2": 25.0, "direction": "forward"}
    about["header"] = {"source": "a board", "rate_hz": "10", "started": BEGUN, "session": "killed"}
    about["boards"] = dict.fromkeys(("drive", "fold", "logger"), "port")
    folder.mkdir()
    (folder / "session.json").write_text(json.dumps(about))
    for name, kept in zip(KEPT, (stream, events), strict=True):
        (folder / f"{name}.part").write_bytes((whole / name).read_bytes()[:kept])
    return folder


# Kills: a repeated line that is not the stored one; a last event that a power cut took for good.
def test_a_survey_that_was_killed_at_its_very_end_needs_no_board_to_be_finished(whole, tmp_path):
    folder = kill(whole, tmp_path / "killed", events=-100)
    survey("--resume", folder)
    for name in KEPT:
        assert (folder / name).read_bytes() == (whole / name).read_bytes()
    assert not list(folder.glob("*.part"))
    assert table(folder / "places.csv") == table(whole / "places.csv")
    first = read_recording(folder / "recordings/place-01-pass-1.csv", 4)
    # The pass began so long after the survey.
    passed_s = next(event["time_s"] for event in events_of(whole) if event["event"] == "passed")
    after_s = datetime.fromisoformat(first.header["started"]) - datetime.fromisoformat(BEGUN)
    assert after_s.total_seconds() == pytest.approx(passed_s - first.time_s[-1], abs=1.5)


# Kills: a session that is removed before its first judgement; half a judgement that is decided on;
# a line that is cut off.
@pytest.mark.parametrize("kept", [300, 20_000, 60_001])
def test_a_survey_that_cannot_go_on_keeps_what_it_has(whole, tmp_path, monkeypatch, kept):
    monkeypatch.setattr(survey_command, "open_boards", Mock(side_effect=AcquisitionError("none")))
    folder = kill(whole, tmp_path / "killed", kept, kept)
    with pytest.raises(AcquisitionError, match="none"):
        survey("--resume", folder)
    stream = (folder / "stream.csv.part").read_bytes()
    assert (whole / "stream.csv").read_bytes().startswith(stream)
    assert stream.endswith(b"\n") and len(stream.splitlines()) % 8 == 1
    assert len(stream) > kept - 8 * 60


# Kills: positions in units of another wave.
def test_a_board_that_drives_other_waves_is_refused():
    entries = {"logger": ENTRIES, "peristalsis": {"wavelength_mm": "70.000"}}
    boards = {name: SimpleNamespace(identity=Identity(name, entries[name])) for name in entries}
    with pytest.raises(AcquisitionError, match="waves of 70"):
        survey_command._known_with(boards, read_settings(), None, "tuesday")


# Kills: a fault that is told at each look, or forgotten at the end.
@pytest.mark.parametrize(
    ("words", "bench", "error", "said", "fold"),
    [
        (GUT, SILENT, BoardLostError, "the fold board is silent", "unfolded"),
        (GUT, DISOBEYS, bench_errors.SurveyFaultError, "did not obey", "folded"),
        (TO_AND_FRO, {}, bench_errors.CannotArriveError, "cannot go back", "unfolded"),
        (GUT, {"read": Mock(side_effect=KeyboardInterrupt)}, KeyboardInterrupt, "^$", ""),
    ],
)
def test_what_ends_a_survey(tmp_path, monkeypatch, words, bench, error, said, fold):
    for name, value in bench.items():
        monkeypatch.setattr(SimulatedBench, name, value)
    with pytest.raises(error, match=said):
        survey("--simulate", *words, "--out", tmp_path / "one")
    assert (tmp_path / "one").exists() == bool(fold)  # nothing before the first sample
    if fold:
        events = events_of(tmp_path / "one")
        assert [event["event"] for event in events].count("fault") == (bench == SILENT)
        assert events[-1]["after"] == "ended"
        assert (tmp_path / "one/stream.csv").read_text().endswith(f",{fold}\n")


# Kills: a full disk whose remedy is that of a recording, or that leaves a folder in the way.
def test_a_disk_that_is_full_is_told_with_its_remedy(tmp_path, monkeypatch):
    def no_room(path, *_):
        path.parent.mkdir(exist_ok=True)
        raise OSError(errno.ENOSPC, "full")

    begin = partial(SessionFolder, tmp_path / "tuesday", {}, 4, resumed=False)
    disk = begin()
    for writer in ("write_json", "write_csv"):
        monkeypatch.setattr(survey_folder, writer, no_room)
    for act in (partial(disk.write_places, []), partial(disk.note_index, 1.0)):
        with pytest.raises(bench_errors.DiskFullError, match=r"full .*capsule survey --resume"):
            act()
    disk.discard()
    with pytest.raises(bench_errors.DiskFullError, match=r"session\.json.*the same command again"):
        begin()
    assert not (tmp_path / "tuesday").exists()


# Kills: a column that is read and that nobody writes, such as whether a place may be off.
def test_the_places_are_written_as_they_are_read(tmp_path):
    disk, contents = SessionFolder(tmp_path / "tuesday", {}, 4, resumed=False), session_contents()
    first, second = parse_session("tuesday", contents).places
    # An interval of a size without an upper end; a place that may be one wavelength off.
    strange = {"familiar": "no", "unfamiliar_because": "noise", "may_be_off_mm": 80.0}
    places = [replace(first, size_high_mm=np.inf, **strange), second]
    disk.write_places(places)
    disk.close()
    contents["places.csv"] = (tmp_path / "tuesday/places.csv").read_bytes()
    again = parse_session("tuesday", contents).places
    np.testing.assert_equal([vars(place) for place in again], [vars(place) for place in places])
    assert again[0].verdict == "nodule, 3.1 mm (2.4 mm or more)"


def test_what_cannot_be_resumed_is_told_with_the_reason(tmp_path):
    with pytest.raises(AcquisitionError, match=f"{tmp_path}.* holds no session"):
        read_about(tmp_path)
    for content, said in (
        (b'{"boards": ', "cannot be resumed; its samples stay"),
        (b"\xff", "cannot be resumed; its samples stay"),
        (b'{"seed": 1}', "simulated, and only a session on boards can be"),
    ):
        (tmp_path / "session.json").write_bytes(content)
        with pytest.raises(AcquisitionError, match=said):
            read_about(tmp_path)
        assert (tmp_path / "session.json").read_bytes() == content
    (tmp_path / "stream.csv").touch()
    with pytest.raises(AcquisitionError, match="finished; there is nothing"):
        read_about(tmp_path)
    with pytest.raises(bench_errors.NameExistsError, match="--resume"):
        check_new(tmp_path)
