# Start and end of a run: print one line for each job, allow one run at a time in a folder, preload
# what the jobs import, check the free disk space, mark an outdated report, and print a summary.
#
# takes: results/records/; results/recordings.csv and results/passed_over.csv, when a run has ended
# gives: the lock .snakemake/run.lock, and the lines on the terminal

import atexit
import contextlib
import shutil
import threading

from snakemake.logging import logger

from edges.files import mark_outdated, read_csv, read_json, remove_unfinished
from edges.preloaded_jobs import PreloadedJobs
from edges.records import files_that_do_not_fit
from edges.run_lock import hold
from edges.slurm_jobs import explain_ends
from edges.terminal_log import no_reasons, speak_shortly

# With less free space than this, a run stops before its first job.
FULL_DISK_BYTES = 1_000_000
REPORT = Path(rules.report.output[0])
# This list keeps the lock's file open. The lock ends when the process ends.
RUN_LOCK = []
# It is written when a run begins.
RUN_LOCK_FILE = Path(".snakemake") / "run.lock"


# A module does not change the lines of the workflow that uses it. With --printshellcmds or
# --verbose, Snakemake prints its own lines.
ASKED_FOR_MORE = workflow.output_settings.printshellcmds or workflow.output_settings.verbose
if workflow.is_main_process and not IS_MODULE and not ASKED_FOR_MORE:
    speak_shortly(
        logger,
        dry_run=workflow.output_settings.dryrun,
        reasons=reasons_of_job if PER_JOB > 1 else no_reasons,
    )

# On a cluster, Snakemake runs these jobs itself: each takes seconds, and a job of the cluster starts
# Snakemake twice. A module leaves the choice to the workflow that uses it.
if not IS_MODULE:

    localrules:
        index,
        average,
        passages,
        features,
        evidence,
        detect,
        evaluate,
        judge,
        combine,
        draw_templates,
        draw_evaluation,
        draw_comparison,
        draw_design,
        print_templates,
        print_evaluation,
        print_comparison,
        print_design,
        page_files,
        chart_survey,
        print_survey,
        report,


def take_run_lock():
    """Take the folder's run lock, so that a second run stops with an error."""
    try:
        RUN_LOCK.append(hold(RUN_LOCK_FILE))
    except CapsuleError as error:
        raise WorkflowError(str(error)) from None


def preload_jobs():
    """Let the jobs of this computer be forks of one process that has imported what they import.

    A job of a cluster starts its own Python: its Snakemake finds that one first, in common.smk. So
    does each job with CAPSULE_PRELOAD=0.
    """
    wanted = os.environ.get("CAPSULE_PRELOAD") != "0" and not workflow.touch
    if sys.platform == "linux" and wanted:
        # Without room for its folder, each job starts its own Python.
        with contextlib.suppress(OSError):
            jobs = PreloadedJobs([*RULES, "report"], SCRIPTS, os.environ)
            atexit.register(jobs.close)
            os.environ.update(PATH=os.pathsep.join([str(jobs.folder), *os.get_exec_path()]))


def free_bytes():
    """Return the free bytes on the disk of the results or of the working directory, the smaller."""
    places = [place for place in (".", RESULTS) if Path(place).exists()]
    return min(shutil.disk_usage(place).free for place in places)


def explain_full_disk():
    """Print an error if the disk is full; the logs may have no room left for it."""
    if free_bytes() < FULL_DISK_BYTES:
        print(
            f"The disk is full: only {free_bytes() / 1e6:.1f} MB are free. Free some space and run "
            "the same command again: finished results are kept.",
            file=sys.stderr,
        )


def summarize_recordings():
    """Print the recordings that were rejected, and the files that were passed over."""
    index, others = Path(rules.index.output.recordings), Path(rules.index.output.passed_over)
    if not index.exists() or not others.exists():
        return
    rows = read_csv(index)
    rejected = [row for row in rows if row["status"] != "accepted"]
    print(
        f"{len(rows) - len(rejected)} recordings accepted, {len(rejected)} rejected.",
        file=sys.stderr,
    )
    for row in rejected:
        print(f"  rejected: {RAW}/{row['recording']}: {row['reason']}", file=sys.stderr)
    for row in rows:
        if row["near_copies"]:
            alike = row["near_copies"].replace(" ", ", ")
            print(f"  nearly the same as {alike}: {RAW}/{row['recording']}", file=sys.stderr)
    for row in read_csv(others):
        print(f"  passed over: {RAW}/{row['path']}: {row['reason']}", file=sys.stderr)


def summarize_surveys():
    """Print the surveys that are not in the report, each with the reason."""
    problems = dict(SURVEYS.passed_over)
    for name in SURVEYS.names:
        values = Path(RESULTS) / "surveys" / name / "survey.json"
        if values.exists() and (problem := read_json(values).get("problem")):
            problems[name] = f"cannot be read: {problem}"
    for name, problem in sorted(problems.items()):
        print(f"  survey passed over: {SESSIONS}/{name}: {problem}", file=sys.stderr)


def tell_whether_the_report_fits():
    """Remove the mark from a report that is up to date; otherwise print what has changed.

    A report can be out of date if this run made another target, or if a file changed during the
    run.
    """
    mark_outdated(REPORT, outdated=False)
    if REPORT.exists() and (changed := files_that_do_not_fit(REPORT.as_posix())):
        mark_outdated(REPORT, outdated=True)
        print(
            f"{REPORT} is out of date, because {changed[0]} has changed; to make it again: "
            f"snakemake -c2 {REPORT}",
            file=sys.stderr,
        )


def cancel_timers():
    """Cancel the timers of Snakemake's scheduler: Python would wait a second for them at its end."""
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.cancel()


onstart:
    take_run_lock()
    preload_jobs()
    remove_unfinished(Path(RESULTS))
    # onerror would not do: on a full disk, Snakemake itself can end without calling it.
    atexit.register(explain_full_disk)
    if free_bytes() < FULL_DISK_BYTES:
        raise WorkflowError(
            "no space left on device, nothing was started; free some space and run again"
        )
    mark_outdated(REPORT, outdated=True)


onsuccess:
    cancel_timers()
    summarize_recordings()
    summarize_surveys()
    tell_whether_the_report_fits()


onerror:
    cancel_timers()
    for line in explain_ends(Path.cwd(), RUN_LOCK_FILE.stat().st_mtime):
        print(line, file=sys.stderr)
