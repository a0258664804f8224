"""How a script or a command ends after an error."""

import errno
import os
import sys
from unittest.mock import Mock

import pytest

from capsule.engine import jobs
from capsule.errors import CapsuleError
from capsule.store import files


@pytest.mark.parametrize(
    ("raised", "code", "printed"),
    [
        (KeyboardInterrupt(), 130, ""),
        (CapsuleError("raw/3mm/r01.csv: say why"), 1, "error: raw/3mm/r01.csv: say why\n"),
        # Python prints the text of an exit as a line, and ends with status 1.
        (FileNotFoundError(2, "No such file", "none.csv"), "error: none.csv: No such file", ""),
        # A program that reads no more, such as `head`, is no error to tell of.
        (BrokenPipeError(), 141, ""),
    ],
)
def test_an_end_by_an_error_is_one_line_at_most(raised, code, printed, capsys, monkeypatch):
    monkeypatch.setattr(os, "dup2", lambda *_: None)
    monkeypatch.setattr(sys.stdout, "fileno", lambda: 1, raising=False)
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
    assert caught.value.__notes__ == [jobs.FAULT]
    assert "fault of the program" in jobs.FAULT
