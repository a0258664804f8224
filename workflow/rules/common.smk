# What all rules share: the check of the configuration, the recordings under raw/, and the
# parameters that make exactly what changed run again.
#
# takes: config/config.yaml, workflow/schemas/config.schema.json, the names under raw/
# gives: ARCHIVE, and the functions as_parameter, section, made_from, content_of_recording

import copy
import hashlib
import json
import os
import shlex
import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version, update_config

min_version("9.10")

from capsule.configuration import BENCH, check_configuration
from capsule.detectors.registry import detector_row
from capsule.errors import CapsuleError
from edges.config_files import read_config_file, read_schema
from edges.files import fingerprint, list_archive
from edges.records import parameter
from edges.run_lock import is_held
from edges.sources import imported_files

# The jobs' "python" is the one that runs Snakemake, activated or not.
os.environ.update(PATH=os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()]))
# Jobs run side by side; threads inside one would only disturb the others.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

SCHEMA = PROJECT / "workflow" / "schemas" / "config.schema.json"
SHIPPED = PROJECT / "config" / "config.yaml"
# A folder that holds recordings and no configuration takes the one that ships with the project.
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
    # Who uses this workflow as a module gives only what differs from the shipped configuration.
    given, config = config, copy.deepcopy(main_settings)
    update_config(config, given)
    sources = {"the configuration that ships with the capsule": main_settings}
    sources["config of the module"] = given
else:

    configfile: CONFIG

    sources = {os.path.relpath(CONFIG): main_settings}


try:
    if not IS_MODULE:
        # Which source gives a key: the later ones override the earlier ones.
        for path in workflow.config_settings.configfiles:
            sources[os.path.relpath(path)] = read_config_file(path)
        sources["--config"] = workflow.config_settings.config
    check_configuration(config, read_schema(SCHEMA), sources)
    ARCHIVE = list_archive(Path(RAW))
    DETECTORS = [detector_row(name) for name in config["detectors"]]
except CapsuleError as error:
    raise WorkflowError(str(error)) from None

# Not the jobs of a cluster, which start Snakemake anew, nor beside a run that is at work.
MAY_RENEW = workflow.is_main_process and not is_held(Path(".snakemake/run.lock"))
DETECTOR_MODULES = sorted({row.module for row in DETECTORS})
DETECTOR_SECTIONS = sorted({row.section for row in DETECTORS if row.section})
TEMPLATE_SETTINGS = {
    "sensors": config["recording"]["sensors"],
    "first_peak": config["fit"]["first_peak"],
    "length": config["preprocessing"]["length"],
}


def code_files(name, *modules):
    """List a script, and the modules that it imports or finds in a registry."""
    return [SCRIPTS / name, *imported_files(SCRIPTS / name, modules)]


def made_from(rule, *settings, script=None, modules=(), members=()):
    """Give what changes with a rule's code, settings and members, whatever time stamps say.

    It changes too where the job's results do not fit their record. Settings are what `section` and
    `as_parameter` give; members are the names of the recordings, or a function of the wildcards that
    gives them. The script is called as the rule, unless it is named.
    """
    contents = [path.read_bytes() for path in code_files(script or f"{rule}.py", *modules)]
    contents += [text(None).encode() for text in settings]
    fixed = hashlib.sha256(b"\0".join(contents)).hexdigest()

    # Of a function that takes the output, Snakemake would not notice that its value has changed.
    def told(wildcards):
        names = members(wildcards) if callable(members) else members
        key = hashlib.sha256("\0".join([fixed, *names]).encode()).hexdigest()
        values = dict(wildcards.items())
        outputs = tuple(str(path).format(**values) for path in getattr(rules, rule).output)
        return parameter(f"{outputs[0]}:{key}", outputs, renew=MAY_RENEW)

    return told


def content_of_recording(wildcards):
    """Hand a rule what changes with a recording's content, whatever its time stamp says."""
    limit = int(config["recording"]["max_megabytes"] * 1e6)
    return fingerprint(Path(RAW) / f"{wildcards.recording}.csv", limit)


def as_parameter(settings):
    """Hand settings to a rule as one parameter; a function, since Snakemake expands braces."""
    text = json.dumps(settings, sort_keys=True)
    return lambda wildcards: text


def section(*names):
    """Hand a rule its own sections of the configuration."""
    return as_parameter({name: config[name] for name in names})


wildcard_constraints:
    recording=r"[^/]+/[^/]+",
