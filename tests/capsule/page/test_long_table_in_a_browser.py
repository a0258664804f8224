"""The page of a large archive: its table lists a part of the recordings, and more when asked.

Few recordings are enough to see it: the table begins with three rows.
"""

import json
import runpy
import sys

import pytest

from capsule.engine.configuration import read_config_file
from capsule.page import recordings
from capsule.survey.listed import list_surveys
from support.browser import needed
from support.project import ROOT
from support.report_page import RECORDINGS

pytestmark = [
    pytest.mark.browser,
    needed,
]
LISTED = "return [...document.querySelectorAll('#recordings-table tbody tr')].map((row) => "
NAMES = LISTED + "row.dataset.recording)"


@pytest.fixture(scope="module")
def large(project, tmp_path_factory):
    """Make the page of the archive as that of a large one."""
    folder = tmp_path_factory.mktemp("large")
    surveys = list_surveys(project.folder / "sessions")
    settings = read_config_file(project.folder / "config" / "config.yaml")
    settings["surveys"] = {"names": surveys.names, "passed_over": surveys.passed_over}
    script = ROOT / "workflow" / "scripts" / "report.py"
    command = [script, "--results", project.results, "--key", "0" * 20]
    command += ["--settings", json.dumps(settings), "--output", folder / "report.html"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recordings, "MAX_ROWS", 4)
        patch.setattr(recordings, "FIRST_ROWS", 3)
        patch.setattr(sys, "argv", [*map(str, command)])
        runpy.run_path(str(script), run_name="__main__")
    return folder / "report.html"


def test_the_table_lists_some_rows_and_more_when_asked(browser, large):
    everything = [*RECORDINGS, "1mm/empty", "1mm/wrong"]
    browser.open(large)
    assert browser.run(NAMES) == ["0mm/r01", "0mm/r02", "0mm/r03"]
    said = f"{len(everything)} of {len(everything)} fit, the first 3 are listed"
    assert browser.find("#shown").text == said
    browser.find("#list-more").click()
    assert len(browser.run(NAMES)) == 6
    for _ in range(3):
        browser.run("document.getElementById('list-more').click()")
    assert sorted(browser.run(NAMES)) == sorted(everything)
    assert not browser.find("#list-more").is_displayed()


def test_sorting_search_and_the_file_see_the_rows_that_are_not_listed(browser, large):
    browser.open(large)
    browser.find("#recordings-table th:nth-child(1) button").click()
    browser.find("#recordings-table th:nth-child(1) button").click()
    assert browser.run(NAMES)[0] == "unlabelled/u1"
    browser.find("#search").send_keys("r02")
    assert browser.run(NAMES) == ["6mm/r02", "2.5mm/r02", "1mm/r02"]
    browser.run(
        "const make = URL.createObjectURL; URL.createObjectURL = (blob) => {"
        "window.saved = blob.text(); return make(blob); }"
    )
    browser.run("document.querySelector('[aria-label$=\"as CSV: all recordings\"]').click()")
    saved = browser.driver.execute_async_script("window.saved.then(arguments[0])")
    assert [line.split(",")[0] for line in saved.splitlines()[1:]] == [
        "6mm/r02", "2.5mm/r02", "1mm/r02", "0mm/r02",
    ]  # fmt: skip
    assert len(browser.run(NAMES)) == 3
    browser.find("#list-more").click()
    assert browser.run(NAMES)[-1] == "0mm/r02"
    assert browser.find("#shown").text.startswith("4 of ")


def test_a_switch_reaches_rows_that_are_listed_later(browser, large, page):
    verdicts = LISTED + "[row.dataset.recording, row.cells[2].textContent])"
    switch = (
        "const box = document.querySelector('.switches select'); box.value = 'diagonal';"
        "box.dispatchEvent(new Event('change', { bubbles: true }));"
    )
    browser.open(page)
    browser.run(switch)
    whole = browser.run(verdicts)
    browser.open(large)
    browser.run(switch)
    for _ in range(5):
        browser.run("document.getElementById('list-more').click()")
    assert browser.run(verdicts) == whole
