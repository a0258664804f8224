"""Only one run at a time uses a folder, and a job of a killed run writes nothing any more."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from capsule.engine import locks
from capsule.engine.locks import RUN_LOCK, hold_run_lock, refuse_replaced_run
from capsule.errors import CapsuleError
from capsule.store import files

SCRIPTS = Path(__file__).parents[3] / "workflow" / "scripts"
# It holds the lock, prints so, and waits.
HOLD = "from capsule.engine.locks import hold_run_lock; held = hold_run_lock(); "
HOLD += "print('held', flush=True); input()"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Work in a folder that no run has used, as no job of a run."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CAPSULE_RUN", "")
    return tmp_path


@pytest.fixture
def other_run(folder):
    """Return another process that holds the lock of the folder."""
    environment = {**os.environ, "PYTHONPATH": str(SCRIPTS)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", HOLD], env=environment, **pipes) as process:
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_a_second_run_is_refused_with_the_name_of_the_first(other_run):
    with pytest.raises(CapsuleError) as caught:
        hold_run_lock()
    assert f"another run uses this folder (process {other_run.pid} on " in str(caught.value)
    assert str(caught.value).endswith("; wait until it has ended")
    # The name of the first is kept.
    assert RUN_LOCK.read_text().startswith(f"process {other_run.pid} on ")


def test_a_lock_is_of_one_folder_and_ends_with_its_file_or_its_killed_process(other_run, tmp_path):
    for _ in range(2):
        hold_run_lock(tmp_path / "elsewhere" / "run.lock").close()
    other_run.kill()
    other_run.wait()
    with hold_run_lock():
        assert RUN_LOCK.read_text().startswith(f"process {os.getpid()} on ")


def test_without_locks_on_the_file_system_a_run_begins_with_a_warning(monkeypatch, capsys):
    def no_locks(descriptor):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(locks, "lock_file", no_locks)
    with hold_run_lock():
        assert "this file system does not support locks (Operation not supported)" in (
            capsys.readouterr().err
        )


def test_a_job_whose_run_was_replaced_writes_nothing(folder, monkeypatch):
    files.write_json(folder / "made.json", {"by": "an earlier run"})
    with hold_run_lock():
        replaced = os.environ["CAPSULE_RUN"]
    with hold_run_lock():
        current = os.environ["CAPSULE_RUN"]
        assert current != replaced
        monkeypatch.setenv("CAPSULE_RUN", replaced)
        with pytest.raises(CapsuleError) as caught:
            files.write_json(folder / "made.json", {"by": "a replaced run"})
        assert str(caught.value) == (
            f"the run of this job ({replaced}) was killed, and {current} has begun since; this job "
            "writes nothing"
        )
        monkeypatch.setenv("CAPSULE_RUN", current)
        files.write_json(folder / "other.json", {})
    assert files.read_json(folder / "made.json") == {"by": "an earlier run"}
    assert sorted(path.name for path in folder.glob("*.json*")) == ["made.json", "other.json"]
    assert not list(folder.glob(f".*{files.UNFINISHED}"))


def test_what_is_no_job_of_a_run_may_write_and_a_job_that_cannot_read_the_lock(monkeypatch):
    # As on a node of a cluster that sees the file late.
    monkeypatch.setenv("CAPSULE_RUN", "process 1 on elsewhere")
    refuse_replaced_run()
    with hold_run_lock():
        # `capsule export` and others write while a run goes on.
        monkeypatch.setenv("CAPSULE_RUN", "")
        refuse_replaced_run()
