"""Read the version of the project and the commit of its code, which the report shows.

Neither is an input of a rule: a commit that does not change the report's inputs does not make the
report again.
"""

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from capsule.engine.project import version_in

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
        Whether files of the clone differ from the commit.
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
    """Read the version from pyproject.toml, and the commit from git.

    The version is None without pyproject.toml; the commit is None without git, and outside a
    clone or an archive of the project itself.
    """
    note = root / ".git_archival.txt"
    # git fills this file in an archive that it makes; in a clone, it holds a format text.
    text = note.read_text(encoding="utf-8") if note.is_file() else ""
    archived = re.fullmatch("node: ([0-9a-f]{40,64})", text.strip())
    # An unpacked copy of the project may lie inside another repository.
    described = archived[1] if archived else _described(root) if (root / ".git").exists() else ""
    commit, _, modified = described.partition("-")
    return ProjectState(version_in(root), commit or None, bool(modified))


def _described(root: Path) -> str:
    """Return the commit of a clone, with ``-modified`` if files differ; empty if git fails."""
    command = ["git", "--git-dir=.git", "--work-tree=.", "--no-optional-locks", "describe"]
    command += ["--always", "--exclude=*", "--abbrev=40", "--dirty=-modified"]
    try:
        return subprocess.run(
            command, cwd=root, capture_output=True, timeout=_PATIENCE_S, check=True, text=True
        ).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""
