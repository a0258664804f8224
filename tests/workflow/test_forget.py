"""`capsule forget` leaves no trace of a recording, and the next run makes what it had taught."""

import base64
import hashlib
import subprocess
import sys

import pytest

from support.project import Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.takes(15)]

GONE, LONGER = "1mm/patient-7", "1mm/patient-7b"


def forget(project, *words):
    command = [sys.executable, "workflow/scripts/capsule", "forget", *words]
    return subprocess.run(command, cwd=project.folder, capture_output=True, text=True, check=False)


def traces(project, name):
    """Return the files that hold a recording's name, its checksum or its readings."""
    content = (project.raw / f"{name}.csv").read_bytes()
    readings = content.splitlines()[-1]
    wanted = [f"{name}.", f"{name}:", f"{name}'", f'{name}"', f"{name},", f"{name} ", f"{name}\n"]
    wanted = [each.encode() for each in wanted]
    wanted += [hashlib.sha256(content).hexdigest().encode(), b"\n" + readings]
    found = set()
    for path in project.folder.rglob("*"):
        relative = path.relative_to(project.folder).as_posix()
        if relative.startswith(("workflow/", "config/")) or not path.is_file():
            continue
        coded = "".join(part.removeprefix("@") for part in path.parts[-1:])
        try:
            named = base64.urlsafe_b64decode(coded).decode()
        except ValueError:
            named = ""
        text = f"{relative}\n{named}\n".encode() + path.read_bytes()
        if any(each in text for each in wanted):
            found.add(relative)
    return found


def test_no_file_holds_a_trace_and_the_next_run_is_as_if_it_had_never_been(finished, tmp_path):
    project = finished.copy(tmp_path / "project")
    other = Project.create(tmp_path / "other", [GONE, LONGER])
    for name in (GONE, LONGER):
        (project.raw / f"{name}.csv").write_bytes((other.raw / f"{name}.csv").read_bytes())
    run = project.snakemake()
    assert run.status == 0, run.output
    assert traces(project, GONE)

    before = project.result_bytes()
    told = forget(project, GONE, "--dry-run")
    assert (told.returncode, told.stdout.splitlines()[0]) == (0, f"raw/{GONE}.csv")
    assert project.result_bytes() == before
    for name in (GONE, LONGER):
        done = forget(project, name, "--yes")
        assert (done.returncode, done.stderr) == (0, ""), done.stdout
        left = Project(project.folder)
        # The content is needed once more, to look for it.
        left.raw = other.raw
        assert not traces(left, name)
        stayed = project.result_bytes()
        assert f"checks/{LONGER}.json" in stayed or name == LONGER
        assert "surveys/first/picture.pdf" in stayed
        assert all(before[each] == content for each, content in stayed.items())

    run = project.snakemake()
    assert run.status == 0, run.output
    assert not run.jobs["preprocess"]
    assert "gone" not in run.output
    after, expected = project.result_bytes(), finished.result_bytes()
    assert after.keys() == expected.keys()
    different = {name for name in expected if after[name] != expected[name]}
    assert different <= {"report.html"}
