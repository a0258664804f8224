"""The project and its environment may lie anywhere, and the jobs run in the Python of the run."""

import os
import shutil
import subprocess
import sys

import pytest

from support.marks import needs_process_groups, needs_programs
from support.plain_figures import draw_plain_figures
from support.project import ROOT, Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

RECORDINGS = ["0mm/r01", "0mm/r02", "0mm/r03", "0mm/r04", "3mm/r01", "3mm/r02"]


@needs_programs("make", packages="make")
@pytest.mark.takes(120)
def test_make_report_works_in_a_path_with_spaces_and_of_more_than_250_characters(tmp_path):
    # The environment lies there, too: the first lines of its programs name it.
    parent = tmp_path / "a folder (of ours)" / ("long " * 25).strip() / ("longer " * 18).strip()
    project = Project.create(parent / "the project", RECORDINGS, particles=10, iterations=10)
    assert len(str(project.folder)) > 250
    draw_plain_figures(project.folder)
    for name in ("Makefile", "pyproject.toml", "README.md", "requirements.lock"):
        shutil.copy2(ROOT / name, project.folder)
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    called = {"cwd": project.folder, "env": environment, "text": True, "check": False}
    done = subprocess.run(
        ["make", "report", f"PYTHON={sys.executable}"], **called, capture_output=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert {row["status"] for row in project.table("recordings.csv")} == {"accepted"}
    assert (project.results / "report.html").stat().st_size > 0
    assert project.snakemake("-n").did_nothing
    told = subprocess.run(
        [project.folder / ".venv/bin/capsule", "--version"], **called, capture_output=True
    )
    assert str(project.folder / "workflow") in told.stdout


@needs_process_groups
def test_jobs_run_in_the_python_of_the_run_whatever_the_environment(tmp_path):
    project = Project.create(tmp_path / "project", RECORDINGS[:1], particles=10, iterations=10)
    # The first python of the PATH is another one, and nothing under TMPDIR can be executed.
    other, temporary = tmp_path / "other", tmp_path / "temporary"
    other.mkdir()
    temporary.mkdir()
    for name in ("python", "python3"):
        (other / name).write_text("#!/bin/sh\necho another Python\nexit 9\n")
        (other / name).chmod(0o755)
    environment = os.environ | {
        "PATH": f"{other}:/usr/bin:/bin",
        "TMPDIR": str(temporary),
        "PYTHONPATH": "",
    }
    snakemake = [sys.executable, "-m", "snakemake", "-c1", "results/matrices/0mm/r01.npy"]
    done = subprocess.run(
        [*on_a_disk_without_programs(temporary), *snakemake],
        cwd=project.folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (project.results / "matrices/0mm/r01.npy").is_file()


def on_a_disk_without_programs(folder):
    """Return a command that mounts such a disk on a folder, for the command after it.

    Where the system lets nobody mount, the command is empty, and the folder is an ordinary one.
    """
    script = 'mount -t tmpfs -o noexec tmpfs "$0" && exec "$@"'
    mounted = ["unshare", "--map-root-user", "--mount", "sh", "-c", script, str(folder)]
    program = f"printf '#!/bin/sh\n' > '{folder}/program' && chmod +x '{folder}/program'"
    tried = [*mounted, "sh", "-c", f"{program} && ! '{folder}/program'"]
    if shutil.which("unshare") is None:
        return []
    works = subprocess.run(tried, capture_output=True, check=False).returncode == 0
    return mounted if works else []
