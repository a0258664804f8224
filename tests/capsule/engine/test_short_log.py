"""A run prints a line that counts its jobs, a line a job, its errors, and where the report is."""

import io
import logging

import pytest
from snakemake.logging import ColorizingTextHandler, DefaultFilter, DefaultFormatter, LogEvent

from capsule.engine.short_log import ShortLog


@pytest.fixture
def terminal():
    """Return what is printed, and a function that logs to it as Snakemake does."""
    stream = io.StringIO()
    shown = DefaultFilter(None, debug_dag=False, dryrun=False, printshellcmds=False)
    usual = ColorizingTextHandler(True, stream, DefaultFormatter(None), shown)
    handler = ShortLog(usual, lambda: "The report: results/report.html")

    def log(text, event=None, level=logging.INFO, **said):
        record = logging.LogRecord("snakemake.logging", level, "", 1, text, (), None)
        vars(record).update(said, **({"event": event} if event else {}))
        if handler.filter(record):
            handler.handle(record)

    return stream, log


def test_each_job_is_one_line_with_its_number(terminal):
    stream, log = terminal
    log("Building DAG of jobs...")
    log("Provided cores: 2", LogEvent.RESOURCES_INFO)
    log("Job stats: ...", LogEvent.RUN_INFO, stats={"fit": 1, "everything": 1, "total": 2})
    for message, rule in (("fit 3mm/r01", "fit"), (None, "everything")):
        log("Select jobs to execute...")
        log("Execute 1 jobs...")
        job = {"rule_msg": message, "rule_name": rule, "jobid": 7, "reason": "", "indent": False}
        # The rule of all results has each of them as an input.
        log("", LogEvent.JOB_INFO, input=["results/a"] * 3000, **job)
        log("Finished jobid: 7", LogEvent.JOB_FINISHED, job_id=7)
        log("", LogEvent.PROGRESS, done=1, total=2)
    log("Complete log(s): x.log")
    assert stream.getvalue().splitlines() == [
        "2 jobs: 1 fit, 1 everything",
        "1 of 2: fit 3mm/r01",
        "2 of 2: everything",
    ]


def test_errors_and_warnings_stand_in_snakemakes_words(terminal):
    stream, log = terminal
    for level in (logging.WARNING, logging.ERROR):
        log("Select jobs with care", level=level)
    log("Shutting down, this might take some time.")
    assert stream.getvalue().splitlines() == [
        "Select jobs with care",
        "Select jobs with care",
        "Shutting down, this might take some time.",
    ]


def test_a_run_with_nothing_to_be_done_says_where_the_report_is(terminal):
    stream, log = terminal
    log("Nothing to be done (all requested files are present and up to date).")
    assert stream.getvalue().splitlines()[1:] == ["The report: results/report.html"]
