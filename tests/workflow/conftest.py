"""One archive and its results, which all stories of the workflow begin with."""

import os

import pytest

from support.project import Project, built_once
from support.surveys import write_session

# Of a session that judges, and teaches nothing.
HELD_OUT = "2.5mm/h01"
RECORDINGS = ["0mm/r01", "0mm/r02", "1mm/r01", "1mm/r02", "2.5mm/r01", HELD_OUT]
RECORDINGS.append("unlabelled/patient")
# Notes each file that a job, or a fork of it, opens for reading. A fork ends without a last word.
TRACE = """
import json, os, sys
def note(event, arguments):
    if event == "open" and isinstance(arguments[0], (str, os.PathLike)):
        path, mode, flags = arguments
        if not (flags or 0) & (os.O_WRONLY | os.O_RDWR):
            line = json.dumps([sys.orig_argv[1:], os.path.relpath(os.fspath(path))])
            os.write(notes, line.encode() + b"\\n")
notes = os.open(os.environ["TRACED"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
sys.addaudithook(note)
"""


def make_finished(folder):
    """Make the project, and run it once; the file `traced` beside it tells what its jobs read."""
    project = Project.create(folder, RECORDINGS, particles=20, iterations=20)
    path = project.raw / f"{HELD_OUT}.csv"
    path.write_bytes(b"# session: spring\n# setup: one\n" + path.read_bytes())
    project.configure(evaluation={"held_out": ["spring"]})
    write_session(folder / "sessions/first")
    tracing = folder.with_name("tracing")
    tracing.mkdir()
    (tracing / "sitecustomize.py").write_text(TRACE)
    traced = {"PYTHONPATH": str(tracing), "TRACED": str(folder.with_name("traced"))}
    # Jobs run in the Python of the run, even if the first one of the path is another.
    for name in ("python", "python3"):
        (tracing / name).symlink_to("/bin/false")
    traced["PATH"] = f"{tracing}{os.pathsep}{os.environ['PATH']}"
    run = project.snakemake(environment=traced)
    assert run.status == 0, run.output
    expected = {"preprocess": 7, "fit": 3, "describe": 4, "plot": 4, "list": 1, "list_labelled": 1}
    expected |= dict.fromkeys(("templates", "evaluate", "detect", "draw", "survey", "report"), 1)
    assert run.jobs == expected


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """Return the project after one run; tests copy it and do not change it."""
    return Project(built_once(tmp_path_factory, "finished", make_finished))


@pytest.fixture
def project(finished, tmp_path):
    """Return a copy of the project with its results."""
    return finished.copy(tmp_path / "project")


@pytest.fixture
def new(finished, tmp_path):
    """Return a copy of the project as it was before its first run."""
    return finished.copy(tmp_path / "new", results=False)
