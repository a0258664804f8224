"""`capsule forget` leaves no trace of a recording, and the next run makes what it had taught."""

import base64
import hashlib
import subprocess
import sys

import pytest

from support.plain_figures import draw_plain_figures
from support.project import Project
from support.surveys import write_session

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.takes(15)]

GONE, LONGER = "3mm/patient-7", "3mm/patient-7b"
OTHERS = [*(f"0mm/r{run}" for run in range(1, 5)), "3mm/r1", LONGER, "unlabelled/p"]


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


@pytest.mark.parametrize("together", [1, 3])
def test_no_file_holds_a_trace_and_the_next_run_is_as_if_it_had_never_been(tmp_path, together):
    project = Project.create(tmp_path / "project", OTHERS, 400, particles=10, iterations=10)
    project.configure(recordings_per_job=together)
    draw_plain_figures(project.folder)
    # Batches mean nothing to a survey, which takes seconds to draw.
    if together == 1:
        write_session(project.folder / "sessions" / "gut-1")
    never = project.copy(tmp_path / "never")
    other = Project.create(tmp_path / "other", [GONE], 400)
    (project.raw / f"{GONE}.csv").write_bytes((other.raw / f"{GONE}.csv").read_bytes())
    for each in (project, never):
        run = each.snakemake()
        assert run.status == 0, run.output
    kept = never.copy(tmp_path / "kept")
    (kept.raw / f"{GONE}.csv").write_bytes((other.raw / f"{GONE}.csv").read_bytes())

    before = project.result_bytes()
    told = forget(project, GONE, "--dry-run")
    assert (told.returncode, told.stdout.splitlines()[0]) == (0, f"raw/{GONE}.csv")
    assert project.result_bytes() == before
    done = forget(project, GONE, "--yes")
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    # The content is needed once more, to look for it.
    (project.folder / "workflow" / "raw").mkdir()
    left = Project(project.folder)
    left.raw = kept.raw
    assert not traces(left, GONE)
    assert traces(kept, GONE)
    stayed = project.result_bytes()
    assert f"checks/{LONGER}.json" in stayed or together > 1
    assert ("surveys/gut-1/picture.pdf" in stayed) == (together == 1)
    assert all(before[name] == content for name, content in stayed.items())

    run = project.snakemake()
    assert run.status == 0, run.output
    assert run.jobs["preprocess"] == (0 if together == 1 else 1)
    assert "gone" not in run.output
    after, expected = project.result_bytes(), never.result_bytes()
    assert after.keys() == expected.keys()
    different = {name for name in expected if after[name] != expected[name]}
    assert different <= {"report.html"}
    assert project.snakemake().did_nothing
