"""Serve the calls of preloaded jobs, and count which branches of the code the jobs run.

A process of its own runs this file. It imports no module of the project: each job imports those of
its own copy.
"""

import contextlib
import json
import runpy
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
# Each script runs the same branches again and again, so that only so many calls are measured.
MEASURED_CALLS = 3


@contextlib.contextmanager
def count_branches() -> Iterator[None]:
    """Count the branches that run, in a file that `pytest --cov` adds to its own."""
    import coverage

    counted = coverage.Coverage(
        data_file=str(ROOT / ".coverage"),
        data_suffix=True,
        config_file=str(ROOT / "pyproject.toml"),
    )
    with counted.collect():
        yield
    counted.save()


def main() -> None:
    """Measure the first calls of each script."""
    calls: Counter[str] = Counter()

    def measured(script: str) -> contextlib.AbstractContextManager[object]:
        name = Path(script).name
        calls[name] += 1
        return count_branches() if calls[name] <= MEASURED_CALLS else contextlib.nullcontext()

    jobs = runpy.run_path(str(ROOT / "workflow" / "scripts" / "edges" / "preloaded_jobs.py"))
    jobs["serve"](*json.loads(sys.argv[1]), measured)


if __name__ == "__main__":
    main()
