"""How a script or a command ends after an error."""

import errno
import os

import pytest

from capsule.engine import jobs
from capsule.errors import CapsuleError
from capsule.store import files


def test_a_users_fault_ends_in_one_line(capsys):
    def main():
        raise CapsuleError("raw/3mm/r01.csv: say why")

    with pytest.raises(SystemExit) as stop:
        jobs.run(main)
    assert stop.value.code == 1
    assert capsys.readouterr().err == "error: raw/3mm/r01.csv: say why\n"


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SystemExit) as stop:
        jobs.run(lambda: files.read_csv(tmp_path / "none.csv"))
    assert str(stop.value.code).startswith(f"error: {tmp_path / 'none.csv'}: No such file")


def test_a_full_disk_names_the_file_and_the_remedy(tmp_path, monkeypatch):
    def no_room(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", no_room)
    target = tmp_path / "table.csv"
    with pytest.raises(SystemExit) as stop:
        jobs.run(lambda: files.write_json(target, {}))
    assert stop.value.code == (
        f"error: {target}: No space left on device; free some space and run again: finished "
        "results are kept"
    )
    assert list(tmp_path.iterdir()) == []


def test_a_fault_of_the_program_keeps_its_traceback_and_says_that_it_is_one(tmp_path):
    def main():
        files.write_json(tmp_path / "x.json", {})
        return files.read_or_explain(tmp_path / "x.json", files.read_json).size

    with pytest.raises(AttributeError, match="no attribute 'size'") as caught:
        jobs.run(main)
    assert caught.value.__notes__ == [jobs.FAULT]
    assert "fault of the program" in jobs.FAULT
