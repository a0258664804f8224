"""The workflow runs with the newest release of Snakemake, and with that of the lock, in turn."""

import subprocess
import sys

import pytest

from support.project import Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.packages, pytest.mark.takes(25)]

RECORDINGS = ["0mm/r01", "0mm/r02", "3mm/r01", "3mm/r02"]
TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]


@pytest.fixture(scope="module")
def newest(tmp_path_factory):
    """Return the environment in which Python finds the newest Snakemake first."""
    folder = tmp_path_factory.mktemp("newest")
    # Each module that is used is compiled when it is first imported.
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-compile"]
    subprocess.run([*install, "--target", folder, "snakemake<10"], check=True, capture_output=True)
    return {"PYTHONPATH": str(folder), "PYTHONWARNINGS": "default"}


def test_both_releases_agree_on_what_is_to_be_done(newest, tmp_path):
    project = Project.create(tmp_path / "project", RECORDINGS, 400, particles=10, iterations=10)
    run = project.snakemake(*TABLES, environment=newest)
    assert run.status == 0, run.output
    # Each reads the notes of the other.
    assert project.snakemake(*TABLES).did_nothing
    project.configure(fit={"seed": 2})
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    assert run.jobs["fit"] == 2 and not run.jobs["preprocess"]
    assert project.snakemake(*TABLES, environment=newest).did_nothing
    (project.raw / "3mm/r02.csv").write_bytes(b"")
    planned = project.snakemake("-n", *TABLES, environment=newest)
    assert planned.jobs["preprocess"] == 1, planned.output
