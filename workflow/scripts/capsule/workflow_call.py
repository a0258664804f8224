"""Run Snakemake; if that is impossible, raise an error that names what is missing."""

import importlib.util
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from capsule.errors import CapsuleError
from capsule.project import PROJECT

CONFIG = Path("config", "config.yaml")
INTERRUPTED = 130


def data_folder() -> Path:
    """Return the folder that holds raw/ and results/.

    This is the working directory if it holds raw/ and config/config.yaml, and otherwise the folder
    of the project. An installed package has no raw/ and must not get one; then the working
    directory is returned.
    """
    here = Path.cwd()
    whole = (here / "raw").is_dir() and (here / CONFIG).is_file()
    return here if whole or not (PROJECT / "raw").is_dir() else PROJECT


def data_config() -> Path:
    """Return the configuration in the data's folder; if it has none, the project's."""
    path = data_folder() / CONFIG
    return path if path.is_file() else PROJECT / CONFIG


def check_workflow(folder: Path) -> None:
    """Raise an error if the workflow cannot run in a folder.

    Raises
    ------
    CapsuleError
        Snakemake or a part of the project is missing; the message names it and the remedy.
    """
    if importlib.util.find_spec("snakemake") is None:
        raise CapsuleError(
            "the report needs Snakemake, which is not installed; install it: "
            'pip install "origami-capsule[workflow]"'
        )
    if not (PROJECT / "Snakefile").is_file():
        raise CapsuleError(
            f"{PROJECT} holds no Snakefile, so the project is incomplete; get the complete folder "
            "of the project, and run its workflow/scripts/capsule_command.py"
        )
    for part in (Path("raw"), CONFIG):
        if not (folder / part).exists():
            raise CapsuleError(
                f"{folder} holds no {part}; run the command in a folder that holds your recordings "
                f"in raw/ and the settings in {CONFIG} (to begin with, a copy of "
                f"{PROJECT / CONFIG})"
            )


def call_workflow(folder: Path, arguments: Sequence[str]) -> int:
    """Run Snakemake in a folder, and return its exit status; `INTERRUPTED` after Ctrl-C.

    Parameters
    ----------
    folder : Path
        The folder with raw/ and config/config.yaml; results/ is written into it.
    arguments : sequence of str
        Targets and options.

    Raises
    ------
    CapsuleError
        The workflow cannot run in the folder; see `check_workflow`.
    """
    check_workflow(folder)
    command = [sys.executable, "-m", "snakemake", *arguments]
    if not folder.samefile(PROJECT):
        command += ["--snakefile", str(PROJECT / "Snakefile")]
    interrupted = False
    with subprocess.Popen(command, cwd=folder) as process:
        while True:
            try:
                status = process.wait()
                return INTERRUPTED if interrupted else status
            except KeyboardInterrupt:
                interrupted = True  # Snakemake receives Ctrl-C too, and ends its jobs first
