"""One archive and its results, which all stories of the workflow begin with."""

import pytest

from support.project import Project, built_once
from support.surveys import write_session

HEALTHY = [f"0mm/r{run:02d}" for run in (1, 2, 3, 4)]
NODULES = [f"{size}mm/r{run:02d}" for size in (1, 2.5) for run in (1, 2)]
RECORDINGS = [*HEALTHY, *NODULES, "unlabelled/patient"]


def make_new(folder):
    """Make a project with recordings and a survey, without results."""
    Project.create(folder, RECORDINGS, particles=20, iterations=20)
    write_session(folder / "sessions/first")


def make_finished(folder):
    """Make the project, and run it once."""
    make_new(folder)
    run = Project(folder).snakemake()
    assert run.status == 0, run.output
    expected = {"preprocess": 9, "fit": 4, "describe": 4, "plot": 4, "list": 1, "list_labelled": 1}
    expected |= dict.fromkeys(("templates", "evaluate", "detect", "draw", "survey", "report"), 1)
    assert run.jobs == expected


@pytest.fixture(scope="session")
def new(tmp_path_factory):
    """Return a project without results; tests copy it and do not change it."""
    folder = tmp_path_factory.mktemp("new") / "project"
    make_new(folder)
    return Project(folder)


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """Return the project after one run; tests copy it and do not change it."""
    return Project(built_once(tmp_path_factory, "finished", make_finished))


@pytest.fixture
def project(finished, tmp_path):
    """Return a copy of the project with its results."""
    return finished.copy(tmp_path / "project")
