"""Make results/report.html from the recordings in raw/: Snakemake runs the steps still missing."""

import argparse
import importlib.util
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from capsule.engine.project import OWN_CONFIG, PROJECT, not_installed
from capsule.errors import CapsuleError
from capsule.store.results import OfArchive

INTERRUPTED = 130

DETAILS = """
It works in the current folder, which holds raw/ and config/config.yaml. Options after two dashes go
to Snakemake unchanged:

  capsule report -- -n            show the steps that would run, and why
  capsule report -- --forceall    run all steps again
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = DETAILS
    parser.usage = "%(prog)s [-h] [--cores N] [-- SNAKEMAKE_OPTION ...]"
    cores = "number of jobs that run at the same time; all: one per core (default: 2)"
    parser.add_argument("--cores", default="2", metavar="N", help=cores)
    parser.add_argument("options", nargs="*", help=argparse.SUPPRESS)


def main(arguments: argparse.Namespace) -> int:
    """Make the report; return Snakemake's exit status."""
    wanted = [f"--cores={arguments.cores}", f"results/{OfArchive.REPORT}", *arguments.options]
    return call_workflow(Path(), wanted)


def check_workflow(folder: Path) -> None:
    """Raise an error if the workflow cannot run in a folder.

    Raises
    ------
    CapsuleError
        Snakemake or a part of the project is missing; the message names it and the remedy.
    """
    if importlib.util.find_spec("snakemake") is None:
        raise not_installed("the report needs Snakemake", "workflow")
    if not (PROJECT / "Snakefile").is_file():
        raise CapsuleError(
            f"{PROJECT} holds no Snakefile, so the project is incomplete; get the complete folder "
            "of the project, and install it there: pip install -e ."
        )
    for part in (Path("raw"), OWN_CONFIG):
        if not (folder / part).exists():
            raise CapsuleError(
                f"{folder.resolve()} holds no {part}; run the command in a folder that holds your "
                f"recordings in raw/ and the settings in {OWN_CONFIG}. To make one: "
                "capsule new NAME"
            )


def snakemake_command(folder: Path, arguments: Sequence[str]) -> list[str]:
    """Return the command line of Snakemake for a folder, with the steps of the project."""
    # -P: the folder holds recordings, so a yaml.py in it is none of Python's modules.
    command = [sys.executable, "-P", "-m", "snakemake", *arguments]
    if not folder.samefile(PROJECT):
        command += ["--snakefile", str(PROJECT / "Snakefile")]
    return command


def call_workflow(folder: Path, arguments: Sequence[str]) -> int:
    """Run Snakemake in the folder of raw/; return its exit status, `INTERRUPTED` after Ctrl-C."""
    check_workflow(folder)
    interrupted = False
    with subprocess.Popen(snakemake_command(folder, arguments), cwd=folder) as process:
        while True:
            try:
                status = process.wait()
                return INTERRUPTED if interrupted else status
            except KeyboardInterrupt:
                interrupted = True  # Snakemake receives Ctrl-C too, and ends its jobs first
