"""The folder of the project: its configuration, schemas, weights and firmware."""

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
