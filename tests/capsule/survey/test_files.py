"""The files of a session are read, and damaged files are refused."""

import numpy as np
import pytest

from capsule.survey.files import SessionError, parse_session
from capsule.survey.listed import list_surveys
from support.surveys import EVENTS, PLACES, session_contents, stream_rows

FILES = {"stream.csv", "events.jsonl", "places.csv", "session.json"}


def test_everything_that_the_files_hold_is_read():
    session = parse_session("demo", session_contents())
    head, rows = stream_rows()
    for name in ("time_s", "wave_mm", "head_mm", "score", "threshold"):
        cells = [row[head.index(name)] for row in rows]
        expected = [float(cell) if cell else np.nan for cell in cells]
        np.testing.assert_array_equal(getattr(session, name), expected)
    assert session.values.tolist() == [[row[at] for row in rows] for at in range(1, 5)]
    assert [event.after for event in session.events] == [event[3] for event in EVENTS]
    assert np.isnan(session.events[0].score)
    assert session.events[1].score == 0.31
    first, second = session.places  # of an earlier version, without the newest columns
    assert [(place.may_be_off_mm, place.familiar) for place in session.places] == [(0, "")] * 2
    assert (first.status, first.size_mm, first.passes) == ("confirmed", *PLACES[0][4:3:-1], 2)
    assert np.isnan(second.size_mm)
    assert session.source == "simulated survey"


@pytest.mark.parametrize(
    ("file", "before", "after", "said"),
    [
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
    ],
)
def test_what_is_damaged_is_named(file, before, after, said):
    contents = session_contents()
    assert before in contents[file]
    # Everywhere, because a change in one line may go unnoticed.
    contents[file] = contents[file].replace(before, after)
    with pytest.raises(SessionError) as fault:
        parse_session("demo", contents)
    assert said in str(fault.value)


def test_an_empty_file_is_no_session_but_nothing_may_have_happened():
    assert parse_session("demo", session_contents() | {"events.jsonl": b""}).events == []
    for file in FILES - {"events.jsonl"}:
        with pytest.raises(SessionError):
            parse_session("demo", session_contents() | {file: b""})


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
    assert set(listed.passed_over) == {"running", "a b", "half"}
    assert "--resume" in listed.passed_over["running"]
    assert "rename" in listed.passed_over["a b"]
    assert listed.passed_over["half"] == "there is no places.csv"
