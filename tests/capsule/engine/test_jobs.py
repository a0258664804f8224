"""One run at a time uses a folder; a job of a killed run or of changed code writes nothing.

And how a script or a command ends after an error.
"""

import errno
import os
import re
import shutil
import sys
from pathlib import Path
from unittest.mock import Mock

import pytest

from capsule.engine import jobs
from capsule.engine.jobs import RUN_LOCK, STATES, hold_run_lock, states_of
from capsule.errors import CapsuleError
from capsule.store import files


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Work in a folder that no run has used, as no job of a run."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_second_run_is_refused_with_the_name_of_the_first_until_that_ends():
    with hold_run_lock():
        name = RUN_LOCK.read_text().strip()
        assert name.startswith(f"process {os.getpid()} on ")
        with pytest.raises(CapsuleError, match=rf"folder \({name}\), .*; wait until it has ended$"):
            hold_run_lock()
        # The name of the first is kept. A lock is of one folder, and ends with its file.
        assert RUN_LOCK.read_text().strip() == name
        for _ in range(2):
            hold_run_lock(Path("elsewhere/run.lock")).close()
    with hold_run_lock():
        assert RUN_LOCK.read_text().strip() not in ("", name)


def test_without_locks_on_the_file_system_a_run_begins_with_a_warning(monkeypatch, capsys):
    monkeypatch.setattr(jobs, "lock_file", Mock(side_effect=OSError(95, "Operation not supported")))
    with hold_run_lock():
        told = "this file system does not support locks (Operation not supported)"
        assert told in capsys.readouterr().err


def test_a_job_whose_run_was_replaced_writes_nothing(folder, monkeypatch):
    def write(run):
        monkeypatch.setenv("CAPSULE_RUN", run)
        files.write_json(folder / "made.json", {"by": run})

    # As on a node of a cluster that sees the file of the lock late.
    write("process 1 on elsewhere")
    with hold_run_lock():
        replaced = os.environ["CAPSULE_RUN"]
    with hold_run_lock():
        current = os.environ["CAPSULE_RUN"]
        told = f"the run of this job ({replaced}) was killed, and {current} has begun since"
        with pytest.raises(CapsuleError, match=re.escape(told)):
            write(replaced)
        assert files.read_json(folder / "made.json") == {"by": "process 1 on elsewhere"}
        # `capsule export` and others write while a run goes on.
        for run in (current, ""):
            write(run)
    assert {path.name for path in folder.glob("*.*")} == {".snakemake", "made.json"}


def put_back(path):
    """Change a file, and put it back with its dates."""
    shutil.copy2(path, kept := path.with_name("kept"))
    path.write_text("x = 2\n")
    kept.replace(path)


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("change", [lambda path: path.write_text("x\n"), put_back, Path.unlink])
def test_a_job_whose_code_was_changed_writes_nothing(folder, change, place, monkeypatch):
    # A script and a table that it reads, whose states a run has noted.
    code = [folder / "fit.py", folder / "table.yaml"]
    for path in code:
        path.write_text("x = 1\n")
    files.write_json(STATES, {str(code[0]): states_of(code)})

    def write(script="fit.py", name="this run"):
        monkeypatch.setattr(sys, "argv", [script])
        monkeypatch.setenv("CAPSULE_RUN", name)
        files.write_json(Path(f"{script}{name}.json"), {})

    write()
    (made := Path("fit.pythis run.json")).unlink()
    change(code[place])
    with pytest.raises(CapsuleError, match=f"{code[place].name} has changed since the run began"):
        write()
    assert not made.exists()
    # Another job, and a command that is none, as `capsule export`.
    write("describe.py")
    write(name="")


def test_an_end_by_an_error_is_one_line_at_most(capsys, monkeypatch):
    monkeypatch.setattr(os, "dup2", lambda *_: None)
    monkeypatch.setattr(sys.stdout, "fileno", lambda: 1, raising=False)
    for raised, code, printed in (
        (KeyboardInterrupt(), 130, ""),
        (CapsuleError("raw/3mm/r01.csv: say why"), 1, "error: raw/3mm/r01.csv: say why\n"),
        # Python prints the text of an exit as a line, and ends with status 1.
        (FileNotFoundError(2, "No such file", "none.csv"), "error: none.csv: No such file", ""),
        # A program that reads no more, such as `head`, is no error to tell of.
        (BrokenPipeError(), 141, ""),
    ):
        with pytest.raises(SystemExit) as stop:
            jobs.run(Mock(side_effect=raised))
        assert (stop.value.code, capsys.readouterr().err) == (code, printed)


def test_a_full_disk_names_the_file_and_the_remedy_and_leaves_no_file(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", Mock(side_effect=OSError(errno.ENOSPC, "No space left")))
    target = tmp_path / "table.csv"
    with pytest.raises(SystemExit) as stop:
        jobs.run(lambda: files.write_json(target, {}))
    assert stop.value.code.startswith(f"error: {target}: No space left; free some space and run")
    assert list(tmp_path.iterdir()) == []


def test_a_fault_of_the_program_keeps_its_traceback_and_says_that_it_is_one():
    with pytest.raises(AttributeError, match="no attribute 'size'") as caught:
        jobs.run(lambda: {}.size)
    assert "fault of the program" in caught.value.__notes__[0]
