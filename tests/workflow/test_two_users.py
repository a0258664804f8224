"""A second user in the folder of a first: what cannot be read or written is named in one line."""

import os
import shutil
import subprocess
import sys

import pytest

from support.project import Project

pytestmark = [
    pytest.mark.slow,
    pytest.mark.workflow,
    pytest.mark.skipif(
        os.name != "posix" or os.geteuid() != 0 or not shutil.which("setpriv"),
        reason="only the administrator can give files to another user",
    ),
]

TARGETS = ["results/evaluation/detection.csv", "results/detections.csv"]
# Root may open anything, unless it gives that right away.
ANOTHER_USER = ["setpriv", "--bounding-set=-dac_override,-dac_read_search,-fowner"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return a project after one run; tests copy it."""
    names = ["0mm/r1", "0mm/r2", "3mm/r1", "3mm/r2", "unlabelled/p"]
    folder = tmp_path_factory.mktemp("finished") / "project"
    project = Project.create(folder, names, 400, particles=10, iterations=10)
    run = project.snakemake(*TARGETS)
    assert run.status == 0, run.output
    return project


@pytest.fixture
def project(finished, tmp_path):
    """Return a project with results, of which a user who is not root owns every file."""
    project = finished.copy(tmp_path / "project")
    for path in (project.folder, *project.folder.rglob("*")):
        os.chown(path, 12345, 12345)
    return project


def call(project, *words):
    """Call as another user, and return the exit status and what was printed."""
    command = [*ANOTHER_USER, sys.executable, *words]
    done = subprocess.run(
        command, cwd=project.folder, capture_output=True, text=True, check=False, umask=0o002
    )
    return done.returncode, done.stdout + done.stderr


def snakemake(project, *words):
    return call(project, "-m", "snakemake", *words, *TARGETS)


def capsule(project, *words):
    return call(project, "workflow/scripts/capsule", *words)


def allow(folder, rights):
    subprocess.run(["chmod", "-R", rights, folder], check=True)


def test_a_user_who_cannot_write_is_told_so_and_may_judge(project):
    allow(project.folder, "go=rX")
    for options in (["-n"], ["-c1"]):
        status, told = snakemake(project, *options)
        assert status != 0
        assert f"{project.folder} cannot be written, and Snakemake keeps notes there" in told
        assert "Traceback" not in told
    # The folder itself may be open to all.
    project.folder.chmod(0o777)
    for options in (["-n"], ["-c1"]):
        status, told = snakemake(project, *options)
        assert status != 0
        assert f"{project.folder}/.snakemake cannot be written" in told
        assert "Traceback" not in told
    assert capsule(project, "judge", "raw/3mm/r1.csv")[0] == 0
    assert "run.lock: Permission denied" in capsule(project, "forget", "3mm/r1", "--yes")[1]
    assert (project.raw / "3mm/r1.csv").exists()


def test_results_that_a_user_may_not_read_are_named(project):
    allow(project.folder, "a+rwX")
    allow(project.results, "go=")
    recording = "raw/3mm/r1.csv"
    for told in (
        snakemake(project, "-n"),
        snakemake(project, "-c1"),
        capsule(project, "judge", recording),
        capsule(project, "export", "--format", "mat"),
    ):
        assert told[0] != 0
        lines = [line for line in told[1].splitlines() if "Permission denied" in line]
        assert len(lines) == 1
        assert lines[0].startswith("error: results")
        assert "Traceback" not in told[1]


def test_two_users_who_may_write_go_on_with_each_others_results(project):
    allow(project.folder, "a+rwX")
    path = project.raw / "0mm/r1.csv"
    path.write_text(f"# note: changed\n{path.read_text()}")
    status, told = snakemake(project, "-c1")
    assert status == 0, told
    assert project.snakemake("-n", *TARGETS).did_nothing
