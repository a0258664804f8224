"""Names of the recordings in the report that tests open in a browser, and helpers for it."""

import time

SIZES = (0, 1, 2.5, 6)
RECORDINGS = [f"{size}mm/r{run:02d}" for size in SIZES for run in (1, 2, 3)] + ["unlabelled/u1"]
EVIL = "<script>document.title='broken'</script><img src=x onerror=\"document.title='broken'\">"


def wait_for_title(browser, start):
    """Wait until the viewer shows a recording; the page reacts to a new address with a delay."""
    title, deadline = browser.find("#viewer-title"), time.monotonic() + 10
    while not title.text.startswith(start) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert title.text.startswith(start)
