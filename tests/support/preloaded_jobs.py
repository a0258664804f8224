"""The preloaded jobs of a test run, which all its calls of snakemake share.

They import the packages that the workflow needs, but not the project's code: each test may have its
own copy of that.
"""

import contextlib
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

from edges import preloaded_jobs
from edges.preloaded_jobs import PreloadedJobs

PACKAGES = [
    "numpy",
    "pandas",
    "scipy.optimize",
    "scipy.signal",
    "scipy.special",
    "scipy.stats",
    "matplotlib.figure",
    "matplotlib.backends.backend_svg",
    "jinja2",
    "jsonschema",
    "yaml",
]
TESTS = Path(__file__).parents[1]
ROOT = TESTS.parent
# Each script runs the same branches again and again, so that only so many calls are measured.
MEASURED_CALLS = 3
# The environment variable that tells Snakemake to start no preloaded jobs of its own.
PLAIN = {"CAPSULE_PRELOAD": "0"}


def jobs_of_tests(environment: Mapping[str, str], *, measured: bool) -> PreloadedJobs:
    """Start the process that runs the jobs; with `measured`, `coverage` counts their branches."""
    packages = [*PACKAGES, "coverage"] if measured else PACKAGES
    serving = f"{__name__}:serve_measured" if measured else "edges.preloaded_jobs:serve"
    search = [TESTS, ROOT / "workflow" / "scripts"]
    return PreloadedJobs(packages, search, environment, serving)


def serve_measured(listening: int, alive: int, folder: str, modules: list[str]) -> None:
    """Serve calls, and count the branches that the first calls of each script run."""
    calls: Counter[str] = Counter()

    def measured(script: str) -> contextlib.AbstractContextManager[object]:
        name = Path(script).name
        calls[name] += 1
        return count_branches() if calls[name] <= MEASURED_CALLS else contextlib.nullcontext()

    preloaded_jobs.serve(listening, alive, folder, modules, measured)


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


def start_of(module: str, handle: int) -> list[str]:
    """Return the command that serves a module's calls on a socket."""
    code = (
        f"import socket, sys; sys.path[0] = {str(TESTS)!r}; import {module} as served; "
        f"served.serve(socket.socket(fileno={handle}))"
    )
    return [sys.executable, "-c", code]
