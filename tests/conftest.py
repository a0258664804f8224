"""What all tests share."""

import pytest

# Marks of tests that take seconds each.
SLOW = {"workflow", "packages", "browser"}


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
    """Begin with the files whose tests take longest, so that no worker is left alone with them."""
    slow = {item.path for item in items if SLOW & {mark.name for mark in item.iter_markers()}}
    items.sort(key=lambda item: item.path not in slow)
