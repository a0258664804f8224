# Divide the recordings into sets, and find the recordings of each set that its job must make.
#
# takes: results/records/, results/sets/
# gives: SETS, KEYS, and the functions sets_of, recordings_of_set, made_from_set, prepare_sets,
#        reasons_of_job

from capsule.job_sets import job_sets
from edges.recording_files import reasons_to_make
from edges.records import current_key, reason_to_make
from edges.set_files import forget_recordings, stand_in, take_over

SETS = job_sets(ARCHIVE.recordings, PER_JOB)
SET_OF = {name: label for label, names in SETS.items() for name in names}
SET_SETTINGS = {"preprocess": as_parameter(CHECK_SETTINGS), "fit": section("fit")}
# The records of single recordings know their settings and code by these checksums.
KEYS = {
    stage: with_members(code_key(f"{stage}.py", settings))
    for stage, settings in SET_SETTINGS.items()
}
# For each rule and set, the recordings that are made, with the reasons.
REASONS = {}
# The files of sets that need no job although their recordings, their code or their size changed.
TAKEN_OVER = set()


def sets_of(recordings):
    """Return the names of the sets that hold these recordings."""
    return list(dict.fromkeys(SET_OF[name] for name in recordings))


def recordings_of_set(wildcards):
    """Return the recordings of a set, as a rule's parameter."""
    return SETS[wildcards.set]


def is_forced(step, outputs):
    """Return whether the user wants this job to run in any case."""
    asked = workflow.dag_settings
    # Snakemake's own list of forced files also holds those of an interrupted run.
    files = {*asked.forcerun, *(asked.targets if asked.forcetargets else ())}
    return getattr(rules, step).rule in workflow.dag.forcerules or not files.isdisjoint(outputs)


def will_run():
    """Return whether this call runs jobs, and does not only list, draw or touch something."""
    return workflow.executor_plugin and not workflow.dryrun and not workflow.touch


def made_from_set(stage):
    """Return the parameter `made_from` of a set's rule; a forced job makes all its recordings."""
    step = f"{stage}_set"
    made_from_members = made_from(step, SET_SETTINGS[stage], members=recordings_of_set)

    def told(wildcards):
        outputs = outputs_of(step, wildcards)
        if workflow.is_main_process and is_forced(step, outputs):
            names = SETS[wildcards.set]
            REASONS[step, wildcards.set] = dict.fromkeys(names, "it was asked for")
            if MAY_RENEW and will_run():
                forget_recordings(Path(RESULTS), stage, names)
        elif outputs[0] in TAKEN_OVER:
            forget(outputs[0])
        return made_from_members(wildcards)

    return told


def prepare_sets(stage, labels):
    """Find the recordings that the jobs of sets must make; a set without any needs no job."""
    step, results = f"{stage}_set", Path(RESULTS)
    fixed = code_key(f"{step}.py", SET_SETTINGS[stage])
    for label in labels:
        names, outputs = SETS[label], outputs_of(step, {"set": label})
        told = current_key(f"{outputs[0]}:{with_members(fixed, *names)}")
        if reason_to_make(told, outputs):
            REASONS[step, label] = reasons_to_make(results, stage, KEYS[stage], names)
            if MAY_RENEW and REASONS[step, label]:
                stand_in(Path(outputs[0]), results)
            elif MAY_RENEW:
                take_over(Path(outputs[0]), told, results, stage, names)
                TAKEN_OVER.add(outputs[0])


def reasons_of_job(step, wildcards):
    """Return the recordings that the job of a set makes, each with the reason."""
    label = wildcards.get("set")
    reasons = dict(REASONS.get((step, label), {}))
    if step == "fit_set":
        for name in REASONS.get(("preprocess_set", label), {}):
            reasons.setdefault(name, f"{RESULTS}/matrices/{name}.npy changes")
    return reasons
