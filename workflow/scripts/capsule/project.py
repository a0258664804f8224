"""The folder of the project: its configuration, schemas, weights and firmware."""

from pathlib import Path

from capsule.errors import CapsuleError

_PACKAGE = Path(__file__).resolve().parent
# An installed library has the project's files in this folder beside the package.
_INSTALLED = _PACKAGE.parent / "capsule_project"
PROJECT = _PACKAGE.parents[2] if _PACKAGE.parent.name == "scripts" else _INSTALLED

CONFIG = PROJECT / "config"
SCHEMAS = PROJECT / "workflow" / "schemas"
# The taught scorer's weights that ship with the project.
WEIGHTS = PROJECT / "workflow" / "weights" / "scorer.npz"


def require_project() -> None:
    """Raise an error if the project's files are not there.

    Raises
    ------
    CapsuleError
        The library was installed without them; the message names the folder and the remedy.
    """
    if not CONFIG.is_dir():
        raise CapsuleError(
            f"the folder {PROJECT} is missing beside the package capsule, so the library cannot "
            "read from disk; install the project again: pip install ."
        )
