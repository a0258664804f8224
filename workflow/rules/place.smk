# Paths of the project's files and of the working directory. Both are the same folder unless another
# workflow uses this one as a module.
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

# The steps need these files. The report reads its version and commit from the last two.
NEEDED = ["workflow", "config", "environment.yml", "pyproject.toml", ".git_archival.txt"]


def project_folder(rules):
    """Return the project's folder; unpack a copy of it if the project is in a remote repository.

    The scripts import one another, so they need a folder. A workflow that `module: snakefile:
    github(...)` names has none on this computer.
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

IS_MODULE = workflow.modifier.parent_modifier is not None
# In a module, the prefix of the module precedes each of these paths.
RAW, RESULTS, SESSIONS = (
    str(workflow.modifier.modify_path(name)) for name in ("raw", "results", "sessions")
)


def raw_folder(wildcards):
    """Return the folder of the recordings, as a rule's parameter."""
    return RAW


def results_folder(wildcards):
    """Return the folder of the results, as a rule's parameter."""
    return RESULTS


def own_file(path):
    """Return the path of a project's file from the working directory, without a module's prefix."""
    return local(os.path.relpath(path))


def script(name):
    """Return the path of a script, as a rule's input."""
    return own_file(SCRIPTS / name)


def report_file(name):
    """Return the path of a file under workflow/report, as a rule's input."""
    return own_file(PROJECT / "workflow" / "report" / name)
