"""A job whose code has changed since the run began writes nothing."""

import shutil
import sys
from pathlib import Path

import pytest

from capsule.engine.unchanged import STATES, states_of
from capsule.errors import CapsuleError
from capsule.store import files


@pytest.fixture
def code(tmp_path, monkeypatch):
    """Return a script and a table that it reads, whose states a run has noted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CAPSULE_RUN", "this run")
    monkeypatch.setattr(sys, "argv", ["workflow/fit.py"])
    paths = [tmp_path / "workflow/fit.py", tmp_path / "workflow/table.yaml"]
    paths[0].parent.mkdir()
    for path in paths:
        path.write_text("x = 1\n")
    files.write_json(STATES, {str(paths[0]): states_of(paths)})
    return paths


def put_back(path):
    """Change a file, and put it back with its dates."""
    kept = path.with_name("kept")
    shutil.copy2(path, kept)
    path.write_text("x = 2\n")
    kept.replace(path)


CHANGES = {
    "content": lambda path: path.write_text("x = 2\n"),
    "put back": put_back,
    "gone": Path.unlink,
}


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("change", CHANGES)
def test_a_job_whose_code_was_changed_writes_nothing(code, change, place):
    CHANGES[change](code[place])
    with pytest.raises(CapsuleError, match=f"{code[place].name} has changed since the run began"):
        files.write_json(Path("fit.json"), {})
    assert not Path("fit.json").exists()


def test_other_code_and_other_programs_do_not_matter(code, monkeypatch):
    code[1].with_name("other.yaml").write_text("x = 1\n")
    files.write_json(Path("fit.json"), {})
    CHANGES["content"](code[1])
    monkeypatch.setattr(sys, "argv", ["workflow/describe.py"])
    files.write_json(Path("described.json"), {})
    # A command that is no job, as `capsule export`.
    monkeypatch.setattr(sys, "argv", ["workflow/fit.py"])
    monkeypatch.setenv("CAPSULE_RUN", "")
    files.write_json(Path("other.json"), {})
