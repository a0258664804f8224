"""A run prints a line that counts its jobs, a line a job, its errors, and where the report is."""

import io
import logging

from snakemake.logging import ColorizingTextHandler, DefaultFilter, DefaultFormatter, LogEvent

from capsule.engine.short_log import ShortLog


def test_each_job_is_one_line_and_errors_stand_in_snakemakes_words():
    stream = io.StringIO()
    shown = DefaultFilter(None, debug_dag=False, dryrun=False, printshellcmds=False)
    usual = ColorizingTextHandler(True, stream, DefaultFormatter(None), shown)
    handler = ShortLog(usual, lambda: "The report: results/report.html")

    def log(text, event=None, level=logging.INFO, **said):
        record = logging.LogRecord("snakemake.logging", level, "", 1, text, (), None)
        vars(record).update(said, **({"event": event} if event else {}))
        if handler.filter(record):
            handler.handle(record)

    log("Job stats: ...", LogEvent.RUN_INFO, stats={"fit": 1, "everything": 1, "total": 2})
    for message, rule in (("fit 3mm/r01", "fit"), (None, "everything")):
        log("Select jobs to execute...")
        job = {"rule_msg": message, "rule_name": rule, "jobid": 7, "reason": "", "indent": False}
        log("", LogEvent.JOB_INFO, input=["results/a"], **job)
        log("Finished jobid: 7", LogEvent.JOB_FINISHED, job_id=7)
        log("", LogEvent.PROGRESS, done=1, total=2)
    log("Select jobs with care", level=logging.WARNING)
    log("Complete log(s): x.log")
    log("Nothing to be done (all requested files are present and up to date).")
    assert stream.getvalue().splitlines() == [
        "2 jobs: 1 fit, 1 everything",
        "1 of 2: fit 3mm/r01",
        "2 of 2: everything",
        "Select jobs with care",
        "Nothing to be done (all requested files are present and up to date).",
        "The report: results/report.html",
    ]
