"""The workflow draws each survey once, and again only after a change."""

import json

import pytest

from support.project import Project
from support.surveys import session_contents, write_session

pytestmark = [pytest.mark.slow, pytest.mark.workflow]


def target(name):
    return f"results/surveys/{name}/survey.json"


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    project = Project.create(tmp_path_factory.mktemp("surveys") / "project", ["3mm/r01"])
    for name in ("first", "second"):
        write_session(project.folder / "sessions" / name)
    return project


def test_each_survey_is_drawn_and_only_what_changed_is_drawn_again(project):
    both = [target("first"), target("second")]
    run = project.snakemake(*both)
    assert run.status == 0, run.output
    assert run.jobs["survey"] == 2
    made = {path.name for path in (project.results / "surveys/first").iterdir()}
    assert made == {
        "survey.json",
        "picture.csv",
        *(f"picture{width}.{kind}" for width in ("", "_column") for kind in ("svg", "pdf")),
    }
    for width in ("", "_column"):
        printed = project.results / f"surveys/first/picture{width}.pdf"
        assert printed.read_bytes().startswith(b"%PDF")
    assert project.snakemake(*both).did_nothing
    # A survey that is still written, and one that is damaged, stop nothing.
    write_session(project.folder / "sessions/running", {"stream.csv.part": b""})
    damaged = session_contents() | {"places.csv": b"place\n"}
    (project.folder / "sessions/second/places.csv").write_bytes(damaged["places.csv"])
    run = project.snakemake(*both)
    assert run.status == 0, run.output
    assert run.jobs["survey"] == 1
    assert run.output.count("survey passed over: sessions/running: not finished") == 1
    assert (
        "survey passed over: sessions/second: cannot be read: places.csv: there is no" in run.output
    )
    values = json.loads((project.folder / target("second")).read_text())
    assert "no column status" in values["problem"]
