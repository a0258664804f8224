"""Calls Snakemake as a user would, and says what is missing where it cannot."""

import importlib.util
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from capsule.errors import CapsuleError

PROJECT = Path(__file__).resolve().parents[3]
CONFIG = Path("config", "config.yaml")
INTERRUPTED = 130


def data_folder() -> Path:
    """Return the folder whose raw/ and results/ are meant.

    That is the working directory, where it holds raw/ and config/config.yaml; otherwise the folder
    of the project. Where the project was installed as a package, that holds no raw/ and should
    never get one: then it is the working directory again.
    """
    here = Path.cwd()
    whole = (here / "raw").is_dir() and (here / CONFIG).is_file()
    return here if whole or not (PROJECT / "raw").is_dir() else PROJECT


def data_config() -> Path:
    """Return the configuration of the data's folder, or the project's where it has none."""
    path = data_folder() / CONFIG
    return path if path.is_file() else PROJECT / CONFIG


def check_workflow(folder: Path) -> None:
    """Make sure that the workflow can run in a folder.

    Raises
    ------
    CapsuleError
        Snakemake or a part of the project is missing; the text says which, and the remedy.
    """
    if importlib.util.find_spec("snakemake") is None:
        raise CapsuleError(
            "the report needs Snakemake, which is not installed; install it: "
            'pip install "origami-capsule[workflow]"'
        )
    if not (PROJECT / "Snakefile").is_file():
        raise CapsuleError(
            f"{PROJECT} holds no Snakefile, so it is no whole project; get the project's folder "
            "whole, and run its own workflow/scripts/capsule_command.py"
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
        Holds raw/ and config/config.yaml, and will hold results/.
    arguments : sequence of str
        Targets and options.

    Raises
    ------
    CapsuleError
        As `check_workflow`.
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
                interrupted = True  # Snakemake was told as well, and ends its jobs first
