"""Make all results again in a temporary folder, and name each one on disk that differs."""

import argparse
import filecmp
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from capsule.commands.report import (
    add_cores,
    call_workflow,
    check_workflow,
    snakemake_command,
)
from capsule.engine.project import OWN_CONFIG
from capsule.errors import CapsuleError
from capsule.store.results import OfArchive

# Logs hold what a job printed; print/ is made on request; the page holds its date and the commit.
_NOT_COMPARED = (OfArchive.LOGS, "run.txt", "print", OfArchive.REPORT)
# Snakemake's line for a job of a dry run.
_JOB = re.compile(r"Job \d+: ")
# Names that are printed of one kind.
_MOST = 20


@dataclass(frozen=True)
class Comparison:
    """The results on disk beside the same results made again.

    Attributes
    ----------
    waiting : str
        The first job that Snakemake would run, in its words; empty if there is nothing to be done.
    same : int
        Number of files that are equal to the bit.
    different, missing, left_over : list of str
        Files whose content differs; that are missing on disk; and that were not made again.
    """

    waiting: str
    same: int
    different: list[str]
    missing: list[str]
    left_over: list[str]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = "exit status: 0 all results are the same, 1 some differ"
    add_cores(parser)


def main(arguments: argparse.Namespace) -> int:
    """Compare all results, and print what differs; return 0 only if all are equal."""
    found = verify(Path(), arguments.cores)
    if found.waiting:
        print(f"the results are not up to date, so differences are expected: {found.waiting}")
    print(f"{found.same} results are the same as when made again; the page is not compared")
    _tell(found.different, "differs")
    _tell(found.missing, "is missing")
    _tell(found.left_over, "is of a recording or a batch that is gone")
    differs = bool(found.different or found.missing)
    if differs:
        print("to make a result again, delete it: snakemake -c2 makes all that is missing")
    return int(differs)


def _tell(names: list[str], what: str) -> None:
    """Print the first files of a list, and the number of the others."""
    for name in names[:_MOST]:
        print(f"  {what}: results/{name}")
    if len(names) > _MOST:
        print(f"  ... and {len(names) - _MOST} more")


def verify(folder: Path, cores: str) -> Comparison:
    """Make all results again in a temporary folder, and compare them with those in a folder.

    Parameters
    ----------
    folder : Path
        The folder with raw/, results/ and perhaps config/ and sessions/.
    cores : str
        Number of jobs that run at the same time, or ``all``.

    Raises
    ------
    CapsuleError
        There are no results, or they cannot be made again.
    """
    check_workflow(folder)
    results = folder / "results"
    if not results.is_dir() or not any(results.iterdir()):
        raise CapsuleError(f"{results} does not exist; make it first: snakemake -c2")
    waiting = _what_waits(folder)
    with tempfile.TemporaryDirectory(prefix="capsule-verify-") as name:
        again = Path(name)
        for part in ("raw", "sessions"):
            if (folder / part).is_dir():
                _link_or_copy(folder / part, again / part)
        (again / OWN_CONFIG).parent.mkdir()
        shutil.copyfile(folder / OWN_CONFIG, again / OWN_CONFIG)
        if call_workflow(again, [f"--cores={cores}", "--quiet", "all"]):
            raise CapsuleError("the results cannot be made again; see the messages above")
        return compare(results, again / "results", waiting)


def compare(before: Path, again: Path, waiting: str) -> Comparison:
    """Compare two folders of results, file by file; `waiting` is as in `Comparison`."""
    names, made = _files_of(before), _files_of(again)
    common = sorted(names & made)
    different = [
        name for name in common if not filecmp.cmp(before / name, again / name, shallow=False)
    ]
    return Comparison(
        waiting, len(common) - len(different), different, sorted(made - names), sorted(names - made)
    )


def _what_waits(folder: Path) -> str:
    """Return why Snakemake would run jobs, in one line; empty if there is nothing to be done."""
    command = snakemake_command(folder, ["--dry-run", f"results/{OfArchive.REPORT}"])
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    text = done.stderr + done.stdout
    if done.returncode:
        # Snakemake adds the place in its file, in a line that is indented.
        return [line for line in text.splitlines() if line.strip() and line[0] != " "][-1]
    if "Nothing to be done" in text:
        return ""
    return next(filter(_JOB.match, text.splitlines()), "snakemake -n lists what waits")


def _link_or_copy(source: Path, target: Path) -> None:
    try:
        target.symlink_to(source.resolve(), target_is_directory=True)
    except OSError:  # Windows allows links to administrators only
        shutil.copytree(source, target)


def _files_of(folder: Path) -> set[str]:
    names = {
        os.path.relpath(path, folder).replace(os.sep, "/")
        for path in folder.rglob("*")
        if path.is_file()
    }
    return {
        name
        for name in names
        if name.partition("/")[0] not in _NOT_COMPARED and not Path(name).name.startswith(".")
    }
