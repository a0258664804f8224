# Paths of the project's files and of the working directory. Both are the same folder unless another
# workflow uses this one as a module. Only this file uses inner parts of Snakemake: it has no other
# way to find out the prefix of a module, and the files of one that lies in a remote repository.
#
# takes: nothing
# gives: PROJECT, SCRIPTS, RAW, RESULTS, SESSIONS, IS_MODULE

import io
import os
import sys
import tarfile
from pathlib import Path

from snakemake.sourcecache import HostingProviderFile

# The steps need these files. The report reads its version and commit from the last two.
NEEDED = ["workflow", "config", "pyproject.toml", ".git_archival.txt"]


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
