"""Version and commit of the project are right wherever it was unpacked."""

import shutil
import subprocess

import pytest

from capsule.engine.project_state import ProjectState, read_project_state
from support.marks import needs_programs
from support.project import ROOT

needs_git = needs_programs("git", packages="git")


def git(folder, *arguments):
    name = ["-c", "user.name=Test", "-c", "user.email=test@localhost"]
    done = subprocess.run(
        ["git", *name, *arguments], cwd=folder, check=True, capture_output=True, text=True
    )
    return done.stdout.strip()


@pytest.fixture
def clone(tmp_path):
    """Return the folder of a small project with one commit."""
    folder = tmp_path / "project"
    (folder / "workflow").mkdir(parents=True)
    (folder / "workflow" / "code.py").write_text("x = 1\n", encoding="utf-8")
    (folder / "pyproject.toml").write_text('[project]\nversion = "1.2.3"\n', encoding="utf-8")
    git(folder, "init", "--quiet")
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "--message", "first")
    return folder


def test_without_pyproject_and_git_nothing_is_known(tmp_path, monkeypatch):
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    state = read_project_state(tmp_path)
    assert (state.version, state.commit, state.modified) == (None, None, False)


@needs_git
def test_a_changed_file_makes_a_commit_modified_and_a_new_recording_does_not(clone):
    (clone / "raw").mkdir()
    (clone / "raw" / "r01.csv").write_text("0,1\n", encoding="utf-8")
    commit = git(clone, "rev-parse", "HEAD")
    assert read_project_state(clone) == ProjectState("1.2.3", commit, False)
    (clone / "workflow" / "code.py").write_text("x = 2\n", encoding="utf-8")
    assert read_project_state(clone).modified


@needs_git
def test_a_project_inside_another_repository_has_no_commit(clone):
    inside = clone / "workflow"
    assert read_project_state(inside).commit is None


@needs_git
def test_variables_of_a_hook_lead_nowhere_else(clone, tmp_path, monkeypatch):
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "elsewhere"))
    assert read_project_state(clone).commit is not None


@needs_git
def test_without_git_there_is_no_commit(clone, monkeypatch):
    monkeypatch.setenv("PATH", str(clone))
    state = read_project_state(clone)
    assert (state.version, state.commit) == ("1.2.3", None)


@needs_git
def test_git_that_does_not_answer_is_not_waited_for(clone, monkeypatch):
    def late(*arguments, **options):
        raise subprocess.TimeoutExpired("git", 20)

    monkeypatch.setattr(subprocess, "run", late)
    assert read_project_state(clone).commit is None


@needs_git
def test_an_archive_that_git_made_tells_its_commit(clone, tmp_path):
    for name in (".git_archival.txt", ".gitattributes"):
        shutil.copy2(ROOT / name, clone / name)
    git(clone, "add", ".")
    git(clone, "commit", "--quiet", "--message", "second")
    unpacked = tmp_path / "unpacked"
    git(clone, "archive", "--output", tmp_path / "archive.zip", "HEAD")
    shutil.unpack_archive(tmp_path / "archive.zip", unpacked)
    state = read_project_state(unpacked)
    assert (state.commit, state.modified) == (git(clone, "rev-parse", "HEAD"), False)


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (("1.2.0", "0123456789abcdef", False), "origami-capsule 1.2.0, commit 0123456789ab"),
        (
            ("1.2.0", "0123456789abcdef", True),
            "origami-capsule 1.2.0, commit 0123456789ab (modified)",
        ),
        (("1.2.0", None, False), "origami-capsule 1.2.0"),
        ((None, None, False), "origami-capsule, version not known"),
    ],
)
def test_the_project_is_named_by_its_version_and_commit(state, text):
    assert ProjectState(*state).text() == text
