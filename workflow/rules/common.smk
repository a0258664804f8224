# What all rules share: the check of the configuration, the recordings under raw/, and the
# inputs and parameters that make exactly what changed run again.
#
# takes: config/config.yaml, workflow/schemas/config.schema.json, the names under raw/
# gives: ARCHIVE, the functions script, library, section and content_of_..., and the start of a run:
#        its lock, and what a killed one left behind

import atexit
import hashlib
import json
import os
import shutil
import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version

min_version("9.10")

SCRIPTS = Path(workflow.basedir) / "workflow" / "scripts"
SCHEMA = SCRIPTS.parent / "schemas" / "config.schema.json"
sys.path.insert(0, str(SCRIPTS))

from capsule.configuration import check_configuration
from capsule.errors import CapsuleError
from capsule.evaluation.columns import COLUMNS as JUDGEMENTS
from capsule.naming import folder_of
from edges.config_files import read_config_file
from edges.durations import RULES
from edges.files import fingerprint, list_archive, read_csv, remove_unfinished
from edges.run_lock import hold
from edges.sources import imported_files

# The jobs' "python" is the one that runs Snakemake, activated or not.
os.environ.update(PATH=os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()]))
# Jobs run side by side; threads inside one would only disturb the others.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

# With less room than this no run gets far.
FULL_DISK_BYTES = 1_000_000

try:
    if set("{}") & set(str(workflow.basedir)):
        raise CapsuleError(
            f"{workflow.basedir}: rename this folder; Snakemake cannot work where a name holds "
            "{ or }"
        )
    main_settings = read_config_file(Path("config/config.yaml"))
except CapsuleError as error:
    raise WorkflowError(str(error)) from None


configfile: "config/config.yaml"


try:
    # Which source gives a key: the later ones override the earlier ones.
    sources = {"config/config.yaml": main_settings}
    for path in workflow.config_settings.configfiles:
        sources[os.path.relpath(path)] = read_config_file(path)
    sources["--config"] = workflow.config_settings.config
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    check_configuration(config, schema, sources)
    ARCHIVE = list_archive(Path("raw"))
except CapsuleError as error:
    raise WorkflowError(str(error)) from None

TEMPLATE_SETTINGS = {
    "sensors": config["recording"]["sensors"],
    "first_peak": config["fit"]["first_peak"],
    "length": config["preprocessing"]["length"],
}


def script(name):
    """Name a script relative to the working directory, as a rule's input."""
    return os.path.relpath(SCRIPTS / name)


def library(name):
    """List the library modules that a script imports, so that an edit runs it again."""
    return [os.path.relpath(path) for path in imported_files(SCRIPTS / name)]


def report_file(name):
    """Name a file of the report's template relative to the working directory."""
    return os.path.relpath(SCRIPTS.parent / "report" / name)


def as_parameter(settings):
    """Hand settings to a rule as one parameter; a function, since Snakemake expands braces."""
    text = json.dumps(settings, sort_keys=True)
    return lambda wildcards: text


def content_of_recording(wildcards):
    """Hand a rule what changes with a recording's content, whatever its time stamp says."""
    limit = int(config["recording"]["max_megabytes"] * 1e6)
    return fingerprint(Path("raw") / f"{wildcards.recording}.csv", limit)


def content_of_code(name):
    """Hand a rule what changes with a script and its modules, whatever their time stamps say."""
    sources = [SCRIPTS / name, *imported_files(SCRIPTS / name)]
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sources)).hexdigest()


def section(*names):
    """Hand a rule its own sections of the configuration."""
    return as_parameter({name: config[name] for name in names})


def summarize_recordings():
    """Say on the terminal what was rejected or passed over."""
    index, others = Path("results/recordings.csv"), Path("results/passed_over.csv")
    if not index.exists() or not others.exists():
        return
    rows = read_csv(index)
    rejected = [row for row in rows if row["status"] != "accepted"]
    print(
        f"{len(rows) - len(rejected)} recordings accepted, {len(rejected)} rejected.",
        file=sys.stderr,
    )
    for row in rejected:
        print(f"  rejected: raw/{row['recording']}: {row['reason']}", file=sys.stderr)
    for row in read_csv(others):
        print(f"  passed over: raw/{row['path']}: {row['reason']}", file=sys.stderr)


# Kept open, and so locked, until this process ends.
RUN_LOCK = []


def take_run_lock():
    """Let no two runs work in this folder at once."""
    try:
        RUN_LOCK.append(hold(Path(".snakemake") / "run.lock"))
    except CapsuleError as error:
        raise WorkflowError(str(error)) from None


def free_bytes():
    """Give the room on the disks that hold the results and Snakemake's own notes."""
    places = [place for place in (".", "results") if Path(place).exists()]
    return min(shutil.disk_usage(place).free for place in places)


def explain_full_disk():
    """Say that the disk is full: a job's log, or Snakemake's, may have found no room for it."""
    if free_bytes() < FULL_DISK_BYTES:
        print(
            f"{free_bytes() / 1e6:.1f} MB are free on the disk: no space left to work with. "
            "Make room and run the same command again: what is finished stays.",
            file=sys.stderr,
        )


wildcard_constraints:
    recording=r"[^/]+/[^/]+",


onstart:
    take_run_lock()
    remove_unfinished(Path("results"))
    # Not onerror: where Snakemake itself finds no room, it ends without calling that.
    atexit.register(explain_full_disk)
    if free_bytes() < FULL_DISK_BYTES:
        raise WorkflowError("no space left on device, nothing was started")
