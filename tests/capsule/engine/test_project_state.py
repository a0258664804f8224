"""Version and commit of the project are right wherever it was unpacked."""

import shutil
import subprocess
from dataclasses import replace
from unittest.mock import Mock

from capsule.engine.project import ProjectState, read_project_state
from support.command import output_of
from support.marks import needs_programs
from support.project import ROOT

pytestmark = needs_programs("git", packages="git")


def git(folder, words):
    name = "-c user.name=Test -c user.email=test@localhost"
    return output_of("git", *f"{name} {words}".split(), cwd=folder).strip()


def test_a_clone_and_its_archive_tell_version_commit_and_changed_files(tmp_path, monkeypatch):
    (code := (clone := tmp_path / "project") / "workflow/code.py").parent.mkdir(parents=True)
    code.touch()
    (clone / "pyproject.toml").write_text('[project]\nversion = "1.2.3"\n')
    for name in (".git_archival.txt", ".gitattributes"):
        shutil.copy2(ROOT / name, clone / name)
    for words in ("init --quiet", "add .", "commit --quiet --message all"):
        git(clone, words)
    state = ProjectState("1.2.3", git(clone, "rev-parse HEAD"), False)
    (clone / "r01.csv").touch()
    assert read_project_state(clone) == state, "a new recording changes no file of the project"
    git(clone, "archive --output ../archive.zip HEAD")
    shutil.unpack_archive(tmp_path / "archive.zip", tmp_path / "unpacked")
    assert read_project_state(tmp_path / "unpacked") == state
    code.write_text("x = 2\n")
    # Variables of a hook lead nowhere else.
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "elsewhere"))
    assert read_project_state(clone) == (changed := replace(state, modified=True))
    assert changed.text() == f"origami-capsule 1.2.3, commit {state.commit[:12]} (modified)"
    # In another repository there is no commit; then git is missing, and late.
    nothing = read_project_state(clone / "workflow")
    assert nothing == ProjectState(None, None, False)
    assert nothing.text() == "origami-capsule, version not known"
    for fault in (FileNotFoundError(2, "No such file", "git"), subprocess.TimeoutExpired("", 20)):
        monkeypatch.setattr(subprocess, "run", Mock(side_effect=fault))
        assert read_project_state(clone) == ProjectState("1.2.3", None, False)
