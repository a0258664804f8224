"""Fixtures: one report for all tests of the page, and one browser for each of their processes."""

import re

import pytest

from support.browser import EVIL, RECORDINGS, Browser
from support.project import Project, built_once
from support.surveys import write_session


@pytest.fixture(scope="session")
def project(tmp_path_factory):
    """Run the workflow on an archive with careless or malicious content, and return the project.

    The processes of a test run share the project. The first process makes it; no test changes it.
    """
    return Project(built_once(tmp_path_factory, "report", run_project))


def run_project(folder):
    project = Project.create(folder, RECORDINGS, particles=20, iterations=20)
    project.configure(recordings_per_job=20)
    # Three sessions, neither of which has recordings of one size alone.
    for path in project.raw.glob("[16]mm/*.csv"):
        path.write_bytes(f"# session: {path.stem}\n".encode() + path.read_bytes())
    path = project.raw / "1mm" / "r03.csv"
    content = path.read_text(encoding="utf-8")
    path.write_text(re.sub(r"(?m)^# source: .*$", f"# source: bench {EVIL}", content), "utf-8")
    (project.raw / "1mm" / "empty.csv").write_bytes(b"")
    (project.raw / "1mm" / "wrong.csv").write_text(f"time_s,{EVIL}\n0,1\n", encoding="utf-8")
    (project.raw / "1mm" / "<b>.txt").write_text("notes", encoding="utf-8")
    for name, contents in (("demo", None), ("second", None), ("running", {"stream.csv.part": b""})):
        write_session(folder / "sessions" / name, contents)
    run = project.snakemake()
    assert run.status == 0, run.output


@pytest.fixture(scope="session")
def page(project):
    return project.results / "report.html"


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    browser = Browser(tmp_path_factory.mktemp("browser"))
    yield browser
    browser.close()
