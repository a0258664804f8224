"""The archive whose report the tests open in a browser, and what they ask of the page."""

import csv
import time

SIZES = (0, 1, 2.5, 6)
RECORDINGS = [f"{size}mm/r{run:02d}" for size in SIZES for run in (1, 2, 3)] + ["unlabelled/u1"]
EVIL = "<script>document.title='broken'</script><img src=x onerror=\"document.title='broken'\">"


def table(project, name):
    """Read a table of results."""
    with (project.results / name).open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def wait_for_title(browser, start):
    """Wait until the viewer shows a recording: the page hears of a new address a moment later."""
    title, deadline = browser.find("#viewer-title"), time.monotonic() + 10
    while not title.text.startswith(start) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert title.text.startswith(start)
