"""What a job runs is what its key was computed from: code that changes during a run stops the job.

A run notes the state of each file of its code when it reads it. A job compares before it writes.
The state of a file differs also when it was changed and put back in between, with its dates.

The Snakefile and every script use this module, so it imports only fast modules.
"""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from capsule.errors import CapsuleError

# In the working directory: the state of each file that a script's key was computed from.
STATES = Path(".snakemake/run.code")

State = list[int]


def states_of(paths: Iterable[Path]) -> dict[str, State]:
    """Return the state of each file, whose path must be absolute."""
    return {str(path): _state(path) for path in paths}


def refuse_changed_code(script: str) -> None:
    """Raise an error if code of a script has changed since the run noted its state in `STATES`."""
    try:
        noted: Mapping[str, Mapping[str, State]] = json.loads(STATES.read_bytes())
    except FileNotFoundError:
        return
    for path, before in noted.get(str(Path(script).resolve()), {}).items():
        if _state(Path(path)) != before:
            raise CapsuleError(
                f"{path} has changed since the run began, so nobody knows which of both this job "
                "has read; run the command again"
            )


def _state(path: Path) -> State:
    """Return what a change of a file changes, even if it is undone; all zeros without the file."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return [0, 0, 0, 0]
    return [found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino]
