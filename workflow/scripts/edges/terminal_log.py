"""What a run of Snakemake says on the terminal: a line a job, and one that tells how far it is.

Snakemake's own lines tell a job's files, which are a thousand for some; they stay in the log file
under .snakemake/log/. What has gone wrong is told as Snakemake tells it.

Imports nothing heavy: the Snakefile uses it.
"""

import logging
import re
import shutil
from typing import TextIO

# Said in other words, or of no use beside the lines of the jobs.
_LEFT_OUT = {"workflow_started", "job_started", "job_finished", "resources_info", "rulegraph"}
_LEFT_OUT_TEXTS = (
    "Assuming unrestricted",
    "Building DAG",
    "Conda environments: ignored",
    "Select jobs",
    "Execute ",
    "Using shell",
    "Reasons:",
    "Some jobs were triggered",
    "Rules with provenance",
)
# Snakemake's reasons, and what they mean here.
_REASONS = (
    ("Missing output files", "its results are missing"),
    ("Params have changed", "its recording, its settings or the code have changed"),
    ("Code has changed", "the code has changed"),
    ("Set of input files", "recordings were added or removed"),
    ("Updated input files", "{} has changed"),
    ("Input files updated by another job", "{} changes"),
    ("Forced execution", "it was asked for"),
)
_CLEAR_LINE = "\r\x1b[K"


def reason_in_words(reason: str) -> str:
    """Say why a job runs.

    Parameters
    ----------
    reason : str
        As Snakemake gives it: a sentence, a colon, and all files or values that it concerns.

    Returns
    -------
    str
        A clause that follows "because"; of many files it names the first.
    """
    for beginning, words in _REASONS:
        start = reason.find(beginning)
        if start < 0:
            continue
        listed = re.split(r";|\n", reason[start:].partition(":")[2])[0]
        names = sorted(name.strip() for name in listed.split(","))
        more = f" (and {len(names) - 1} more)" if len(names) > 1 else ""
        return words.format(names[0] + more)
    return reason.splitlines()[0] if reason else "it was asked for"


class TerminalLog(logging.Handler):
    """Says in short what Snakemake's own handler would say at length.

    Parameters
    ----------
    default : logging.StreamHandler
        Snakemake's own handler, which tells everything else.
    dry_run : bool
        Whether jobs are only listed, each with its reason.
    """

    def __init__(self, default: logging.StreamHandler[TextIO], *, dry_run: bool) -> None:
        super().__init__(default.level)
        self.filters = default.filters
        self._default, self._stream, self._dry_run = default, default.stream, dry_run
        self._live = self._stream.isatty() and not dry_run
        self._job, self._progress, self._table_told = "", "", False

    def emit(self, record: logging.LogRecord) -> None:
        """Say one thing."""
        event = getattr(record, "event", None)
        kind = getattr(event, "value", event)
        if kind in _LEFT_OUT or record.getMessage().startswith(_LEFT_OUT_TEXTS):
            return
        if kind == "job_info":
            self._tell_job(record)
        elif kind == "progress":
            self._tell_progress(record)
        elif kind == "run_info" and self._table_told:
            return
        else:
            self._table_told |= kind == "run_info"
            self._write(_CLEAR_LINE if self._live else "")
            self._default.emit(record)

    def _tell_job(self, record: logging.LogRecord) -> None:
        told = vars(record)
        self._job = " ".join([told["rule_name"], *told["wildcards"].values()])
        if self._live:
            self._show()
        elif self._dry_run:
            self._write(f"- {self._job}, because {reason_in_words(str(told['reason']))}\n")
        else:
            self._write(f"- {self._job}\n")

    def _tell_progress(self, record: logging.LogRecord) -> None:
        done, total = vars(record)["done"], vars(record)["total"]
        self._progress = f"{done} of {total} jobs done"
        if self._live:
            self._show()
        if done == total:
            self._write(f"{_CLEAR_LINE if self._live else ''}{self._progress}\n")

    def _show(self) -> None:
        line = ", ".join(filter(None, (self._progress, self._job)))
        self._write(_CLEAR_LINE + line[: shutil.get_terminal_size().columns - 1])

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()


def speak_shortly(logger: logging.Logger, *, dry_run: bool) -> None:
    """Put a `TerminalLog` in the place of Snakemake's own handler for the terminal, if it is there.

    It is not where the user has chosen another logger.
    """
    for default in list(logger.handlers):
        if default.name == "DefaultStreamHandler" and isinstance(default, logging.StreamHandler):
            logger.removeHandler(default)
            logger.addHandler(TerminalLog(default, dry_run=dry_run))
