"""The folder of the project: its files, and the version and the commit of its code.

Version and commit are no inputs of a rule: a commit that does not change the report's inputs does
not make the report again.
"""

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from capsule.errors import CapsuleError

PACKAGE = Path(__file__).resolve().parents[1]
# An installed library has the project's files in this folder beside the package.
_INSTALLED = PACKAGE.parent / "capsule_project"
PROJECT = PACKAGE.parents[2] if PACKAGE.parent.name == "scripts" else _INSTALLED

CONFIG = PROJECT / "config"
SCHEMAS = PROJECT / "workflow" / "schemas"
# The taught scorer's weights that ship with the project.
WEIGHTS = PROJECT / "workflow" / "weights" / "scorer.npz"
# The configuration of a folder of recordings; a folder without one has that of the project.
OWN_CONFIG = Path("config", "config.yaml")
# The name of the package where it is installed.
DISTRIBUTION = "origami-capsule"
# Where `capsule record` keeps a log of each recording.
RECORD_LOGS = Path("logs", "acquisition")
# How long git may take.
_PATIENCE_S = 20


def config_file() -> Path:
    """Return the configuration of the working directory; if it has none, the project's."""
    return OWN_CONFIG if OWN_CONFIG.is_file() else CONFIG / "config.yaml"


def require_project() -> None:
    """Raise an error if the library was installed without the project's files."""
    if not CONFIG.is_dir():
        raise CapsuleError(
            f"the folder {PROJECT} is missing beside the package capsule, so the library cannot "
            "read from disk; install the project again, in its folder: pip install -e ."
        )


def version_in(folder: Path) -> str | None:
    """Return the version that the pyproject.toml of a folder names; None without that file."""
    import tomllib  # only if it is used: each job imports this module

    path = folder / "pyproject.toml"
    if not path.is_file():
        return None
    version: str = tomllib.loads(path.read_text(encoding="utf-8"))["project"]["version"]
    return version


def project_version() -> str:
    """Return the version of this code: that of its folder, or of the installed package."""
    from importlib import metadata  # only if it is used: each job imports this module

    return version_in(PROJECT) or metadata.version(DISTRIBUTION)


def how_to_install(extra: str) -> str:
    """Return the line that installs the packages of an extra, with any folder to type it in."""
    if (PROJECT / "pyproject.toml").is_file():
        return f'in {PROJECT}: pip install -e ".[{extra}]"'
    # An installed copy of the project cannot be installed from, and no index has the project.
    from importlib import metadata

    needed = [text.partition(";") for text in metadata.requires(DISTRIBUTION) or ()]
    named = [f'"{text.strip()}"' for text, _, marker in needed if f"'{extra}'" in marker]
    return f"pip install {' '.join(named)}"


def not_installed(needs: str, extra: str) -> CapsuleError:
    """Return the error that a package is missing, with the line that installs it from an extra.

    `needs` names what needs it, such as ``the report needs Snakemake``.
    """
    return CapsuleError(f"{needs}, which is not installed; run {how_to_install(extra)}")


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
