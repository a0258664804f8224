"""After a kill or with a full disk, the same command continues the run."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import time

import psutil
import pytest

from capsule.store.files import UNFINISHED
from support.project import JOB, Project

pytestmark = [
    pytest.mark.workflow,
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="Windows has no process groups to kill"),
]

TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
# So many jobs have begun when a run is killed; the one before may have ended at the same time.
KILLED_AT = 6


def finished_jobs(project):
    """Return the messages of the jobs that the last run has finished, from Snakemake's log."""
    *_, log = sorted((project.folder / ".snakemake/log").glob("*.log"))
    text = log.read_text(encoding="utf-8")
    by_number = dict(re.findall(r"^Job (\d+): (.+)", text, re.MULTILINE))
    return [by_number[number] for number in re.findall(r"^Finished jobid: (\d+)", text, re.M)]


def half_written(project, expected):
    """Return the results that have their final name, but another content."""
    return [
        name
        for name, content in project.result_bytes().items()
        if not name.endswith(UNFINISHED) and content != expected[name]
    ]


def test_after_a_kill_the_plain_command_goes_on(new, finished):
    """`try_mishaps.py` kills hundreds of runs, at any moment."""
    expected = finished.result_bytes()
    with new.start(*TABLES, cores=2) as killed:
        for line in killed.stdout:
            if line.startswith(f"{KILLED_AT} of "):
                os.killpg(killed.pid, signal.SIGKILL)
    assert killed.returncode == -signal.SIGKILL
    done = finished_jobs(new)
    assert done
    assert half_written(new, expected) == []
    run = new.snakemake(*TABLES)
    assert run.status == 0, run.output
    assert not set(done) & set(JOB.findall(run.output)), "a finished job was done again"
    assert half_written(new, expected) == []
    assert {"detections.csv", "templates.npz"} <= new.result_bytes().keys()
    assert not list(new.results.rglob(f"*{UNFINISHED}"))


def job_of(run):
    """Return the process of the script that a run has started; it may take a moment."""
    while run.poll() is None:
        for child in psutil.Process(run.pid).children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                # The shell that calls a script names it behind "-c", in the midst of a command.
                if any(each.endswith("workflow/scripts/fit.py") for each in child.cmdline()):
                    return child
    raise AssertionError("the run has ended without a fit")


def test_a_job_of_a_killed_run_writes_nothing_once_the_next_has_begun(new, finished):
    target = "fits/1mm/r01.json"
    # The fit is still at work when its run is killed.
    new.configure(fit={"iterations": 20_000})
    with new.start(f"results/{target}") as killed:
        assert any(re.match(r"\d+ of \d+: fit ", line) for line in killed.stdout)
        orphan = job_of(killed)
        orphan.suspend()
        killed.kill()
    new.configure(fit={"iterations": 20})
    # The next run deletes this log.
    with (new.results / "logs/fit/1mm/r01.log").open(encoding="utf-8") as log:
        assert new.snakemake(f"results/{target}").status == 0
        orphan.resume()
        orphan.wait()
        assert "was killed, and process" in log.read()
    assert (new.results / target).read_bytes() == (finished.results / target).read_bytes()


def test_ctrl_c_ends_a_run_without_a_traceback_of_any_job(new):
    logs = new.results / "logs/preprocess"
    with new.start(*TABLES, cores=2) as process:
        for line in process.stdout:
            # A job imports its modules right after its log has been opened. Where this test is slow
            # to read, the first job may be over; then a later one is interrupted.
            if re.match(r"\d+ of ", line):
                while process.poll() is None and not any(logs.rglob("*.log")):
                    time.sleep(0.001)
                os.killpg(process.pid, signal.SIGINT)
    assert process.returncode != 0
    told = [path.read_text(encoding="utf-8") for path in logs.rglob("*.log")]
    assert told
    assert "Traceback" not in "".join(told)


@pytest.fixture
def on_small_disk(tmp_path):
    """Return a project whose results lie on a disk of 1.7 MB, which only root may mount."""
    recordings = ["0mm/r01", "3mm/r01", "3mm/r02"]
    project = Project.create(tmp_path / "project", recordings, particles=9, iterations=9)
    # Wide matrices: with the usual ones, the logs would fill so small a disk first.
    project.configure(preprocessing={"length": 20_000})
    project.results.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1700k", "tmpfs", project.results]
    done = subprocess.run(mount, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"mounting a small disk is not allowed here: {done.stderr.strip()}")
    yield project
    subprocess.run(["umount", "--lazy", project.results], check=True)


def test_a_full_disk_is_named_and_the_run_goes_on_when_there_is_room(on_small_disk):
    project = on_small_disk
    run = project.snakemake("results/templates.npz")
    assert run.status != 0
    told = r"error: results/[\w/.-]+: No space left on device; free some space and run again"
    assert re.search(told, run.output)
    assert "run the same command again: finished results are kept" in run.output
    before, done = project.result_bytes(), finished_jobs(project)
    assert done
    subprocess.run(["mount", "-o", "remount,size=50m", project.results], check=True)
    rest = project.snakemake("results/templates.npz")
    assert rest.status == 0, rest.output
    assert not set(done) & set(JOB.findall(rest.output)), "a finished job was done again"
    after = project.result_bytes()
    whole = [name for name in before if not name.endswith(UNFINISHED)]
    assert [name for name in whole if after[name] != before[name]] == []
