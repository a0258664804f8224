"""`capsule forget` leaves no trace of a recording, and the next run makes what it had taught."""

import base64
import hashlib
import sys

import pytest

from support.command import output_of

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

NAME = "1mm/r02"


def traces(project, content):
    """Return the files that hold the recording's name, its checksum or its readings."""
    readings = content.splitlines()[-1]
    wanted = [f"{NAME}{end}".encode() for end in (".", ":", "'", '"', ",", " ", "\n")]
    wanted += [hashlib.sha256(content).hexdigest().encode(), b"\n" + readings]
    found = set()
    for path in project.folder.rglob("*"):
        relative = path.relative_to(project.folder).as_posix()
        if relative.startswith(("workflow/", "config/")) or not path.is_file():
            continue
        try:
            named = base64.urlsafe_b64decode(path.name.removeprefix("@")).decode()
        except ValueError:
            named = ""
        text = f"{relative}\n{named}\n".encode() + path.read_bytes()
        if any(each in text for each in wanted):
            found.add(relative)
    return found


def test_no_file_holds_a_trace_and_the_next_run_makes_what_it_had_taught(project):
    content = (project.raw / f"{NAME}.csv").read_bytes()
    before = project.result_bytes()
    assert traces(project, content)
    command = [sys.executable, "workflow/scripts/capsule", "forget", NAME, "--yes"]
    output_of(*command, cwd=project.folder)
    assert not traces(project, content)
    stayed = project.result_bytes()
    assert {"checks/1mm/r01.json", "surveys/first/picture.pdf"} <= stayed.keys()
    assert all(before[each] == content for each, content in stayed.items())
    run = project.snakemake("--dry-run")
    assert run.status == 0, run.output
    # Those of the other recordings are there still.
    made = {"list", "list_labelled", "templates", "evaluate", "detect", "draw", "report"}
    assert set(run.jobs) == made | {"describe", "plot"}
