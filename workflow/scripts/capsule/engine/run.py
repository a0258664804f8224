"""Where a run of the workflow may begin, its start, and its end with a summary.

The first functions judge the folder at each start of Snakemake, also of a dry run, which never
makes a `Run`. The Snakefile uses this module, so it imports only fast modules.
"""

import atexit
import contextlib
import itertools
import os
import re
import secrets
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from capsule.engine.jobs import RUN_LOCK, STATES, State, hold_run_lock
from capsule.errors import CapsuleError, error_line
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.confounded import confounded_keys, in_words
from capsule.kinds import Settings
from capsule.recordings.held_out import unknown_sessions
from capsule.store import files
from capsule.store.files import UNFINISHED, write_whole
from capsule.store.results import SURVEY_VALUES, Division, OfArchive, batch_size, left_over
from capsule.survey.listed import Surveys

# With less free space than this, a run stops before its first job.
_FULL_DISK_BYTES = 1_000_000
# Snakemake's plugin for Slurm keeps its logs here, so the folder exists where jobs were submitted.
LOGS = Path(".snakemake/slurm_logs")
# The plugin names all jobs of a run by one random number (UUID), sometimes behind a prefix.
_NAME = re.compile(r"\S*[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
_SECONDS = 60
_HEAD_BYTES = 2000
# Each run writes its sign into the results, and into a file beside Snakemake's notes on them. If
# both differ, the notes are not on these results.
SIGN = "run.txt"
# Below results/: what is not made by a job.
_NOT_MADE = {OfArchive.LOGS, SIGN}
# The first line of the report from the start of a run until a new report is complete.
OUTDATED = (
    b'<p class="outdated" role="alert">This report is out of date: recordings, settings or code '
    b"have changed since. Make it again: <code>snakemake -c2 results/report.html</code></p>\n"
)


@contextlib.contextmanager
def told_as(kind: Callable[[str], Exception]) -> Iterator[None]:
    """Raise an error of the input or of the disk as one of this kind, in one line."""
    try:
        yield
    except CapsuleError as error:
        raise kind(str(error)) from None
    except OSError as error:
        raise kind(error_line(error)) from None


def refuse_folders(project: Path, here: Path) -> None:
    """Raise an error if Snakemake cannot run in the folder `here` with the steps of the project.

    It takes a brace in a name for a wildcard, and it keeps notes in the folder, even of a dry run.
    """
    for folder in (project, here):
        if set("{}") & set(str(folder)):
            raise CapsuleError(
                f"{folder}: rename this folder; Snakemake cannot work in a folder whose name holds "
                "{ or }"
            )
    notes = here / ".snakemake"
    # Another user's folder may be open to all, and what it holds may not.
    for path in (here, notes, *notes.glob("*"), notes / "iocache" / "latest.pkl"):
        if path.exists() and not os.access(path, os.W_OK):
            raise CapsuleError(
                f"{path} cannot be written, and Snakemake keeps notes there; have its owner allow "
                "it, or run it in a folder of your own that holds raw/ and config/ (capsule new "
                "NAME makes one)"
            )


def refuse_unknown_results(results: Path, notes: Path) -> None:
    """Raise an error if results are there, but not Snakemake's notes on them, in .snakemake.

    Without its notes, or with those on other results, Snakemake takes any result for one that fits.
    """
    if not results.is_dir() or not any(_made_in(results)):
        return
    if not any(_is_filled(notes / name) for name in ("metadata", "incomplete")):
        raise CapsuleError(
            f"Snakemake's notes on {results}/, in {notes}/metadata/, are gone, so nobody knows "
            f"whether these results fit the recordings; remove {results}/ and run again"
        )
    known, _, of = _read(notes / SIGN).partition(" ")
    if known and of == str(results) and known not in _read(results / SIGN).split():
        raise CapsuleError(
            f"{results}/ is not what the last run of this folder has left there, but a copy from "
            "elsewhere or from before, so nobody knows whether these results fit the recordings; "
            f"remove {results}/ and run again, or put back what that run has left"
        )


def _made_in(results: Path) -> Iterator[Path]:
    """Yield the files that jobs have made; a run that has just begun has made folders alone."""
    for path in results.iterdir():
        if path.name not in _NOT_MADE:
            yield from (each for each in itertools.chain([path], path.rglob("*")) if each.is_file())


def sign_results(results: Path, notes: Path) -> None:
    """Write a new sign into the results, and into a file beside Snakemake's notes on them."""
    before, sign = _read(notes / SIGN).partition(" ")[0], secrets.token_hex(8)
    # If this process is killed in between, the results still have the sign beside the notes.
    for path, text in (
        (results / SIGN, f"{before} {sign}"),
        (notes / SIGN, f"{sign} {results}"),
        (results / SIGN, sign),
    ):
        with write_whole(path) as stream:
            stream.write(f"{text}\n")


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8").strip() if path.is_file() else ""


def _is_filled(folder: Path) -> bool:
    return folder.is_dir() and any(folder.iterdir())


def tidy(folder: Path) -> None:
    """Remove the temporary files of killed processes, and take back dates in the future.

    A file has such a date if a clock was set back. Snakemake fails at a job whose result is older
    than what it is made from.
    """
    now_s = time.time()
    for path in folder.rglob("*"):
        if path.name.startswith(".") and path.name.endswith(UNFINISHED):
            path.unlink(missing_ok=True)
        elif path.lstat().st_mtime > now_s:
            os.utime(path, (now_s, now_s), follow_symlinks=False)


def mark_outdated(page: Path, *, outdated: bool) -> None:
    """Add the line "out of date" to a page, or remove it; the rest of the page does not change."""
    if not page.exists():
        return
    content = page.read_bytes()
    plain = content.replace(OUTDATED, b"")
    wanted = plain.replace(b"<body>\n", b"<body>\n" + OUTDATED, 1) if outdated else plain
    if wanted != content:
        with write_whole(page, "wb") as stream:
            stream.write(wanted)


def is_made_from(page: Path, key: str) -> bool:
    """Return whether a page names the key of the job that would make it now."""
    # Only the head of the page names it.
    with page.open("rb") as stream:
        return key.encode() in stream.read(_HEAD_BYTES)


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
        `capsule.engine.jobs.states_of`.
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
