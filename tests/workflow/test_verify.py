"""`capsule verify` makes all results again elsewhere, and names each one that differs."""

import subprocess
import sys

import pytest

from support.project import Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.takes(25)]

RECORDINGS = [*(f"0mm/r{run:02d}" for run in range(1, 5)), "3mm/r01", "3mm/r02"]


def verify(project):
    command = [sys.executable, "workflow/scripts/capsule", "verify"]
    return subprocess.run(command, cwd=project.folder, capture_output=True, text=True, check=False)


def test_every_result_that_differs_is_named_and_nothing_is_changed(tmp_path):
    project = Project.create(tmp_path / "project", RECORDINGS, particles=10, iterations=10)
    missing = verify(project)
    assert (missing.returncode, missing.stderr.count("\n")) == (1, 1)
    assert "results does not exist; make it first" in missing.stderr
    assert project.snakemake().status == 0
    whole = verify(project)
    assert whole.returncode == 0, whole.stdout + whole.stderr
    assert "results are the same as when made again" in whole.stdout

    fit = project.results / "fits/3mm/r02.json"
    fit.write_text(fit.read_text("utf-8").replace('"lag": ', '"lag": 1'), encoding="utf-8")
    before = project.result_bytes()
    found = verify(project)
    assert found.returncode == 1
    told = [line.strip() for line in found.stdout.splitlines() if line.startswith("  ")]
    assert told == ["differs: results/fits/3mm/r02.json"]
    assert project.result_bytes() == before

    project.configure(fit={"seed": 2})
    assert (
        "the results are not up to date, so differences are expected: Job" in verify(project).stdout
    )
