# Start and end of a run: allow one run at a time in a folder, check the free disk space, mark an
# outdated report, and print a summary. A dry run calls nothing here.
#
# takes: results/recordings.csv and results/passed_over.csv, when a run has ended
# gives: the lock .snakemake/run.lock, and lines on the terminal

from capsule.engine.run import Run
from capsule.engine.short_log import shorten_log

RUN = Run(RAW, RESULTS, SESSIONS, config, DIVISION, SURVEYS, STATES_OF_CODE, WITHOUT_EFFECT)

# On a cluster, Snakemake runs these jobs itself: each takes seconds, and a job of the cluster starts
# Snakemake twice. A module leaves the choice to the workflow that uses it.
if not IS_MODULE:
    # Ctrl-C during a job's imports would end in a traceback; `capsule.engine.jobs.run` hears it again.
    shell.prefix("trap '' INT; ")

    localrules:
        list,
        list_labelled,
        describe,
        plot,
        templates,
        evaluate,
        detect,
        draw,
        figures,
        survey,
        report,

    # A dry run gives Snakemake's reasons.
    in_full = workflow.output_settings.dryrun or workflow.output_settings.verbose
    if workflow.is_main_process and not in_full:
        shorten_log(lambda: RUN.about_report(REPORT.key()))


onstart:
    with told_as(WorkflowError):
        RUN.begin()
    # On one machine nothing limits jobs a second but its cores. Snakemake's limit wakes it once a
    # second for each job that has ended, so hundreds of times a second, and holds up its end.
    if workflow.local_exec:
        workflow.scheduler.job_rate_limiter = None


onsuccess:
    RUN.succeed(REPORT.key())
