"""What a run prints: a line that counts its jobs, a line a job, errors, and where the report is.

Snakemake's own lines say more, in five lines a job. They are in its log below .snakemake/log/, and
`snakemake --verbose` prints them. The Snakefile uses this module, so it imports only fast modules.
"""

import logging
from collections.abc import Callable
from typing import Any

# Snakemake's lines on how it chooses and runs jobs begin so.
_DROPPED = (
    "Assuming unrestricted",
    "Building DAG",
    "Complete log",
    "Conda environments",
    "Execute ",
    "Provided ",
    "Rules claiming",
    "Select jobs",
    "Singularity containers",
    "Using shell",
    "host: ",
)
_DROPPED_EVENTS = {"JOB_FINISHED", "JOB_STARTED", "PROGRESS", "RESOURCES_INFO"}
_NOTHING = "Nothing to be done"


class ShortLog(logging.StreamHandler[Any]):
    """Print one line a job.

    Parameters
    ----------
    usual : logging.StreamHandler
        Snakemake's own for the terminal. It prints errors, and says what the user asked not to see.
    about_report : callable
        Returns the line on the report for a run with nothing to be done; it may be empty.
    """

    def __init__(self, usual: logging.StreamHandler[Any], about_report: Callable[[], str]) -> None:
        super().__init__(usual.stream)
        self._usual, self._about_report = usual, about_report
        self._begun, self._total = 0, 0
        self.filters = usual.filters

    def emit(self, record: logging.LogRecord) -> None:
        """Print what is said of a record, if anything."""
        if lines := self._lines(record):
            self.stream.write(f"{lines}\n")
            self.flush()

    def _lines(self, record: logging.LogRecord) -> str:
        event, said = vars(record).get("event"), vars(record)
        name = event.name if event else ""
        if name == "RUN_INFO" and "stats" in said:
            counts = dict(said["stats"])
            self._total = counts.pop("total")
            return f"{self._total} jobs: {', '.join(f'{n} {rule}' for rule, n in counts.items())}"
        if name == "JOB_INFO":
            self._begun += 1
            return f"{self._begun} of {self._total}: {said['rule_msg'] or said['rule_name']}"
        lines = self._usual.format(record)
        if name in _DROPPED_EVENTS:
            return ""
        if record.levelno == logging.INFO and (not lines.strip() or lines.startswith(_DROPPED)):
            return ""
        if lines.startswith(_NOTHING) and (line := self._about_report()):
            return f"{lines}\n{line}"
        return "" if lines == "None" else lines


def shorten_log(about_report: Callable[[], str]) -> None:
    """Print one line a job where Snakemake prints its lines to the terminal."""
    logger = logging.getLogger("snakemake.logging")
    for usual in list(logger.handlers):
        if usual.name == "DefaultStreamHandler" and isinstance(usual, logging.StreamHandler):
            logger.removeHandler(usual)
            logger.addHandler(ShortLog(usual, about_report))
