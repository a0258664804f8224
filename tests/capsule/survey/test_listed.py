"""A survey that changes while its job reads it is drawn by the next run."""

import json
import sys

import pytest

import survey
from capsule.engine.configuration import read_settings
from capsule.errors import CapsuleError
from capsule.survey.listed import survey_content
from support.surveys import write_session


def test_a_survey_that_changes_while_its_job_reads_it_is_not_drawn(tmp_path, monkeypatch):
    session, read = tmp_path / "sessions/first", survey.read_session
    write_session(session)

    def read_before_a_change(folder):
        stored = read(folder)
        with (folder / "session.json").open("a") as stream:
            stream.write("\n")
        return stored

    monkeypatch.setattr(survey, "read_session", read_before_a_change)
    words = ["--session", session, "--content", survey_content(session)]
    words += ["--output", tmp_path / "drawn"]
    words += ["--settings", json.dumps({"diagonal": read_settings()["diagonal"]})]
    monkeypatch.setattr(sys, "argv", ["", *map(str, words)])
    with pytest.raises(CapsuleError, match="first has changed since the run began"):
        survey.main()
    assert not (tmp_path / "drawn").exists()
