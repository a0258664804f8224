"""What a job reads is what its rule declares, and nothing more, by a trace of the opened files."""

import json
import shlex
from pathlib import Path

import pytest

from support.project import Project
from support.surveys import write_session

pytestmark = [pytest.mark.workflow, pytest.mark.slow, pytest.mark.takes(30)]

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
# Inputs of which a job reads some: near copies are compared if their marks are alike, two
# recordings stand for all in a figure, passes of one place are combined if there are any, and a
# page shows nothing of a figure's data.
IN_PART = {
    "list": ("results/signals/",),
    "list_labelled": ("results/signals/",),
    "draw": ("results/signals/", "results/evaluation/"),
    "detect": ("results/matrices/", "results/evaluation/predictions.csv"),
    "report": ("results/matrices/", "results/figures/", "results/surveys/"),
}


@pytest.fixture(scope="module")
def jobs(tmp_path_factory):
    """Return rule, declared inputs and read files of each job of a run."""
    folder = tmp_path_factory.mktemp("declared")
    recordings = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in range(1, 5)]
    recordings += ["unlabelled/p1"]
    project = Project.create(folder / "project", recordings, particles=5, iterations=5)
    write_session(project.folder / "sessions/first")
    (folder / "sitecustomize.py").write_text(TRACE)
    traced = {"PYTHONPATH": str(folder), "TRACED": str(folder / "traced")}
    run = project.snakemake(environment=traced)
    assert run.status == 0, run.output
    read = {}
    for line in (folder / "traced").read_text(encoding="utf-8").splitlines():
        words, path = json.loads(line)
        read.setdefault(tuple(words), set()).add(path)
    made = {}
    for path in (project.folder / ".snakemake/metadata").iterdir():
        job = json.loads(path.read_text(encoding="utf-8"))
        words = tuple(shlex.split(job["shellcmd"].partition(" > ")[0])[1:])
        # What is no input because its content alone decides is named in the command.
        named = {word.partition("=")[0] for word in words}
        named = {word for word in named if word.startswith(("raw/", "sessions/"))}
        made[words] = job["rule"], {*job["input"], *named}, read[words]
    return list(made.values())


def below(path, names):
    """Return whether a path is one of some names, or lies below one."""
    return any(path == name or path.startswith(f"{name.rstrip('/')}/") for name in names)


def test_each_rule_has_its_jobs(jobs):
    assert {rule for rule, *_ in jobs} == {
        *("preprocess", "list", "list_labelled", "fit", "describe", "plot", "templates"),
        *("evaluate", "detect", "draw", "survey", "report"),
    }


def test_a_job_reads_nothing_that_its_rule_does_not_declare(jobs):
    undeclared = {
        (rule, path)
        for rule, declared, read in jobs
        for path in read
        if Path(path).parts[0] in ("results", "raw", "sessions") and not below(path, declared)
    }
    assert undeclared == set()


def test_a_job_reads_what_its_rule_declares(jobs):
    unread = {
        (rule, path)
        for rule, declared, read in jobs
        for path in declared - read
        if not path.startswith("sessions/") and not below(path, IN_PART.get(rule, ()))
    }
    assert unread == set()
