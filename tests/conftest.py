"""What all tests share."""

import os
from collections import defaultdict

# Before numpy is there. Tests run side by side, and threads inside one only disturb the others.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import pytest

from support.preloaded import PreloadedSnakemake
from support.project import Project

# How many seconds of a processor tests with these marks take, about; `slow(60)` gives its own.
SECONDS = {"workflow": 4.0, "packages": 4.0, "browser": 0.5, "slow": 4.0}
# Tests that mostly wait leave the processors to others.
WAITING = "waits"
# What keeps a test from being a quick one.
LENGTHY = {*SECONDS, WAITING, "boards", "slicer", "cad"}


def pytest_addoption(parser):
    parser.addoption(
        "--no-skips", action="store_true", help="count a skipped test as a failure, as CI does"
    )


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    report = (yield).get_result()
    if report.skipped and not hasattr(report, "wasxfail") and item.config.option.no_skips:
        reason = call.excinfo.value if call.excinfo else "no reason given"
        report.outcome = "failed"
        report.longrepr = f"{item.nodeid} was skipped, which --no-skips forbids: {reason}"


# Before pytest looks for what `-m` asks for.
@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark the quick tests; begin with the files that take longest.

    So no worker is left alone with a long file at the end.
    """
    for item in items:
        if not any(mark.name in LENGTHY for mark in item.iter_markers()):
            item.add_marker("quick")
    waiting = {item.path for item in items if item.get_closest_marker(WAITING)}
    seconds = defaultdict(float)
    for item in items:
        marks = [mark for mark in item.iter_markers() if mark.name in SECONDS]
        told = [mark.args[0] if mark.args else SECONDS[mark.name] for mark in marks]
        seconds[item.path] += max(told, default=0.0)
    items.sort(key=lambda item: (item.path not in waiting, -seconds[item.path]))


@pytest.fixture(scope="session", autouse=True)
def preloaded_snakemake(pytestconfig):
    """Import Snakemake once for all its calls; `make` and the plain command start it anew."""
    measured = bool(pytestconfig.getoption("cov_source", default=None))
    with PreloadedSnakemake(measured=measured) as preloaded:
        Project.preloaded_for_all = preloaded
        yield preloaded
        Project.preloaded_for_all = None
