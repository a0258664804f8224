"""Version and commit of the project are right wherever it was unpacked."""

import shutil
import subprocess
from dataclasses import replace
from unittest.mock import Mock

import pytest

from capsule.engine.project import ProjectState, read_project_state
from support.command import output_of
from support.marks import needs_programs
from support.project import ROOT

needs_git = needs_programs("git", packages="git")


def git(folder, *arguments):
    name = ["-c", "user.name=Test", "-c", "user.email=test@localhost"]
    return output_of("git", *name, *arguments, cwd=folder).strip()


def commit(folder):
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "--message", "all")
    return git(folder, "rev-parse", "HEAD")


@pytest.fixture
def clone(tmp_path):
    """Return the folder of a small project in a repository without a commit."""
    folder = tmp_path / "project"
    (folder / "workflow").mkdir(parents=True)
    (folder / "workflow/code.py").write_text("x = 1\n", encoding="utf-8")
    (folder / "pyproject.toml").write_text('[project]\nversion = "1.2.3"\n', encoding="utf-8")
    git(folder, "init", "--quiet")
    return folder


@needs_git
def test_a_clone_tells_version_commit_and_whether_its_files_are_changed(
    clone, monkeypatch, tmp_path
):
    state = ProjectState("1.2.3", commit(clone), False)
    (clone / "r01.csv").write_text("0,1\n", encoding="utf-8")
    assert read_project_state(clone) == state, "a new recording changes no file of the project"
    (clone / "workflow/code.py").write_text("x = 2\n", encoding="utf-8")
    # Variables of a hook lead nowhere else.
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "elsewhere"))
    assert read_project_state(clone) == replace(state, modified=True)


@needs_git
@pytest.mark.parametrize("mishap", ["in another repository", "git is missing", "git is late"])
def test_where_git_does_not_tell_there_is_no_commit(clone, monkeypatch, mishap):
    commit(clone)
    folder, version = clone, "1.2.3"
    if mishap == "in another repository":
        folder, version = clone / "workflow", None
    elif mishap == "git is missing":
        monkeypatch.setenv("PATH", str(clone))
    else:
        monkeypatch.setattr(subprocess, "run", Mock(side_effect=subprocess.TimeoutExpired("", 20)))
    assert read_project_state(folder) == ProjectState(version, None, False)


@needs_git
def test_an_archive_that_git_made_tells_its_commit(clone, tmp_path):
    for name in (".git_archival.txt", ".gitattributes"):
        shutil.copy2(ROOT / name, clone / name)
    made = commit(clone)
    git(clone, "archive", "--output", tmp_path / "archive.zip", "HEAD")
    shutil.unpack_archive(tmp_path / "archive.zip", tmp_path / "unpacked")
    assert read_project_state(tmp_path / "unpacked") == ProjectState("1.2.3", made, False)


def test_the_project_is_named_by_its_version_and_commit():
    named = "origami-capsule 1.2.0, commit 0123456789ab (modified)"
    assert ProjectState("1.2.0", "0123456789abcdef", True).text() == named
    assert ProjectState(None, None, False).text() == "origami-capsule, version not known"
