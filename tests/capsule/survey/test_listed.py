"""A survey that changes while its job reads it is drawn by the next run."""

import json
import sys

import pytest

import survey
from capsule.engine.configuration import read_settings
from capsule.errors import CapsuleError
from capsule.survey.listed import survey_content
from support.surveys import write_session


@pytest.mark.parametrize("moment", ["before", "while it is read"])
def test_a_survey_that_changes_during_the_run_is_not_drawn(tmp_path, monkeypatch, moment):
    session = tmp_path / "sessions/first"
    write_session(session)
    content = survey_content(session)
    changed = session / "session.json"
    before = changed.read_bytes()

    def change():
        changed.write_bytes(before + b"\n")

    def read_and_change(folder):
        change()
        return read(folder)

    read = survey.read_session
    if moment == "before":
        change()
    else:
        monkeypatch.setattr(survey, "read_session", read_and_change)
    words = ["--session", session, "--content", content, "--output", tmp_path / "drawn"]
    settings = json.dumps({"diagonal": read_settings()["diagonal"]})
    monkeypatch.setattr(sys, "argv", list(map(str, ["", *words, "--settings", settings])))
    with pytest.raises(CapsuleError, match="first has changed since the run began"):
        survey.main()
    assert not (tmp_path / "drawn").exists()
