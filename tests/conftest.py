"""What all tests share."""

from collections import Counter

import pytest

from support.preloaded import PreloadedSnakemake
from support.project import Project

# Marks of tests that take seconds each; those that mostly wait leave the processors to others.
SLOW = {"workflow", "packages", "browser", "slow"}
WAITING = "waits"


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


def pytest_collection_modifyitems(items):
    """Begin with the files that take longest, so that no worker is left alone with them."""
    marks = {item: {mark.name for mark in item.iter_markers()} for item in items}
    waiting = {item.path for item in items if WAITING in marks[item]}
    slow = Counter(item.path for item in items if SLOW & marks[item])
    items.sort(key=lambda item: (item.path not in waiting, -slow[item.path]))


@pytest.fixture(scope="session", autouse=True)
def preloaded_snakemake():
    """Import Snakemake once for all its calls; `make` and the plain command start it anew."""
    with PreloadedSnakemake() as preloaded:
        Project.preloaded_for_all = preloaded
        yield
        Project.preloaded_for_all = None
