"""Ask Slurm for the jobs that a killed run has left, and explain how a job of Slurm has ended.

The Snakefile uses this module, so it imports only fast modules.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

from capsule.errors import CapsuleError

# Snakemake's plugin for Slurm keeps its logs here, so the folder exists where jobs were submitted.
LOGS = Path(".snakemake/slurm_logs")
# The plugin names all jobs of a run by one random number (UUID), sometimes behind a prefix.
_NAME = re.compile(r"\S*[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
_SECONDS = 60
# Lines that Slurm writes into the log of a job that it ends, each with the remedy.
_ENDS = (
    (
        re.compile(r"JOB (\d+) ON \S+ CANCELLED AT \S+ DUE TO TIME LIMIT"),
        "at its time limit; allow more minutes, "
        "for example --default-resources mem_mb=500 runtime=120",
    ),
    (
        re.compile(r"oom.kill event\(s\) in (?:StepId=|step )(\d+)"),
        "because it needed more memory than it had asked for; allow more megabytes, "
        "for example --default-resources mem_mb=2000 runtime=30",
    ),
)


def refuse_unfinished_jobs(folder: Path) -> None:
    """Raise an error if Slurm still runs jobs of a killed run of a folder; see `unfinished_jobs`.

    Raises
    ------
    CapsuleError
        The message names the jobs, and how to end them.
    """
    if jobs := unfinished_jobs(folder):
        raise CapsuleError(
            f"Slurm jobs of a run that was killed still use this folder ({', '.join(jobs)}); wait "
            f"until they have ended, or end them: scancel {' '.join(jobs)}"
        )


def unfinished_jobs(folder: Path) -> tuple[str, ...]:
    """Return the Slurm jobs that Snakemake has submitted in a folder and that have not ended.

    Parameters
    ----------
    folder : Path
        The working directory of the runs.

    Returns
    -------
    tuple of str
        The numbers of the jobs; empty if nothing was submitted from this folder, or if Slurm does
        not answer, which is printed.
    """
    squeue = shutil.which("squeue")
    if squeue is None or not (folder / LOGS).is_dir():
        return ()
    command = [squeue, "--me", "--noheader", "--sort=i", "--format=%A %j %Z"]
    try:
        answer = subprocess.run(
            command, capture_output=True, text=True, timeout=_SECONDS, check=True
        ).stdout
    except (OSError, subprocess.SubprocessError) as error:
        # The last line of squeue says why; those above it, what it has tried.
        reason = str(getattr(error, "stderr", None) or error).strip().splitlines()[-1]
        print(
            f"warning: squeue does not answer ({reason}); make sure that no Slurm job of an "
            "earlier run still uses this folder",
            file=sys.stderr,
        )
        return ()
    return jobs_in_answer(answer, folder)


def jobs_in_answer(answer: str, folder: Path) -> tuple[str, ...]:
    """Return the numbers of Snakemake's jobs in a folder, from lines of number, name and folder."""
    rows = [line.split(maxsplit=2) for line in answer.splitlines()]
    return tuple(
        dict.fromkeys(
            row[0]
            for row in rows
            if len(row) == 3
            and _NAME.fullmatch(row[1])
            and Path(row[2]).resolve() == folder.resolve()
        )
    )


def explain_ends(folder: Path, since: float) -> list[str]:
    """Return a line for each job that Slurm has ended, with the remedy.

    Parameters
    ----------
    folder : Path
        The working directory of the run.
    since : float
        Time stamp of the start of the run; older logs are of earlier runs.
    """
    logs = sorted((folder / LOGS).rglob("*.log"))
    return [
        f"Slurm has ended job {job} ({path.parent.relative_to(folder / LOGS)}) {remedy}. "
        "Finished results are kept."
        for path in logs
        if path.stat().st_mtime >= since
        for job, remedy in ends_in_log(path.read_text(errors="replace"))
    ]


def ends_in_log(text: str) -> list[tuple[str, str]]:
    """Return the number of the job and the remedy for each way in which Slurm has ended it."""
    matches = ((pattern.search(text), remedy) for pattern, remedy in _ENDS)
    return [(match[1], remedy) for match, remedy in matches if match]
