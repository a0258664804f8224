"""Fixtures, options and the order of the tests."""

import gc
import os
from collections import defaultdict

# This must come before the import of numpy. Several tests run at a time, so each uses one thread.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import hypothesis
import pytest

from support.project import Project

# No law depends on the time of its computation. Every run tries the same examples, so that a change
# fails or passes for itself; `--hypothesis-profile=anew` tries others each time.
hypothesis.settings.register_profile("anew", deadline=None, max_examples=50)
hypothesis.settings.register_profile(
    "tests", parent=hypothesis.settings.get_profile("anew"), derandomize=True
)
hypothesis.settings.load_profile("tests")

# Approximate processor time, in s, of tests with these marks; `takes(60)` gives the time itself.
SECONDS = {"workflow": 4.0, "packages": 4.0, "boards": 1.5, "browser": 6.0, "takes": 4.0}
# Mark of tests that mostly wait, so other tests can use the processors.
WAITING = "waits"
# Marks of tests that need other programs, such as a browser: they are slow as well.
FOREIGN = {"boards", "browser", "cad", "packages", "slicer"}
# Marks of tests that are not quick.
LENGTHY = {*SECONDS, *FOREIGN, WAITING, "slow"}


def pytest_configure(config):
    """Have the jobs of the workflow count branches, too, where `--cov` counts them."""
    Project.measured = bool(config.getoption("cov_source", default=None))


def pytest_addoption(parser):
    parser.addoption(
        "--no-skips", action="store_true", help="count a skipped test as a failure, as CI does"
    )


@pytest.hookimpl(hookwrapper=True)
def pytest_collection():
    """Look for no garbage among modules and tests, which stay until the end."""
    gc.disable()
    yield
    gc.freeze()
    gc.enable()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    report = (yield).get_result()
    if report.skipped and not hasattr(report, "wasxfail") and item.config.option.no_skips:
        reason = call.excinfo.value if call.excinfo else "no reason given"
        report.outcome = "failed"
        report.longrepr = f"{item.nodeid} was skipped, which --no-skips forbids: {reason}"


# Runs before pytest selects tests by `-m`.
@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark the quick and the slow tests; sort the files by their time, longest first.

    Then no worker starts a long file last.
    """
    for item in items:
        marks = {mark.name for mark in item.iter_markers()}
        if not marks & LENGTHY:
            item.add_marker("quick")
        if marks & FOREIGN:
            item.add_marker("slow")
    waiting = {item.path for item in items if item.get_closest_marker(WAITING)}
    seconds = defaultdict(float)
    for item in items:
        marks = [mark for mark in item.iter_markers() if mark.name in SECONDS]
        told = [mark.args[0] if mark.args else SECONDS[mark.name] for mark in marks]
        seconds[item.path] += max(told, default=0.0)
    items.sort(key=lambda item: (item.path not in waiting, -seconds[item.path]))


@pytest.fixture(autouse=True)
def no_run():
    """Forget the name of a run that a test has begun in this process."""
    yield
    os.environ.pop("CAPSULE_RUN", None)
