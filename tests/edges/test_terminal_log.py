"""Lines on the terminal, made from Snakemake's log records."""

import io
import logging

import pytest
from edges.terminal_log import TerminalLog, reason_in_words, speak_shortly
from snakemake_interface_logger_plugins.common import LogEvent


class Terminal(io.StringIO):
    """A stream that is a terminal or not."""

    def __init__(self, live):
        super().__init__()
        self.isatty = lambda: live


@pytest.fixture
def logged():
    """Return a function that logs events, and returns the text on the terminal."""

    def log(*events, live=False, **options):
        stream = Terminal(live)
        default = logging.StreamHandler(stream)
        default.name = "DefaultStreamHandler"
        logger = logging.Logger("snakemake")
        logger.addHandler(default)
        speak_shortly(logger, **{"dry_run": False, **options})
        for event in events:
            logger.info(event.pop("text", None), extra=event)
        return stream.getvalue()

    return log


def job(rule, reason="Forced execution", **wildcards):
    return {
        "event": LogEvent.JOB_INFO,
        "rule_name": rule,
        "wildcards": wildcards,
        "reason": reason,
    }


def progress(done, total):
    return {"event": LogEvent.PROGRESS, "done": done, "total": total}


def test_a_run_names_each_job_in_a_line(logged):
    said = logged(job("fit", recording="3mm/r07"), progress(1, 2), job("index"), progress(2, 2))
    assert said == "- fit 3mm/r07\n- index\n2 of 2 jobs done\n"


def test_a_dry_run_says_why(logged):
    said = logged(job("fit", "Missing output files: a.json", recording="3mm/r07"), dry_run=True)
    assert said == "- fit 3mm/r07, because its results are missing\n"


def test_on_a_terminal_one_line_tells_how_far_the_run_is(logged):
    said = logged(job("fit", recording="3mm/r07"), progress(1, 1), live=True)
    assert said.split("\r\x1b[K") == [
        "",
        "fit 3mm/r07",
        "1 of 1 jobs done, fit 3mm/r07",
        "1 of 1 jobs done\n",
    ]


def test_the_line_never_wraps(logged, monkeypatch):
    monkeypatch.setenv("COLUMNS", "20")
    said = logged(job("fit", recording="3mm/" + 50 * "r"), live=True)
    assert len(said.split("\x1b[K")[1]) == 19


def test_what_has_gone_wrong_is_told_as_snakemake_tells_it(logged):
    said = logged(job("fit"), {"event": LogEvent.ERROR, "text": "it broke"}, live=True)
    assert said.endswith("fit\r\x1b[Kit broke\n")


def test_the_table_of_jobs_is_told_once_and_other_lines_not_at_all(logged):
    table = {"event": LogEvent.RUN_INFO, "text": "Job stats:"}
    assert logged(table, {"text": "Select jobs to execute..."}, table | {}) == "Job stats:\n"


def reasons_of_set(step, wildcards):
    """Return as many recordings as the name of the set says."""
    count = int(wildcards["set"].rpartition("-")[2]) if "set" in wildcards else 0
    return {f"3mm/r{run}": f"raw/3mm/r{run}.csv has changed" for run in range(count)}


def test_a_dry_run_names_each_recording_of_a_set_with_its_reason(logged):
    said = logged(job("fit_set", set="3mm/set-2"), dry_run=True, reasons=reasons_of_set)
    assert said == (
        "- fit_set 3mm/r0, because raw/3mm/r0.csv has changed\n"
        "- fit_set 3mm/r1, because raw/3mm/r1.csv has changed\n"
    )


@pytest.mark.parametrize(
    ("count", "expected"),
    [
        (0, "- fit_set 3mm/set-0\n"),
        (3, "- fit_set 3mm/set-3 (3mm/r0, 3mm/r1, 3mm/r2)\n"),
        (9, "- fit_set 3mm/set-9 (3mm/r0, 3mm/r1, 3mm/r2 and 6 more)\n"),
    ],
)
def test_the_job_of_a_set_names_the_first_recordings_that_it_makes(logged, count, expected):
    assert logged(job("fit_set", set=f"3mm/set-{count}"), reasons=reasons_of_set) == expected


def test_another_handler_stays():
    logger = logging.Logger("snakemake")
    chosen = logging.NullHandler()
    logger.addHandler(chosen)
    speak_shortly(logger, dry_run=False)
    assert logger.handlers == [chosen]
    assert not isinstance(chosen, TerminalLog)


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        ("Updated input files: b.csv, a.csv", "a.csv (and 1 more) has changed"),
        ("Input files updated by another job: a.npy", "a.npy changes"),
        (
            "Params have changed since last execution: before: 1 now: 2",
            "its recording, its settings or the code have changed",
        ),
        ("Something new: x", "Something new: x"),
        ("", "it was asked for"),
    ],
)
def test_reasons_are_told_in_words(reason, words):
    assert reason_in_words(reason) == words
