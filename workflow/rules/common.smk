# Shared by all rules: check the configuration, list the recordings under raw/, divide them into
# batches, and define the parameters that make Snakemake run a job again.
#
# takes: config/config.yaml, workflow/schemas/config.schema.json, the files under raw/
# gives: ARCHIVE, DIVISION, BATCHES, LABELLED, NODULES, DESCRIBED, PARTS, DETECTOR_MODULES,
#        DETECTOR_SECTIONS, WITHOUT_EFFECT, and the functions from `sections` on

import copy
import functools
import json
import sys

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version, update_config

min_version("9.16")

from capsule.detectors.registry import detector_row
from capsule.engine.configuration import BENCH, changed_values, check_configuration, without_effect
from capsule.engine.configuration import read_config_file, read_schema
from capsule.engine.jobs import states_of
from capsule.engine.keys import Step, checksum_of_code, files_of_code
from capsule.engine.project import config_file
from capsule.engine.run import refuse_folders, refuse_unknown_results, told_as
from capsule.recordings.held_out import fitted
from capsule.recordings.names import size_mm
from capsule.store import files
from capsule.store.results import divide, pattern

# A job's "python" is the interpreter that runs Snakemake, even if its environment is not activated.
os.environ.update(PATH=os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()]))
# Snakemake runs several jobs at a time, so each job uses only one thread.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

SCHEMA = PROJECT / "workflow" / "schemas" / "config.schema.json"
WEIGHTS = PROJECT / "workflow" / "weights" / "scorer.npz"
REPORT_FILES = PROJECT / "workflow" / "report"
SHIPPED = PROJECT / "config" / "config.yaml"
# A folder with recordings but without a configuration uses the configuration of the project.
CONFIG = config_file()

# Snakemake's own reader names no file, so this one reads the file first.
with told_as(WorkflowError):
    main_settings = read_config_file(SHIPPED if IS_MODULE else CONFIG)

if IS_MODULE:
    # A workflow that uses this one as a module names only the keys that differ.
    changed, config = config, copy.deepcopy(main_settings)
    update_config(config, changed)
else:

    configfile: CONFIG

    changed = changed_values(main_settings, config)


# An error message names the source of a key.
SOURCES = {
    os.path.relpath(SHIPPED if IS_MODULE else CONFIG): main_settings,
    "config of the module" if IS_MODULE else "--config or --configfile": changed,
}
with told_as(WorkflowError):
    refuse_folders(PROJECT, Path.cwd())
    WITHOUT_EFFECT = without_effect(config, read_schema(SCHEMA))
    config = check_configuration(config, read_schema(SCHEMA), SOURCES)
    ARCHIVE = files.list_archive(Path(RAW))
    DETECTORS = [detector_row(name) for name in config["detectors"]]
    refuse_unknown_results(Path(RESULTS), Path(".snakemake"))

# The recordings of each batch, all of one folder; those of the rules describe and plot join batches.
DIVISION = divide(ARCHIVE.recordings, config["recordings_per_job"])
BATCHES, DESCRIBED, PARTS = DIVISION.batches, DIVISION.described, DIVISION.joined()
LABELLED = [batch for batch in BATCHES if size_mm(batch) is not None]
# Recordings that are fitted, by batch: those of nodules that are not held out.
NODULES = fitted(BATCHES, Path(RAW), config["evaluation"]["held_out"])
DESCRIBED_LABELLED = [batch for batch in DESCRIBED if size_mm(batch) is not None]
DETECTOR_MODULES = sorted({row.module for row in DETECTORS})
DETECTOR_SECTIONS = sorted(config.keys() & config["detectors"])
# The state of each file of code when its key is computed, by the script of the jobs.
STATES_OF_CODE = {}


def sections(*names, **others):
    """Return sections of the configuration, and other settings, by their names."""
    return {name: config[name] for name in names} | others


def step(name, settings, inputs, *, modules=(), beside=()):
    """Return the `capsule.engine.keys.Step` of a rule, whose script has its name.

    `modules` and `beside` are as in `capsule.engine.keys.files_of_code`.
    """
    path = SCRIPTS / f"{name}.py"
    code = files_of_code(path, modules, beside)
    STATES_OF_CODE[str(path.resolve())] = states_of(code)
    settings = json.dumps(settings, sort_keys=True)
    return Step(name, path, settings, checksum_of_code(code), inputs)


def stored(kind):
    """Return the results of one kind, such as signals, with ``{batch}`` in their path."""
    return f"results/{pattern(kind, alone=DIVISION.alone)}"


def told(step):
    """Return the parameters that all rules have; a changed one makes a job run again.

    As parameters of their own, settings and code show in Snakemake's reasons. Functions give what
    Snakemake would expand, or lint, as plain text.
    """
    return {
        # Snakemake notes no parameter that is a function of the output: this one changes with the
        # place of a folder of recordings beside the project.
        "script": lambda wildcards, output: os.path.relpath(step.script),
        "raw": RAW,
        "results": lambda wildcards: RESULTS,
        "settings": lambda wildcards: step.settings,
        "code": step.code,
        "key": lambda wildcards: step.key(*wildcards),
    }


def shown(files, caption, category):
    """Return output files that Snakemake's own report lists."""
    return report(files, caption=f"../report/captions/{caption}.rst", category=category)


def each(rule, batches, output=0):
    """Return a function that gives an output of the jobs of some batches, as a rule's input.

    A list would do, but Snakemake goes through a rule's list once for each file in it.
    """
    return lambda wildcards: expand(getattr(rules, rule).output[output], batch=batches)


def each_part(output):
    """Return a function as `each` does, for the batches that one of describe joins."""
    return lambda wildcards: expand(rules.preprocess.output[output], batch=PARTS[wildcards.batch])


@functools.cache
def contents_of(batch):
    """Return the files of the recordings of a batch, with the checksums of their content."""
    limit = int(config["recording"]["max_megabytes"] * 1e6)
    paths = [f"{RAW}/{name}.csv" for name in BATCHES[batch]]
    return [f"{path}={files.fingerprint(Path(path), limit)}" for path in paths]


wildcard_constraints:
    batch="[^/]+/[^/]+",
    survey="[^/]+",
