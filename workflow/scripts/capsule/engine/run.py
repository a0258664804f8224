"""Start and end of a run of the workflow: lock, free disk space, Slurm's jobs, and a summary.

A dry run calls nothing here. The Snakefile uses this module, so it imports only fast modules.
"""

import atexit
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from capsule.engine.folder import is_made_from, mark_outdated, sign_results, tidy
from capsule.engine.locks import RUN_LOCK, STATES, State, hold_run_lock
from capsule.errors import CapsuleError, error_line
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.confounded import confounded_keys, in_words
from capsule.kinds import Settings
from capsule.recordings.held_out import unknown_sessions
from capsule.store import files
from capsule.store.batches import Division, batch_size
from capsule.store.results import SURVEY_VALUES, OfArchive, left_over
from capsule.survey.listed import Surveys

# With less free space than this, a run stops before its first job.
_FULL_DISK_BYTES = 1_000_000
# Snakemake's plugin for Slurm keeps its logs here, so the folder exists where jobs were submitted.
LOGS = Path(".snakemake/slurm_logs")
# The plugin names all jobs of a run by one random number (UUID), sometimes behind a prefix.
_NAME = re.compile(r"\S*[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
_SECONDS = 60


@dataclass
class Run:
    """One run of the workflow.

    Attributes
    ----------
    raw, results, sessions : str
        The folders of the recordings, the results and the surveys.
    config : mapping
        The configuration.
    division : Division
        The batches of the archive.
    surveys : Surveys
        The surveys.
    states : mapping
        The state of each file of a script's code when its key was computed, by the script, from
        `capsule.engine.locks.states_of`.
    without_effect : sequence of str
        Lines on the configuration, from `capsule.engine.configuration.without_effect`.
    lock : binary file or None
        The lock of the folder, which ends when this file is closed; None before the start.
    """

    raw: str
    results: str
    sessions: str
    config: Settings
    division: Division
    surveys: Surveys
    states: Mapping[str, Mapping[str, State]] = field(default_factory=dict)
    without_effect: Sequence[str] = ()
    lock: IO[bytes] | None = None

    @property
    def page(self) -> Path:
        """The report."""
        return Path(self.results) / OfArchive.REPORT

    def begin(self) -> None:
        """Take the folder's lock, tidy the results, and mark the report as out of date.

        Raises
        ------
        CapsuleError
            Another run or Slurm's jobs of a killed one use the folder, or the disk is full.
        """
        self.lock = hold_run_lock()
        if jobs := unfinished_jobs(Path.cwd()):
            raise CapsuleError(
                f"Slurm jobs of a run that was killed still use this folder ({', '.join(jobs)}); "
                f"wait until they have ended, or end them: scancel {' '.join(jobs)}"
            )
        tidy(Path(self.results))
        # Snakemake itself can end on a full disk without telling that a run has failed.
        atexit.register(self._explain_full_disk)
        if self._free_bytes() < _FULL_DISK_BYTES:
            raise CapsuleError(
                "no space left on device, nothing was started; free some space and run again"
            )
        self._tell_new_size()
        for line in self.without_effect:
            _tell(line)
        mark_outdated(self.page, outdated=True)
        files.write_json(STATES, self.states)
        sign_results(Path(self.results), RUN_LOCK.parent)

    def succeed(self, key: str) -> None:
        """Print a summary, and remove the mark of a report that was made from this key."""
        try:
            self._summarize_recordings()
            self._summarize_surveys()
            self._tell_leftovers()
        except CapsuleError as error:
            _tell(error_line(error))
        if self.page.exists() and is_made_from(self.page, key):
            mark_outdated(self.page, outdated=False)
        if line := self.about_report(key):
            _tell(line)

    def about_report(self, key: str) -> str:
        """Return where the report is, or that it is not made from this key; empty without one."""
        if not self.page.exists():
            return ""
        if is_made_from(self.page, key):
            return f"The report: {self.page}"
        return f"{self.page} is out of date; make it again: snakemake -c2 {self.page}"

    def _free_bytes(self) -> int:
        """Return the free bytes on the disk of the results or of the working directory."""
        places = [place for place in (".", self.results) if Path(place).exists()]
        return min(shutil.disk_usage(place).free for place in places)

    def _explain_full_disk(self) -> None:
        """Print an error if the disk is full; the logs may have no room left for it."""
        free = self._free_bytes()
        if free < _FULL_DISK_BYTES:
            _tell(
                f"The disk is full: only {free / 1e6:.1f} MB are free. Free some space and run the "
                "same command again: finished results are kept."
            )

    def _tell_new_size(self) -> None:
        """Print that the archive has passed a limit, so that its jobs take more recordings."""
        table = Path(self.results) / OfArchive.RECORDINGS
        if table.exists() and self.config["recordings_per_job"] == "auto":
            earlier = batch_size(len(files.read_or_explain(table, files.read_csv)), "auto")
            division = self.division
            if earlier != division.size:
                _tell(
                    f"{sum(map(len, division.batches.values()))} recordings: each job now takes up "
                    f"to {division.size} instead of {earlier}, so everything is made once more."
                )

    def _summarize_recordings(self) -> None:
        """Print the recordings that were rejected, and the files that were passed over."""
        table, others = (
            Path(self.results) / name for name in (OfArchive.RECORDINGS, OfArchive.PASSED_OVER)
        )
        if not table.exists() or not others.exists():
            return
        rows = files.read_or_explain(table, files.read_csv)
        rejected = [row for row in rows if row["status"] != "accepted"]
        _tell(f"{len(rows) - len(rejected)} recordings accepted, {len(rejected)} rejected.")
        for row in rejected:
            _tell(f"  rejected: {self.raw}/{row['recording']}: {row['reason']}")
        for row in rows:
            if row["near_copies"]:
                alike = row["near_copies"].replace(" ", ", ")
                _tell(f"  nearly the same as {alike}: {self.raw}/{row['recording']}")
        for session in unknown_sessions(rows, self.config["evaluation"]["held_out"]):
            _tell(f"  evaluation.held_out: no labelled recording names the session {session!r}")
        by_name = {row["recording"]: row for row in rows}
        if said := in_words(confounded_keys(by_name, self.config["evaluation"]["held_out"])):
            _tell(f"  confounded: among the recordings that teach, {said}")
        for row in files.read_or_explain(others, files.read_csv):
            _tell(f"  passed over: {self.raw}/{row['path']}: {row['reason']}")

    def _summarize_surveys(self) -> None:
        """Print the surveys that are not in the report, each with the reason."""
        problems = dict(self.surveys.passed_over)
        for name in self.surveys.names:
            values = Path(self.results) / OfArchive.SURVEYS / name / SURVEY_VALUES
            if values.exists():
                content = files.read_or_explain(values, files.read_json)
                if problem := content.get("problem"):
                    problems[name] = f"cannot be read: {problem}"
        for name, problem in sorted(problems.items()):
            _tell(f"  survey passed over: {self.sessions}/{name}: {problem}")

    def _tell_leftovers(self) -> None:
        """Print how many results are of recordings, batches or tables that are gone."""
        left = left_over(Path(self.results), self.division)
        made = {"predictions", "learning", *COLUMNS}
        tables = sorted((Path(self.results) / OfArchive.EVALUATION).glob("*.csv"))
        left += [path.as_posix() for path in tables if path.stem not in made]
        if left:
            _tell(
                f"{len(left)} files are of recordings, batches or tables that are gone, and are "
                f"not used, such as {left[0]}"
            )


def _tell(line: str) -> None:
    """Print a line where Snakemake prints its own."""
    print(line, file=sys.stderr)


def unfinished_jobs(folder: Path) -> tuple[str, ...]:
    """Return the numbers of the Slurm jobs of runs in a folder that have not ended.

    There are none if nothing was submitted from the folder, or if Slurm does not answer, which is
    printed.
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
