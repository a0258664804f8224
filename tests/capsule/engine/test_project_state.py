"""Version and commit of the project are right wherever it was unpacked."""

import shutil
import subprocess
from dataclasses import replace

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


@pytest.fixture
def clone(tmp_path):
    """Return the folder of a small project with one commit."""
    folder = tmp_path / "project"
    (folder / "workflow").mkdir(parents=True)
    (folder / "workflow/code.py").write_text("x = 1\n", encoding="utf-8")
    (folder / "pyproject.toml").write_text('[project]\nversion = "1.2.3"\n', encoding="utf-8")
    git(folder, "init", "--quiet")
    commit(folder)
    return folder


@needs_git
def test_a_clone_tells_version_commit_and_whether_its_files_are_changed(
    clone, monkeypatch, tmp_path
):
    (clone / "raw").mkdir()
    (clone / "raw/r01.csv").write_text("0,1\n", encoding="utf-8")
    state = ProjectState("1.2.3", git(clone, "rev-parse", "HEAD"), False)
    assert read_project_state(clone) == state, "a new recording changes no file of the project"
    (clone / "workflow/code.py").write_text("x = 2\n", encoding="utf-8")
    # Variables of a hook lead nowhere else.
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "elsewhere"))
    assert read_project_state(clone) == replace(state, modified=True)


def late(*arguments, **options):
    raise subprocess.TimeoutExpired("git", 20)


@needs_git
@pytest.mark.parametrize("mishap", ["in another repository", "git is missing", "git is late"])
def test_where_git_does_not_tell_there_is_no_commit(clone, monkeypatch, mishap):
    folder = clone / "workflow" if mishap == "in another repository" else clone
    if mishap == "git is missing":
        monkeypatch.setenv("PATH", str(clone))
    elif mishap == "git is late":
        monkeypatch.setattr(subprocess, "run", late)
    version = "1.2.3" if folder is clone else None
    assert read_project_state(folder) == ProjectState(version, None, False)


@needs_git
def test_an_archive_that_git_made_tells_its_commit(clone, tmp_path):
    for name in (".git_archival.txt", ".gitattributes"):
        shutil.copy2(ROOT / name, clone / name)
    commit(clone)
    unpacked = tmp_path / "unpacked"
    git(clone, "archive", "--output", tmp_path / "archive.zip", "HEAD")
    shutil.unpack_archive(tmp_path / "archive.zip", unpacked)
    state = read_project_state(unpacked)
    assert (state.commit, state.modified) == (git(clone, "rev-parse", "HEAD"), False)


def test_the_project_is_named_by_its_version_and_commit():
    named = "origami-capsule 1.2.0, commit 0123456789ab (modified)"
    assert ProjectState("1.2.0", "0123456789abcdef", True).text() == named
    assert ProjectState(None, None, False).text() == "origami-capsule, version not known"
