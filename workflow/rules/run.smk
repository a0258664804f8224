# Start and end of a run: tell each job in a line, allow one run at a time in a folder, check the
# free disk space, mark an outdated report, and print a summary.
#
# takes: results/records/; results/recordings.csv and results/passed_over.csv, when a run has ended
# gives: the lock .snakemake/run.lock, and what is said on the terminal

import atexit
import shutil

from snakemake.logging import logger

from edges.files import mark_outdated, read_csv, read_json, remove_unfinished
from edges.records import files_that_do_not_fit
from edges.run_lock import hold
from edges.terminal_log import speak_shortly

# With less room than this no run gets far.
FULL_DISK_BYTES = 1_000_000
REPORT = Path(rules.report.output[0])
# Kept open, and so locked, until this process ends.
RUN_LOCK = []


# A module leaves the terminal to the workflow that uses it; --printshellcmds and --verbose bring
# Snakemake's own lines back.
ASKED_FOR_MORE = workflow.output_settings.printshellcmds or workflow.output_settings.verbose
if workflow.is_main_process and not IS_MODULE and not ASKED_FOR_MORE:
    speak_shortly(logger, dry_run=workflow.output_settings.dryrun)


def take_run_lock():
    """Let no two runs work in this folder at once."""
    try:
        RUN_LOCK.append(hold(Path(".snakemake") / "run.lock"))
    except CapsuleError as error:
        raise WorkflowError(str(error)) from None


def free_bytes():
    """Return the room on the disks that hold the results and Snakemake's own notes."""
    places = [place for place in (".", RESULTS) if Path(place).exists()]
    return min(shutil.disk_usage(place).free for place in places)


def explain_full_disk():
    """Say that the disk is full: a job's log, or Snakemake's, may have found no room for it."""
    if free_bytes() < FULL_DISK_BYTES:
        print(
            f"The disk is full: only {free_bytes() / 1e6:.1f} MB are free. Free some space and run "
            "the same command again: finished results are kept.",
            file=sys.stderr,
        )


def summarize_recordings():
    """Say on the terminal what was rejected or passed over."""
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
    """Say on the terminal which surveys are not in the report, and why."""
    problems = dict(SURVEYS.passed_over)
    for name in SURVEYS.names:
        values = Path(RESULTS) / "surveys" / name / "survey.json"
        if values.exists() and (problem := read_json(values).get("problem")):
            problems[name] = f"cannot be read: {problem}"
    for name, problem in sorted(problems.items()):
        print(f"  survey passed over: {SESSIONS}/{name}: {problem}", file=sys.stderr)


def tell_whether_the_report_fits():
    """Take the mark off a report that is up to date; otherwise name what has changed.

    It may have changed because this run was asked for something else, or while it worked.
    """
    mark_outdated(REPORT, outdated=False)
    if REPORT.exists() and (changed := files_that_do_not_fit(REPORT.as_posix())):
        mark_outdated(REPORT, outdated=True)
        print(
            f"{REPORT} is out of date, because {changed[0]} has changed; to make it again: "
            f"snakemake -c2 {REPORT}",
            file=sys.stderr,
        )


onstart:
    take_run_lock()
    remove_unfinished(Path(RESULTS))
    # Not onerror: where Snakemake itself finds no room, it ends without calling that.
    atexit.register(explain_full_disk)
    if free_bytes() < FULL_DISK_BYTES:
        raise WorkflowError(
            "no space left on device, nothing was started; free some space and run again"
        )
    mark_outdated(REPORT, outdated=True)


onsuccess:
    summarize_recordings()
    summarize_surveys()
    tell_whether_the_report_fits()
