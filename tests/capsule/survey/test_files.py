"""The files of a session: read, refused if damaged, listed, and what they tell of the track."""

import re
import sys
from dataclasses import replace

import numpy as np
import pytest

import survey
from capsule.errors import CapsuleError
from capsule.survey.files import SessionError, parse_session, read_session
from capsule.survey.listed import list_surveys, survey_content
from capsule.survey.track import crest_at_mm, pins_of, track_of
from support import surveys
from support.surveys import session_contents, stream_rows

FILES = {"stream.csv", "events.jsonl", "places.csv", "session.json"}


def test_everything_that_the_files_hold_is_read():
    session = parse_session("demo", session_contents())
    head, rows = stream_rows()
    cells = dict(zip(head, zip(*rows, strict=True), strict=True))
    for name in ("time_s", "wave_mm", "head_mm", "score", "threshold"):
        expected = [float(cell or "nan") for cell in cells[name]]
        np.testing.assert_array_equal(getattr(session, name), expected)
    assert session.values.tolist() == [list(cells[name]) for name in head[1:5]]
    told = [(event.after, event.score) for event in session.events]
    assert str(told) == str([(event[3], event[5] or np.nan) for event in surveys.EVENTS])
    first, second = session.places  # of an earlier version, without the newest columns
    assert (first.status, first.size_mm, first.may_be_off_mm) == ("confirmed", 3.1, 0)
    assert str((second.size_mm, second.passes, second.familiar)) == "(nan, 1, '')"
    assert session.source == "simulated survey"


def test_what_is_damaged_is_named():
    whole = session_contents()
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
        ("session.json", b"{", b"[", "not JSON"),
        *((file, None, b"", file) for file in FILES - {"events.jsonl"}),
    ):
        assert before is None or before in whole[file]
        # Everywhere, because a change in one line may go unnoticed.
        content = whole[file].replace(before, after) if before else after
        with pytest.raises(SessionError, match=re.escape(said)):
            parse_session("demo", whole | {file: content})
    # But nothing may have happened.
    assert parse_session("demo", whole | {"events.jsonl": b""}).events == []


def test_finished_surveys_are_told_from_the_others(tmp_path):
    folders = dict.fromkeys(("b", "a b", ".hidden"), FILES) | {"a.1": FILES | {"recordings"}}
    folders |= {"running": {"stream.csv.part"}, "half": FILES - {"places.csv"}}
    for name, files in folders.items():
        for file in files:
            (tmp_path / name).mkdir(exist_ok=True)
            (tmp_path / name / file).touch()
    listed = list_surveys(tmp_path)
    assert listed.names == ("a.1", "b")
    told = {"running": "--resume", "a b": "rename", "half": "there is no places.csv"}
    assert told.keys() == listed.passed_over.keys()
    assert all(told[name] in reason for name, reason in listed.passed_over.items())


def test_a_survey_that_changes_while_its_job_reads_it_is_not_drawn(tmp_path, monkeypatch):
    surveys.write_session(session := tmp_path / "sessions/first")

    def read(folder):
        assert read_session(folder).name == "first"
        (folder / "session.json").write_text("{}")
        raise SessionError("half of it is new")

    monkeypatch.setattr(survey, "read_session", read)
    words = f"--session {session} --content {survey_content(session)} --output {tmp_path}/drawn"
    monkeypatch.setattr(sys, "argv", ["", *words.split(), "--settings", '{"diagonal": {}}'])
    with pytest.raises(CapsuleError, match="first has changed since the run began"):
        survey.main()
    assert not (tmp_path / "drawn").exists()


def test_the_path_holds_what_the_survey_knew_and_joins_it_by_straight_lines():
    session = parse_session("demo", session_contents())
    track = track_of(session)
    assert np.all(np.diff(track.time_s) == pytest.approx(0.8))
    expected_mm, unknown_s = surveys.head_mm(track.time_s), track.time_s[~track.known]
    np.testing.assert_allclose(track.head_mm[track.known], expected_mm[track.known], atol=0.006)
    assert unknown_s[[0, -1]] == pytest.approx([120.8, 211.2])
    between = track.head_mm[(track.time_s >= 120) & (track.time_s <= 212)]
    assert np.allclose(np.diff(between, 2), 0, atol=1e-9)
    # A place is pinned from its suspicion to its verdict, a crest where it was felt.
    assert pins_of(session) == [(96.0, 280.0), (320.0, 340.0)]
    assert crest_at_mm(session, surveys.DETECTOR) == pytest.approx(surveys.CREST_MM, abs=0.5)
    # A survey that never knew its position has no path.
    lost = replace(session, head_mm=np.full(session.time_s.size, np.nan))
    assert not track_of(lost).known.any()
    assert np.isnan(crest_at_mm(lost, surveys.DETECTOR))
