# Where this project lies, and where its files lie in the folder that Snakemake works in. Both are
# the same folder unless another workflow uses this one as a module.
#
# takes: nothing
# gives: PROJECT, SCRIPTS, RAW, RESULTS, SESSIONS, IS_MODULE, and the functions raw_folder,
#        results_folder, own_file, script, report_file

import io
import os
import sys
import tarfile
from pathlib import Path

from snakemake.sourcecache import HostingProviderFile

# What the steps need of the project, and what tells the report its version and commit.
NEEDED = ["workflow", "config", "environment.yml", "pyproject.toml", ".git_archival.txt"]


def project_folder(rules):
    """Give the project's folder; of one that lies in a repository elsewhere, unpack a copy.

    A workflow that `module: snakefile: github(...)` names has no folder here, and its scripts
    import one another.
    """
    if not isinstance(rules, HostingProviderFile):
        return Path(rules.get_path_or_uri(secret_free=False)).resolve().parents[1]
    repository = rules.hosted_repo.repo
    folder = Path(".snakemake/capsule").resolve() / repository.commit(rules.ref).hexsha
    if not folder.is_dir():
        packed = repository.git.archive(rules.ref, *NEEDED, stdout_as_string=False)
        unfinished = folder.with_name(f"{folder.name}.{os.getpid()}")
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            archive.extractall(unfinished, filter="data")
        unfinished.replace(folder)
    return folder


PROJECT = project_folder(workflow.current_basedir)
SCRIPTS = PROJECT / "workflow" / "scripts"
if str(SCRIPTS) not in sys.path:
    sys.path.insert(0, str(SCRIPTS))

IS_MODULE = not workflow.modifier.is_main_snakefile()
# A module's prefix stands before each of them.
RAW, RESULTS, SESSIONS = (
    str(workflow.modifier.modify_path(name)) for name in ("raw", "results", "sessions")
)


def raw_folder(wildcards):
    """Hand a rule the folder of the recordings."""
    return RAW


def results_folder(wildcards):
    """Hand a rule the folder of the results."""
    return RESULTS


def own_file(path):
    """Name a file of this project relative to the working directory, whatever a module's prefix."""
    return local(os.path.relpath(path))


def script(name):
    """Name a script, as a rule's input."""
    return own_file(SCRIPTS / name)


def report_file(name):
    """Name a file of the report's template."""
    return own_file(PROJECT / "workflow" / "report" / name)
