# What all rules share: the check of the configuration, the recordings under raw/, and the
# parameters that make exactly what changed run again.
#
# takes: config/config.yaml, workflow/schemas/config.schema.json, the names under raw/
# gives: ARCHIVE, and the functions script, report_file, as_parameter, section, content_of_...

import hashlib
import json
import os
import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version

min_version("9.10")

SCRIPTS = Path(workflow.basedir) / "workflow" / "scripts"
SCHEMA = SCRIPTS.parent / "schemas" / "config.schema.json"
sys.path.insert(0, str(SCRIPTS))

from capsule.configuration import check_configuration
from capsule.detectors.registry import detector_row
from capsule.errors import CapsuleError
from edges.config_files import read_config_file, read_schema
from edges.files import fingerprint, list_archive
from edges.sources import imported_files

# The jobs' "python" is the one that runs Snakemake, activated or not.
os.environ.update(PATH=os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()]))
# Jobs run side by side; threads inside one would only disturb the others.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

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
    check_configuration(config, read_schema(SCHEMA), sources)
    ARCHIVE = list_archive(Path("raw"))
    DETECTORS = [detector_row(name) for name in config["detectors"]]
except CapsuleError as error:
    raise WorkflowError(str(error)) from None

DETECTOR_MODULES = sorted({row.module for row in DETECTORS})
DETECTOR_SECTIONS = sorted({row.section for row in DETECTORS if row.section})
TEMPLATE_SETTINGS = {
    "sensors": config["recording"]["sensors"],
    "first_peak": config["fit"]["first_peak"],
    "length": config["preprocessing"]["length"],
}


def script(name):
    """Name a script relative to the working directory, as a rule's input."""
    return os.path.relpath(SCRIPTS / name)


def report_file(name):
    """Name a file of the report's template relative to the working directory."""
    return os.path.relpath(SCRIPTS.parent / "report" / name)


def code_files(name, *modules):
    """List a script, and the modules that it imports or finds in a registry."""
    return [SCRIPTS / name, *imported_files(SCRIPTS / name, modules)]


def content_of_code(name, *modules):
    """Hand a rule what changes with its code, whatever the files' time stamps say."""
    contents = [path.read_bytes() for path in code_files(name, *modules)]
    return hashlib.sha256(b"\0".join(contents)).hexdigest()


def content_of_recording(wildcards):
    """Hand a rule what changes with a recording's content, whatever its time stamp says."""
    limit = int(config["recording"]["max_megabytes"] * 1e6)
    return fingerprint(Path("raw") / f"{wildcards.recording}.csv", limit)


def as_parameter(settings):
    """Hand settings to a rule as one parameter; a function, since Snakemake expands braces."""
    text = json.dumps(settings, sort_keys=True)
    return lambda wildcards: text


def section(*names):
    """Hand a rule its own sections of the configuration."""
    return as_parameter({name: config[name] for name in names})


wildcard_constraints:
    recording=r"[^/]+/[^/]+",
