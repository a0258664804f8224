"""Which state of the project makes a page: its version, and the commit of its code.

Both are read when the page is made, and are no input of any rule: a commit that changes nothing
the page depends on makes no page anew.
"""

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

from capsule.page.provenance import ProjectState

# What results come from, beside recordings: only these can make a commit modified.
_CODE = ("Snakefile", "config", "profiles", "workflow", "pyproject.toml")
_PATIENCE_S = 20


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
    path = root / "pyproject.toml"
    version = None
    if path.is_file():
        version = tomllib.loads(path.read_text(encoding="utf-8"))["project"]["version"]
    # The folder of the project must be that of the clone: an unpacked archive of the project may
    # lie in somebody else's repository.
    head = _git(root, "rev-parse", "--show-prefix", "--verify", "HEAD")
    if head is None or not head.startswith("\n"):
        return ProjectState(version, _commit_of_archive(root / ".git_archival.txt"), False)
    changes = _git(root, "status", "--porcelain", "--", *_CODE)
    return ProjectState(version, head.strip(), bool(changes))


def _commit_of_archive(note: Path) -> str | None:
    """Return the commit that git has written into an archive that it made of the project."""
    text = note.read_text(encoding="utf-8") if note.is_file() else ""
    commit = text.removeprefix("node:").strip()
    # In a clone, and in a copy of one, the note is still as it was written.
    return commit if re.fullmatch("[0-9a-f]{40,64}", commit) else None


def _git(root: Path, *arguments: str) -> str | None:
    """Return what git says; None where it is not installed, refuses or does not answer."""
    program = shutil.which("git")
    if program is None:
        return None
    # A hook's variables would lead to another repository; no lock disturbs a git at work.
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
