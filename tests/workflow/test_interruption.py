"""After a kill, the same command continues the run. Full disks and orphans: capsule/engine."""

import os
import re
import signal
import sys
import time

import pytest

from capsule.store.files import UNFINISHED
from support.project import JOB

pytestmark = [
    pytest.mark.workflow,
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="Windows has no process groups to kill"),
]

TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
# So many jobs have begun when a run is killed; the one before may have ended at the same time.
KILLED_AT = 6


def half_written(project, expected):
    """Return the results that have their final name, but another content."""
    made = project.result_bytes().items()
    whole = {name: content for name, content in made if not name.endswith(UNFINISHED)}
    return [name for name, content in whole.items() if content != expected[name]]


def test_after_a_kill_the_plain_command_goes_on(new, finished):
    """`try_mishaps.py` kills hundreds of runs, at any moment."""
    expected = finished.result_bytes()
    with new.start(*TABLES, cores=2) as killed:
        for line in killed.stdout:
            if line.startswith(f"{KILLED_AT} of "):
                os.killpg(killed.pid, signal.SIGKILL)
    assert killed.returncode == -signal.SIGKILL
    (log,) = (new.folder / ".snakemake/log").glob("*.log")
    text = log.read_text(encoding="utf-8")
    by_number = dict(re.findall(r"^Job (\d+): (.+)", text, re.MULTILINE))
    done = {by_number[number] for number in re.findall(r"^Finished jobid: (\d+)", text, re.M)}
    assert done
    assert half_written(new, expected) == []
    run = new.snakemake(*TABLES)
    assert run.status == 0, run.output
    assert not done & set(JOB.findall(run.output)), "a finished job was done again"
    assert half_written(new, expected) == []
    assert {"detections.csv", "templates.npz"} <= new.result_bytes().keys()
    assert not list(new.results.rglob(f"*{UNFINISHED}"))


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
