"""The files of a session: read, refused if damaged, listed, and what they tell of the track."""

import json
import re
import sys

import numpy as np
import pytest

import survey
from capsule.engine.configuration import read_settings
from capsule.errors import CapsuleError
from capsule.survey.files import SessionError, parse_session
from capsule.survey.listed import list_surveys, survey_content
from capsule.survey.track import crest_at_mm, pins_of, track_of
from support import surveys
from support.surveys import session_contents, stream_rows

FILES = {"stream.csv", "events.jsonl", "places.csv", "session.json"}


def test_everything_that_the_files_hold_is_read():
    session = parse_session("demo", session_contents())
    head, rows = stream_rows()
    for name in ("time_s", "wave_mm", "head_mm", "score", "threshold"):
        cells = [row[head.index(name)] for row in rows]
        expected = [float(cell) if cell else np.nan for cell in cells]
        np.testing.assert_array_equal(getattr(session, name), expected)
    assert session.values.tolist() == [[row[at] for row in rows] for at in range(1, 5)]
    assert [event.after for event in session.events] == [event[3] for event in surveys.EVENTS]
    assert np.isnan(session.events[0].score)
    assert session.events[1].score == 0.31
    first, second = session.places  # of an earlier version, without the newest columns
    assert [(place.may_be_off_mm, place.familiar) for place in session.places] == [(0, "")] * 2
    assert (first.status, first.size_mm, first.passes) == ("confirmed", 3.1, 2)
    assert np.isnan(second.size_mm)
    assert session.source == "simulated survey"


def test_what_is_damaged_is_named():
    for file, before, after, said in (
        ("stream.csv", b"head_mm", b"heed_mm", "no column head_mm"),
        ("stream.csv", b"0.800,", b"0.8oo,", "line 10: time_s is '0.8oo'"),
        ("stream.csv", b"0.800,", b"0.700,", "time_s does not increase from line to line"),
        ("stream.csv", b"0.800,", b"0.800,7,", "line 10 has 11 cells instead of 10"),
        ("stream.csv", b"0.15000", b"", "so nothing was judged"),
        ("stream.csv", b"time", b"\xff", "byte 1 is not UTF-8 text"),
        ("events.jsonl", b"}\n", b"\n", "line 1 is not an event"),
        ("events.jsonl", b'"suspected"', b"7", "line 2: event is '7'"),
        ("events.jsonl", b'"time_s": 8.0', b'"time_s": null', "line 1: time_s is 'None'"),
        ("places.csv", b"confirmed", b"perhaps", "line 2 is not a place with a verdict"),
        ("places.csv", b"3.1", b"big", "line 2: size_mm is 'big'"),
        ("session.json", b"{", b"[", "not JSON"),
        *((file, None, b"", file) for file in FILES - {"events.jsonl"}),
    ):
        contents = session_contents()
        assert before is None or before in contents[file]
        # Everywhere, because a change in one line may go unnoticed.
        contents[file] = contents[file].replace(before, after) if before else after
        with pytest.raises(SessionError, match=re.escape(said)):
            parse_session("demo", contents)
    # But nothing may have happened.
    assert parse_session("demo", session_contents() | {"events.jsonl": b""}).events == []


def test_finished_surveys_are_told_from_the_others(tmp_path):
    folders = {
        "b": FILES,
        "a.1": FILES | {"recordings"},
        "running": {"session.json", "stream.csv.part", "events.jsonl.part"},
        "a b": FILES,
        "half": FILES - {"places.csv"},
        ".hidden": FILES,
    }
    for name, files in folders.items():
        (tmp_path / name).mkdir()
        for file in files:
            (tmp_path / name / file).touch()
    listed = list_surveys(tmp_path)
    assert listed.names == ("a.1", "b")
    why = listed.passed_over
    assert why.keys() == {"running", "a b", "half"} and why["half"] == "there is no places.csv"
    assert "--resume" in why["running"] and "rename" in why["a b"]


def test_a_survey_that_changes_while_its_job_reads_it_is_not_drawn(tmp_path, monkeypatch):
    session, read = tmp_path / "sessions/first", survey.read_session
    surveys.write_session(session)

    def read_before_a_change(folder):
        stored = read(folder)
        with (folder / "session.json").open("a") as stream:
            stream.write("\n")
        return stored

    monkeypatch.setattr(survey, "read_session", read_before_a_change)
    diagonal = json.dumps({"diagonal": read_settings()["diagonal"]})
    words = ["--session", session, "--content", survey_content(session), "--settings", diagonal]
    words += ["--output", tmp_path / "drawn"]
    monkeypatch.setattr(sys, "argv", ["", *map(str, words)])
    with pytest.raises(CapsuleError, match="first has changed since the run began"):
        survey.main()
    assert not (tmp_path / "drawn").exists()


def test_the_path_holds_what_the_survey_knew_and_joins_it_by_straight_lines():
    session = parse_session("demo", session_contents())
    track = track_of(session)
    assert np.all(np.diff(track.time_s) == pytest.approx(0.8))
    np.testing.assert_allclose(
        track.head_mm[track.known], surveys.head_mm(track.time_s[track.known]), atol=0.006
    )
    unknown = track.time_s[~track.known]
    assert (unknown[0], unknown[-1]) == (pytest.approx(120.8), pytest.approx(211.2))
    between = track.head_mm[(track.time_s >= 120) & (track.time_s <= 212)]
    assert np.allclose(np.diff(between, 2), 0, atol=1e-9)
    # A place is pinned from its suspicion to its verdict, a crest where it was felt.
    assert pins_of(session) == [(96.0, 280.0), (320.0, 340.0)]
    assert crest_at_mm(session, surveys.DETECTOR) == pytest.approx(surveys.CREST_MM, abs=0.5)


def test_a_survey_that_never_knew_its_position_has_no_path():
    head, rows = stream_rows()
    at = head.index("head_mm")
    unknown = surveys.table(head, [[*row[:at], "", *row[at + 1 :]] for row in rows])
    lost = parse_session("lost", session_contents() | {"stream.csv": unknown})
    assert not track_of(lost).known.any()
    assert np.isnan(crest_at_mm(lost, surveys.DETECTOR))
