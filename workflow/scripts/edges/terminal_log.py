"""Print one line for each job of a Snakemake run, and one line for the progress.

Snakemake's own lines list a job's files, sometimes a thousand of them. They remain in the log file
under .snakemake/log/. Snakemake's own error messages are printed as they are.

The Snakefile uses this module, so it imports only fast modules.
"""

import logging
import re
import shutil
from collections.abc import Callable, Mapping
from typing import TextIO

# Events and messages that are not printed: this module prints them in other words, or the lines of
# the jobs make them superfluous.
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
    "Rules with missing metadata",
)
# Snakemake has no notes on results whose records were taken over; nothing depends on the notes.
_LEFT_OUT_WORDS = "have missing provenance/metadata"
# Beginnings of Snakemake's reasons, and the words that are printed for them.
_REASONS = (
    ("Missing output files", "its results are missing"),
    ("Params have changed", "its recording, its settings or the code have changed"),
    ("Code has changed", "the code has changed"),
    ("Set of input files", "recordings were added or removed"),
    ("Updated input files", "{} has changed"),
    ("Input files updated by another job", "{} changes"),
    ("Forced execution", "it was asked for"),
)
# A line names at most this many recordings of one job.
_NAMED = 3
_CLEAR_LINE = "\r\x1b[K"

# Returns the reason for each recording that a job makes, from the job's rule and wildcards.
Reasons = Callable[[str, Mapping[str, str]], Mapping[str, str]]


def no_reasons(rule: str, wildcards: Mapping[str, str]) -> Mapping[str, str]:
    """Return no recordings: each job has at most one, which Snakemake names."""
    return {}


def reason_in_words(reason: str) -> str:
    """Return the reason why a job runs, in plain words.

    Parameters
    ----------
    reason : str
        Snakemake's reason: a sentence, a colon, and all files or values that it concerns.

    Returns
    -------
    str
        A clause that follows "because"; it names only the first of many files.
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
    """A log handler that prints short lines in place of those of Snakemake's own handler.

    Parameters
    ----------
    default : logging.StreamHandler
        Snakemake's own handler, which prints all other messages.
    dry_run : bool
        Whether jobs are only listed, each with its reason.
    reasons : callable
        ``reasons(rule, wildcards)`` returns the reason for each recording that the job of a set
        makes; empty for other jobs.
    """

    def __init__(
        self,
        default: logging.StreamHandler[TextIO],
        *,
        dry_run: bool,
        reasons: Reasons = no_reasons,
    ) -> None:
        super().__init__(default.level)
        self._reasons = reasons
        self.filters = default.filters
        self._default, self._stream, self._dry_run = default, default.stream, dry_run
        self._live = self._stream.isatty() and not dry_run
        self._job, self._progress, self._table_told = "", "", False

    def emit(self, record: logging.LogRecord) -> None:
        """Print one message, or leave it out."""
        event = getattr(record, "event", None)
        kind = getattr(event, "value", event)
        text = record.getMessage()
        if kind in _LEFT_OUT or text.startswith(_LEFT_OUT_TEXTS) or _LEFT_OUT_WORDS in text:
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
        rule, wildcards = told["rule_name"], told["wildcards"]
        reasons = self._reasons(rule, wildcards)
        self._job = " ".join([rule, *wildcards.values(), *_named(list(reasons))])
        if self._live:
            self._show()
        elif self._dry_run:
            lines = {f"{rule} {name}": reason for name, reason in reasons.items()}
            for line, reason in (
                lines or {self._job: reason_in_words(str(told["reason"]))}
            ).items():
                self._write(f"- {line}, because {reason}\n")
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


def _named(recordings: list[str]) -> list[str]:
    """Return the first recordings of a job in parentheses, and the number of the others."""
    more = f" and {len(recordings) - _NAMED} more" if len(recordings) > _NAMED else ""
    return [f"({', '.join(recordings[:_NAMED])}{more})"] if recordings else []


def speak_shortly(logger: logging.Logger, *, dry_run: bool, reasons: Reasons = no_reasons) -> None:
    """Replace Snakemake's own handler for the terminal with a `TerminalLog`.

    If the user has chosen another logger, that handler does not exist, and nothing changes.
    """
    for default in list(logger.handlers):
        if default.name == "DefaultStreamHandler" and isinstance(default, logging.StreamHandler):
            logger.removeHandler(default)
            logger.addHandler(TerminalLog(default, dry_run=dry_run, reasons=reasons))
