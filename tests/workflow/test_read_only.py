"""Calls of Snakemake that only tell something change no result, no recording and no note."""

import pytest

from support.mishaps import TABLES, create_project
from support.project import Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

CALLS = {
    "a dry run": ("--dry-run",),
    "a dry run with larger batches": ("--dry-run", "--config", "recordings_per_job=50"),
    "a summary": ("--summary",),
    "the graph of rules": ("--rulegraph",),
    "changed params": ("--list-changes", "params"),
    "changed code": ("--list-changes", "code"),
    "changed input": ("--list-changes", "input"),
    "lint": ("--lint",),
    "a report": ("--report", "out.html"),
}
STATES = {
    "clean": lambda project: None,
    "an edited recording": lambda project: project.append("raw/3mm/r02.csv", "\n"),
    "a damaged result": lambda project: project.append("results/fits/3mm/r01.json", "damage"),
    "a missing result": lambda project: (project.results / "fits/3mm/r01.json").unlink(),
    "a changed setting": lambda project: project.configure(fit={"seed": 2}),
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return a project after one run; tests copy it and do not change it."""
    return create_project(tmp_path_factory.mktemp("finished") / "project")


@pytest.fixture(scope="module", params=STATES)
def project(request, finished, tmp_path_factory):
    """Return a copy in one of the states; the calls of all tests leave it as it is."""
    project = finished.copy(tmp_path_factory.mktemp("state") / "project")
    STATES[request.param](project)
    return project


def state_of(project: Project):
    """Return content and time of every result, recording and note of Snakemake."""
    folders = (project.results, project.raw, project.folder / ".snakemake/metadata")
    paths = [path for folder in folders for path in (folder, *folder.rglob("*"))]
    return {
        path: (path.read_bytes() if path.is_file() else None, path.stat().st_mtime_ns)
        for path in paths
    }


@pytest.mark.parametrize("call", CALLS)
def test_a_call_that_only_tells_changes_nothing(project, call):
    before, beside = state_of(project), set(project.folder.iterdir())
    # Snakemake's own use of docutils warns.
    environment = {"PYTHONWARNINGS": ""} if call == "a report" else None
    run = project.snakemake(*CALLS[call], "--", *TABLES, environment=environment)
    assert run.status == 0, run.output
    assert state_of(project) == before
    written = {path.name for path in set(project.folder.iterdir()) - beside}
    assert written <= {"out.html"}
