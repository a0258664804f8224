"""The page of a large archive: what it draws stands beside it, and is read when it is needed.

Few recordings are enough to see it: a file holds four, and the table begins with three rows.
"""

import json
import re
import runpy
import shutil
import sys

import pytest

from capsule.configuration import read_config_file
from capsule.page import beside, recordings
from capsule.survey.listed import list_surveys
from support.browser import needed
from support.project import ROOT
from support.report_page import EVIL, RECORDINGS, wait_for_title

pytestmark = [
    pytest.mark.browser,
    needed,
]
LISTED = "return [...document.querySelectorAll('#recordings-table tbody tr')].map((row) => "
NAMES = LISTED + "row.dataset.recording)"
WATCH_FILES = (
    "window.filesRead = []; const receive = EvidenceStore.receive;"
    "EvidenceStore.receive = (file, texts) => { filesRead.push(file); receive(file, texts); }"
)
DATA_FILE = r'EvidenceStore\.receive\("[0-9a-f-]+",\[\["[\w+/=",\[\]]+"\]\]\);\n'


@pytest.fixture(scope="module")
def large(project, tmp_path_factory):
    """Make the page of the archive as that of a large one."""
    folder = tmp_path_factory.mktemp("large")
    surveys = list_surveys(project.folder / "sessions")
    settings = read_config_file(project.folder / "config" / "config.yaml")
    settings["surveys"] = {"names": surveys.names, "passed_over": surveys.passed_over}
    script = ROOT / "workflow" / "scripts" / "report.py"
    command = [script, "--results", project.results, "--batch-size", 1, "--key", "0" * 20]
    command += ["--settings", json.dumps(settings), "--output", folder / "report.html"]
    command += ["--beside", folder / "report"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(beside, "RECORDINGS_A_FILE", 4)
        patch.setattr(recordings, "MAX_ROWS", 4)
        patch.setattr(recordings, "FIRST_ROWS", 3)
        patch.setattr(sys, "argv", [*map(str, command)])
        runpy.run_path(str(script), run_name="__main__")
    return folder / "report.html"


def wait_for_drawing(browser, start):
    wait_for_title(browser, start)
    assert browser.run("return document.querySelectorAll('#viewer canvas').length") >= 3


def test_it_opens_from_disk_with_the_one_file_that_it_needs(browser, large, tmp_path):
    first, *others = sorted((large.parent / "report").iterdir())
    assert len(others) == 3
    shutil.copy(large, tmp_path)
    (tmp_path / "report").mkdir()
    shutil.copy(first, tmp_path / "report")
    browser.open(tmp_path / "report.html")
    wait_for_drawing(browser, "1mm/r01: ")
    assert browser.messages() == []


def test_further_files_are_read_when_they_are_needed_and_once(browser, large):
    _, second, third, fourth = sorted(path.stem for path in (large.parent / "report").iterdir())
    browser.open(large)
    wait_for_drawing(browser, "1mm/r01: ")
    browser.run(WATCH_FILES)
    browser.find("#previous").click()
    wait_for_drawing(browser, "0mm/r03: ")
    assert browser.run("return filesRead") == []
    browser.find("#next").click()
    browser.find("#next").click()
    wait_for_drawing(browser, "1mm/r02: ")
    assert browser.run("return filesRead") == [second]
    for name in RECORDINGS:
        browser.run("location.hash = `#recording=${arguments[0]}`", name)
        wait_for_drawing(browser, f"{name}: ")
    assert browser.run("return filesRead") == [second, third, fourth]
    assert browser.messages() == []


def test_the_last_of_several_choices_in_a_row_is_shown(browser, large):
    browser.open(large, "#recording=0mm/r01")
    wait_for_drawing(browser, "0mm/r01: ")
    browser.run("for (let step = 0; step < 9; step += 1) document.getElementById('next').click()")
    wait_for_drawing(browser, f"{RECORDINGS[9]}: ")
    assert not browser.run("return document.getElementById('viewer').hasAttribute('aria-busy')")


def test_it_shows_what_a_page_with_all_inside_shows(browser, page, large):
    shown = "return document.getElementById('viewer').innerText"
    browser.open(page, "#recording=6mm/r02&detector=diagonal")
    wait_for_drawing(browser, "6mm/r02: ")
    inside = browser.run(shown)
    browser.open(large, "#recording=6mm/r02&detector=diagonal")
    wait_for_drawing(browser, "6mm/r02: ")
    assert browser.run(shown) == inside


def test_without_the_files_the_page_says_so_and_all_else_works(browser, large, tmp_path):
    alone = shutil.copy(large, tmp_path / "mailed.html")
    browser.open(alone, "#recording=6mm/r02")
    wait_for_title(browser, "6mm/r02: no signals")
    (why,) = browser.texts("#viewer p")
    assert "in the folder report beside this page, but this folder is missing" in why
    browser.find("#search").send_keys("2.5mm/r02")
    assert browser.run(NAMES) == ["2.5mm/r02"]
    browser.find("#recordings-table a[href='#recording=2.5mm/r02']").click()
    wait_for_title(browser, "2.5mm/r02: no signals")
    assert browser.texts("#rates-table tbody td.rate")
    # The files are found when they come.
    shutil.copytree(large.parent / "report", tmp_path / "report")
    browser.run("location.hash = '#recording=6mm/r01'")
    wait_for_drawing(browser, "6mm/r01: ")


def test_a_damaged_file_is_as_good_as_none(browser, large, tmp_path):
    shutil.copy(large, tmp_path / "report.html")
    shutil.copytree(large.parent / "report", tmp_path / "report")
    for path in (tmp_path / "report").iterdir():
        path.write_text(path.read_text("utf-8").replace('",[["', '",[["AAAA', 1), "utf-8")
    browser.open(tmp_path / "report.html", "#recording=0mm/r01")
    wait_for_title(browser, "0mm/r01: no signals")


def test_what_a_recording_says_stays_text_beside_the_page_too(browser, large):
    browser.open(large, "#recording=1mm/r03")
    wait_for_drawing(browser, "1mm/r03: ")
    assert f"bench {EVIL}" in browser.texts("#viewer dd")
    assert browser.run("return document.title") == "Nodule detection report"
    for path in (large.parent / "report").iterdir():
        assert re.fullmatch(DATA_FILE, path.read_text("utf-8"))
    assert browser.messages() == []


def test_no_script_but_those_that_the_page_asks_for_is_read(browser, large, tmp_path):
    (tmp_path / "evil.js").write_text("document.title = 'broken'", encoding="utf-8")
    written = large.read_text(encoding="utf-8").replace(
        "<main>", '<main><script src="evil.js"></script><script>document.title = 1</script>', 1
    )
    (tmp_path / "report.html").write_text(written, encoding="utf-8")
    browser.open(tmp_path / "report.html")
    assert browser.run("return document.title") == "Nodule detection report"
    blocked = [text for text in browser.messages() if "Content Security Policy" in text]
    assert any("evil.js" in text for text in blocked)
    assert any("inline" in text for text in blocked)


@pytest.mark.parametrize(
    "address", ["http://127.0.0.1:9/a.js", "https://127.0.0.1:9/a.js", "data:,1"]
)
def test_not_even_the_pages_own_script_reads_one_from_elsewhere(browser, large, address):
    browser.open(large)
    refused = browser.driver.execute_async_script(
        "const [address, done] = arguments;"
        "document.addEventListener('securitypolicyviolation', (e) => done(e.effectiveDirective));"
        "const s = document.createElement('script'); s.onload = () => done('read');"
        "s.src = address; document.head.append(s)",
        address,
    )
    assert refused == "script-src-elem"


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


def test_a_switch_and_hidden_columns_reach_rows_that_are_listed_later(browser, large, page):
    verdicts = LISTED + "[row.dataset.recording, row.cells[2].textContent, row.cells[4].hidden])"
    switch = (
        "const box = document.querySelector('.switches select'); box.value = 'diagonal';"
        "box.dispatchEvent(new Event('change'));"
        "document.querySelector('.block:has(#recordings-table) input[data-column=\"4\"]').click()"
    )
    browser.open(page)
    browser.run(switch)
    whole = browser.run(verdicts)
    browser.open(large)
    browser.run(switch)
    for _ in range(5):
        browser.run("document.getElementById('list-more').click()")
    assert browser.run(verdicts) == whole
    assert all(hidden for _, _, hidden in whole)


def test_snakemake_makes_the_files_again_when_they_are_gone_and_none_for_a_small_archive(
    project, tmp_path
):
    copy = project.copy(tmp_path / "large")
    copy.configure(report={"max_megabytes": 0})
    run = copy.snakemake()
    assert run.status == 0, run.output
    (made,) = (copy.results / "report").glob("*.js")
    content = made.read_bytes()
    assert "Nothing to be done" in copy.snakemake().output
    shutil.rmtree(made.parent)
    assert copy.snakemake().status == 0
    assert made.read_bytes() == content
    assert not (project.results / "report").exists()
