"""`capsule verify` makes all results again elsewhere, and names each one that differs."""

import shutil
import subprocess
import sys

import pytest

from capsule.commands import cli
from capsule.commands import report as workflow_call
from capsule.commands import verify as verification
from support.plain_figures import draw_plain_figures
from support.project import Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.takes(12)]

RECORDINGS = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in (1, 2)]


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """Return a project without results; the tests make them in their order."""
    folder = tmp_path_factory.mktemp("verified") / "project"
    project = Project.create(folder, RECORDINGS, 400, particles=10, iterations=10)
    project.configure(recordings_per_job=100)
    draw_plain_figures(folder)
    return project


def verify(project):
    command = [sys.executable, "workflow/scripts/capsule", "verify"]
    return subprocess.run(command, cwd=project.folder, capture_output=True, text=True, check=False)


def test_without_results_it_says_how_to_make_them(project):
    missing = verify(project)
    assert (missing.returncode, missing.stderr.count("\n")) == (1, 1)
    assert "results does not exist; make it first" in missing.stderr


def test_of_results_that_are_equal_none_is_named(project, monkeypatch, capsys):
    assert project.snakemake().status == 0

    def copy_results(again, _):
        # The next test makes them again for real.
        shutil.copytree(project.results, again / "results")

    monkeypatch.chdir(project.folder)
    monkeypatch.setattr(workflow_call, "PROJECT", project.folder)
    monkeypatch.setattr(verification, "call_workflow", copy_results)
    cli.main(["verify"])
    told = capsys.readouterr().out
    assert "64 results are the same as when made again" in told
    assert "not up to date" not in told


def test_a_result_that_differs_is_named_and_nothing_is_changed(project):
    fit = project.results / "fits/3mm/batch.json"
    fit.write_text(fit.read_text("utf-8").replace('"lag": ', '"lag": 1'), encoding="utf-8")
    # Of the page alone, which is not compared.
    project.configure(report={"reliable_rate": 0.9})
    before = project.result_bytes()
    found = verify(project)
    assert found.returncode == 1, found.stdout + found.stderr
    told = [line.strip() for line in found.stdout.splitlines() if line.startswith("  ")]
    assert told == ["differs: results/fits/3mm/batch.json"]
    assert "the results are not up to date, so differences are expected: Job" in found.stdout
    assert project.result_bytes() == before
