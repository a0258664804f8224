"""Read the version of the project and the commit of its code, which the report shows.

Neither is an input of a rule: a commit that does not change the report's inputs does not make the
report again.
"""

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from capsule.engine.project import version_in

# Results depend on these files and on the recordings. Only a change of these files marks the commit
# as modified.
_CODE = ("Snakefile", "config", "profiles", "workflow", "pyproject.toml")
_PATIENCE_S = 20


@dataclass(frozen=True)
class ProjectState:
    """The state of the project that made a page.

    Attributes
    ----------
    version : str or None
        From pyproject.toml; None where it is missing.
    commit : str or None
        Commit of the code, in hexadecimal; None outside a clone.
    modified : bool
        Whether code or configuration differ from the commit.
    """

    version: str | None
    commit: str | None
    modified: bool

    def text(self) -> str:
        """Return the state in words."""
        version = f" {self.version}" if self.version else ", version not known"
        commit = f", commit {self.commit[:12]}" if self.commit else ""
        return f"origami-capsule{version}{commit}{' (modified)' if self.modified else ''}"


def read_project_state(root: Path) -> ProjectState:
    """Read the version from pyproject.toml and the commit from git.

    Parameters
    ----------
    root : Path
        The folder of the project.

    Returns
    -------
    ProjectState
        The version is None without pyproject.toml; the commit is None without git, and outside a
        clone or an archive of the project itself.
    """
    version = version_in(root)
    # The project must be the top folder of the clone: an unpacked archive of the project may lie
    # inside another repository.
    head = _git(root, "rev-parse", "--show-prefix", "--verify", "HEAD")
    if head is None or not head.startswith("\n"):
        return ProjectState(version, _commit_of_archive(root / ".git_archival.txt"), False)
    changes = _git(root, "status", "--porcelain", "--", *_CODE)
    return ProjectState(version, head.strip(), bool(changes))


def _commit_of_archive(note: Path) -> str | None:
    """Return the commit that git has written into an archive that it made of the project."""
    text = note.read_text(encoding="utf-8") if note.is_file() else ""
    commit = text.removeprefix("node:").strip()
    # git fills the note only in an archive. In a clone, it holds a format text, not a commit.
    return commit if re.fullmatch("[0-9a-f]{40,64}", commit) else None


def _git(root: Path, *arguments: str) -> str | None:
    """Return the output of git; None if git is not installed, fails or does not answer."""
    program = shutil.which("git")
    if program is None:
        return None
    # The variables of a hook could lead to another repository. Without optional locks, this call
    # does not disturb another git command.
    environment = {key: text for key, text in os.environ.items() if not key.startswith("GIT_")}
    environment["GIT_OPTIONAL_LOCKS"] = "0"
    try:
        done = subprocess.run(
            [program, *arguments],
            cwd=root,
            env=environment,
            capture_output=True,
            timeout=_PATIENCE_S,
            check=True,
            text=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout
