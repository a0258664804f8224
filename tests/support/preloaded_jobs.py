"""The preloaded jobs of a test run, which all its calls of snakemake share.

They import the packages that the workflow needs, but not the project's code: each test may have its
own copy of that.
"""

from collections.abc import Mapping
from pathlib import Path

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
# The environment variable that tells Snakemake to start no preloaded jobs of its own.
PLAIN = {"CAPSULE_PRELOAD": "0"}


def jobs_of_tests(environment: Mapping[str, str], *, measured: bool) -> PreloadedJobs:
    """Start the process that runs the jobs; with `measured`, `coverage` counts their branches."""
    packages = [*PACKAGES, "coverage"] if measured else PACKAGES
    program = {"program": Path(__file__).with_name("measured_jobs.py")} if measured else {}
    return PreloadedJobs(packages, Path(__file__).parent, environment, **program)
