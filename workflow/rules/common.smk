# Shared by all rules: check the configuration, list the recordings under raw/, and define the
# parameters that make Snakemake run a job again when its code, settings or recordings change.
#
# takes: config/config.yaml, workflow/schemas/config.schema.json, the names under raw/
# gives: ARCHIVE, PER_JOB, SEARCH_SETS, BESIDE_ANOTHER, and the functions as_parameter, section,
#        made_from, files_of, recordings_of_search_set, content_of_recording

import copy
import functools
import hashlib
import json
import os
import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.io import IOFile
from snakemake.utils import min_version, update_config

min_version("9.16")

from capsule.configuration import BENCH, check_configuration
from capsule.detectors.registry import detector_row
from capsule.errors import CapsuleError
from capsule.job_sets import search_sets
from edges.config_files import read_config_file, read_schema
from edges.files import fingerprint, list_archive
from edges.garbage import collect_seldom
from edges.records import parameter
from edges.run_lock import is_held
from edges.set_files import forget_notes, leave_other_sets
from edges.sources import imported_files, read_code

# A job's "python" is the interpreter that runs Snakemake, even if its environment is not activated.
os.environ.update(PATH=os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()]))
if not IS_MODULE:
    collect_seldom()
    # Snakemake would import pandas to learn whether a parameter is a table. Here, none is.
    sys.modules.setdefault("pandas", None)
# Snakemake runs several jobs at a time, so each job uses only one thread.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

SCHEMA = PROJECT / "workflow" / "schemas" / "config.schema.json"
SHIPPED = PROJECT / "config" / "config.yaml"
# A folder with recordings but without a configuration uses the configuration of the project.
CONFIG = Path("config/config.yaml") if Path("config/config.yaml").exists() else SHIPPED

try:
    if set("{}") & set(f"{PROJECT}{Path.cwd()}"):
        raise CapsuleError(
            f"{PROJECT}: rename this folder; Snakemake cannot work in a folder whose "
            "name holds { or }"
        )
    main_settings = read_config_file(SHIPPED if IS_MODULE else CONFIG)
except CapsuleError as error:
    raise WorkflowError(str(error)) from None

if IS_MODULE:
    # A workflow that uses this one as a module names only the keys that differ from the project's
    # configuration.
    given, config = config, copy.deepcopy(main_settings)
    update_config(config, given)
    sources = {"the configuration that ships with the capsule": main_settings}
    sources["config of the module"] = given
else:

    configfile: CONFIG

    sources = {os.path.relpath(CONFIG): main_settings}


try:
    if not IS_MODULE:
        # An error message names the source of a key. Later sources override earlier ones.
        for path in workflow.config_settings.configfiles:
            sources[os.path.relpath(path)] = read_config_file(path)
        sources["--config"] = workflow.config_settings.config
    check_configuration(config, read_schema(SCHEMA), sources)
    ARCHIVE = list_archive(Path(RAW))
    DETECTORS = [detector_row(name) for name in config["detectors"]]
except CapsuleError as error:
    raise WorkflowError(str(error)) from None

# Only the main process may mark results to be made again, and only while no run holds the lock.
# A job of a cluster starts another Snakemake, which is not the main process.
MAY_RENEW = workflow.is_main_process and not is_held(Path(".snakemake/run.lock"))
# Largest number of recordings that one job makes. No result depends on it.
PER_JOB = config["recordings_per_job"]
# Processes of each of two long jobs that run side by side. No result depends on it.
BESIDE_ANOTHER = 2 if (workflow.resource_settings.cores or 1) >= 4 else 1
RESULT_SECTIONS = sorted(config.keys() - {"recordings_per_job"})
if MAY_RENEW:
    leave_other_sets(Path(RESULTS), PER_JOB)
# One job searches a folder or a part of it, so a new recording repeats little of the search.
SEARCH_SETS = search_sets(ARCHIVE.recordings)
DETECTOR_MODULES = sorted({row.module for row in DETECTORS})
DETECTOR_SECTIONS = sorted({row.section for row in DETECTORS if row.section})
CHECK_SETTINGS = {name: config[name] for name in ("recording", "preprocessing")}
CHECK_SETTINGS["diagonal"] = {name: config["diagonal"][name] for name in BENCH}
TEMPLATE_SETTINGS = {
    "sensors": config["recording"]["sensors"],
    "first_peak": config["fit"]["first_peak"],
    "length": config["preprocessing"]["length"],
}


def code_files(name, *modules):
    """Return the paths of a script and of the modules that it imports or finds in a registry."""
    return [SCRIPTS / name, *imported_files(SCRIPTS / name, modules)]


def checksum_of_code(paths, *settings):
    """Return a checksum of files of code and of settings."""
    contents = [read_code(path.as_posix()) for path in paths]
    contents += [text(None).encode() for text in settings]
    return hashlib.sha256(b"\0".join(contents)).hexdigest()


def code_key(name, *settings, modules=()):
    """Return a checksum of a script's code and settings."""
    return checksum_of_code(code_files(name, *modules), *settings)


def with_members(key, *names):
    """Return a checksum of a key and the names of recordings."""
    return hashlib.sha256("\0".join([key, *names]).encode()).hexdigest()


# The outputs come from `rules`, not from an argument `output`: Snakemake does not notice a changed
# value of a parameter's function that has this argument.
def outputs_of(rule, wildcards):
    """Return the output files of a rule's job."""
    values = dict(wildcards.items())
    return tuple(str(path).format(**values) for path in getattr(rules, rule).output)


def forget(path):
    """Remove Snakemake's notes on a result; its record then decides whether it is made again."""
    workflow.persistence.cleanup_metadata(IOFile(path))


@functools.cache
def forget_changed_sets():
    """Remove Snakemake's notes on all results if recordings_per_job has changed."""
    if MAY_RENEW:
        forget_notes(Path(RESULTS), forget)


def made_from(rule, *settings, script=None, modules=(), members=()):
    """Return a rule's parameter that changes with its code, settings and members.

    Time stamps do not change it. It also changes if a job's results do not fit their record.
    Settings are the values of `section` and `as_parameter`. Members are the names of the
    recordings, or a function of the wildcards that returns them. Without `script`, the script has
    the rule's name.
    """
    fixed = code_key(script or f"{rule}.py", *settings, modules=modules)

    def told(wildcards):
        names = members(wildcards) if callable(members) else members
        outputs = outputs_of(rule, wildcards)
        forget_changed_sets()
        return parameter(f"{outputs[0]}:{with_members(fixed, *names)}", outputs, renew=MAY_RENEW)

    return told


def files_of(kind, recordings):
    """Return a function that gives the files of one kind, of these recordings, as a rule's input.

    The kind is one of signals, matrices, checks and fits. If a job makes a set of recordings,
    Snakemake follows the file of the set in place of the results that it lists. Recordings are
    names, or a function of the wildcards that returns them.

    A list would do, but Snakemake goes through a rule's list once for each file in it.
    """

    def files(wildcards):
        names = recordings(wildcards) if callable(recordings) else recordings
        if PER_JOB > 1:
            step = rules.fit_set if kind == "fits" else rules.preprocess_set
            return expand(step.output, set=sets_of(names))
        patterns = {
            "signals": rules.preprocess.output.signal,
            "matrices": rules.preprocess.output.matrix,
            "checks": rules.preprocess.output.check,
            "fits": rules.fit.output,
        }
        return expand(patterns[kind], recording=names)

    return files


def recordings_of_search_set(wildcards):
    """Return the recordings that one job searches, as a rule's parameter."""
    return SEARCH_SETS[wildcards.search_set]


def content_of_recording(wildcards):
    """Return a checksum of the recording's content, which does not depend on its time stamp."""
    limit = int(config["recording"]["max_megabytes"] * 1e6)
    return fingerprint(Path(RAW) / f"{wildcards.recording}.csv", limit)


def as_parameter(settings):
    """Return a function that gives the settings as JSON text, as a rule's parameter.

    A plain text would not do: Snakemake expands its braces.
    """
    text = json.dumps(settings, sort_keys=True)
    return lambda wildcards: text


def section(*names):
    """Return the named sections of the configuration, as a rule's parameter."""
    return as_parameter({name: config[name] for name in names})


wildcard_constraints:
    recording=r"[^/]+/[^/]+",
