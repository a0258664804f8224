"""The report in a real browser: opened from disk, with no network, by eye, hand and on paper."""

import base64
import csv
import io
import json
import re
from itertools import product

import numpy as np
import pytest
from matplotlib.image import imread

from capsule.recordings.names import without_formula
from capsule.recordings.recording import read_recording
from capsule.store.results import Results
from capsule.survey.cycle import STATES
from support.browser import DESKTOP, EVIL, PAPER, PHONE, RECORDINGS, needed
from support.surveys import head_mm

pytestmark = [pytest.mark.browser, needed]

DETECTORS = {
    "template": ["Score", "Nearest template"],
    "diagonal": ["Score", "Beats", "Score along the gut"],
    "taught": ["Score", "Beats", "What each stretch adds"],
}
ROWS = "return [...document.querySelectorAll('#recordings-table tbody tr:not([hidden])')].map("
NAMES = ROWS + "(row) => row.dataset.recording)"
OPEN = "for (const fold of document.querySelectorAll('details')) fold.open = true;"
PICK = """
  const field = document.querySelector(arguments[0]);
  field.value = arguments[1];
  for (const kind of ['input', 'change']) field.dispatchEvent(new Event(kind, { bubbles: true }));
"""
CHARTS = """
  return [...document.querySelectorAll('#viewer .chart')].map((chart) => [
    chart.querySelector('strong').textContent.replace('. ', ''),
    chart.querySelector('.canvas').getAttribute('aria-label')])
"""
WORDS_BEFORE_THE_FIRST_PICTURE = """
  const range = document.createRange();
  range.setStart(document.querySelector('header'), 0);
  range.setEndBefore(document.querySelector('main svg'));
  return range.toString().split(/\\s+/).filter((word) => /\\w/.test(word)).length
"""
BOTTOM = """
  const parts = [...document.querySelectorAll(arguments[0])];
  return Math.max(...parts.map((each) => each.getBoundingClientRect().bottom))
"""
LINKS_TO_NOTHING = """
  return [...document.querySelectorAll('a[href^="#"]')].map((link) => link.hash.slice(1))
    .filter((name) => !name.includes('=') && !document.getElementById(name))
"""
# What is wider than its box, which no reader should see.
TOO_WIDE = """
  const parts = [...document.querySelectorAll('main table')];
  const wide = parts.filter((each) => each.scrollWidth > each.parentElement.clientWidth + 1);
  const page = document.documentElement.scrollWidth > innerWidth ? ['the page'] : [];
  return page.concat(wide.filter((each) => each.getClientRects().length).map((each) => each.id))
"""


def wait_for_title(browser, start):
    """Wait until the viewer shows a recording; the page reacts to a new address with a delay."""
    title = "return document.getElementById('viewer-title').textContent"
    browser.wait_until(f"{title}.startsWith({json.dumps(start)})")
    browser.wait_for_drawing()


def predictions(project, detector):
    """Return a detector's verdicts by recording, with a labelled one left out."""
    rows = project.table("evaluation/predictions.csv") + project.table("detections.csv")
    schemes = None, "leave_one_out"
    chosen = [row for row in rows if row["detector"] == detector and row.get("scheme") in schemes]
    return {row["recording"]: row for row in chosen}


def test_it_opens_from_disk_without_a_message_or_a_request_and_text_stays_text(browser, page):
    browser.open(page, "#recording=1mm/r03")
    browser.run(OPEN)
    assert f"bench {EVIL}" in browser.texts("#viewer dd")
    assert "1mm/<b>.txt" in browser.texts("#passed-over-list code")
    assert browser.run("return document.title") != "broken"
    assert browser.messages() == [] and browser.run("return navigator.onLine") is False
    asked = browser.run("return performance.getEntriesByType('resource').map((e) => e.name)")
    assert [name for name in asked if not name.startswith("data:")] == []


def test_the_first_screen_holds_the_verdict_and_its_drawing(browser, page):
    for width, height in ((DESKTOP, 900), (400, 800)):
        browser.open(page, width=width)
        assert browser.run(BOTTOM, ".card:first-child svg") <= height
        assert width < 600 or browser.run(BOTTOM, ".panels .count") <= height
        assert browser.run(WORDS_BEFORE_THE_FIRST_PICTURE) <= 60


def test_every_switch_in_every_state_changes_what_it_stands_above(browser, page, project):
    for width, (detector, charts) in product((DESKTOP, 768, 400, PHONE), DETECTORS.items()):
        browser.open(page, f"#recording=6mm/r01&detector={detector}", width=width)
        row = predictions(project, detector)["6mm/r01"]
        assert f" by {detector} (" in browser.find("#viewer-title").text
        assert browser.texts(".judges [aria-current]") == [detector]
        drawn = dict(browser.run(CHARTS))
        assert list(drawn) == [*charts, "Readings", "Envelope", "Matrix"]
        exceeds = float(row["score"]) > float(row["threshold"])
        assert ("exceeds it" if exceeds else "does not exceed it") in drawn["Score"]
        size = float(row["predicted_mm"])
        said = browser.find("#viewer .verdict strong").text
        assert said.startswith(f"{size:g} mm" if size else "no nodule")
        # The switch stands above the viewer alone.
        assert browser.texts("#recordings-table caption code") == [leading_detector(browser)]
        browser.run(OPEN)
        assert browser.run(TOO_WIDE) == []
        assert browser.messages() == []


def leading_detector(browser):
    return browser.find("#verdicts small").text.split()[1].rstrip(",")


def test_the_scheme_changes_the_whole_comparison_and_back_returns(browser, page):
    browser.open(page, width=400)
    browser.run(OPEN)
    before = browser.texts(".of-scheme caption")
    browser.run(PICK, "#schemes select", "leave_one_session_out")
    shown = browser.texts(".of-scheme caption")
    assert browser.run("return location.hash") == "#scheme=leave_one_session_out"
    assert len(shown) == len(before) and not set(shown) & set(before)
    assert all("leave-one-session-out" in caption for caption in shown)
    assert browser.run(TOO_WIDE) == []
    browser.driver.back()
    browser.wait_until("return location.hash === ''")
    assert browser.texts(".of-scheme caption") == before
    browser.open(page, "#scheme=leave_one_session_out")
    assert browser.find("#schemes select").get_attribute("value") == "leave_one_session_out"


def test_the_numbers_are_those_of_the_csv_files_until_the_slider_is_moved(browser, page, project):
    browser.open(page)
    lead = leading_detector(browser)
    (verdict,) = [row for row in project.table("detections.csv") if row["detector"] == lead]
    assert browser.find(".card").get_attribute("data-verdict") == verdict["verdict"]
    assert browser.find(".card h3 a").text == "u1"
    said = {name: float(row["predicted_mm"]) for name, row in predictions(project, lead).items()}
    rows = browser.run(ROWS + "(row) => [row.dataset.recording, row.cells[2].dataset.value])")
    listed = [row["recording"] for row in project.table("recordings.csv")]
    assert [name for name, _ in rows] == listed
    assert {name: float(size) for name, size in rows if size} == pytest.approx(said)

    # The slider says at its start what the page says, and something else when it is moved.
    said = "return document.querySelector('#meaning').textContent.replace(/\\s+/g, ' ')"
    before = browser.run(said)
    browser.run(PICK, "#prevalence", 10)
    assert browser.run(said) == before
    browser.run(PICK, "#prevalence", 50)
    assert browser.run(said) != before and "If 50 of 100" in browser.run(said)


def test_the_table_is_sorted_filtered_and_searched(browser, page):
    browser.open(page, "#recording=1mm/r01")
    everything = browser.run(NAMES)
    durations = ROWS + "(row) => row.cells[4].dataset.value)"
    button = browser.find("#recordings-table th:nth-child(5) button")
    for falling in (False, True):
        button.click()
        *known, first_bad, second_bad = browser.run(durations)
        assert known == sorted(known, key=float, reverse=falling)
        assert first_bad == second_bad == ""
    browser.find("#recordings-table th:nth-child(1) button").send_keys("\ue007")
    assert browser.run(NAMES)[:2] == ["0mm/r01", "0mm/r02"]
    browser.run(PICK, "#filter-size", "6 mm")
    assert browser.run(NAMES) == ["6mm/r01", "6mm/r02", "6mm/r03"]
    # Next keeps to the filter.
    browser.find("#next").click()
    wait_for_title(browser, "6mm/r01")
    browser.find("#search").send_keys("R02")
    assert browser.run(NAMES) == ["6mm/r02"]
    assert browser.find("#shown").text == f"1 of {len(everything)} shown"
    browser.find("#search").send_keys(" no such")
    assert browser.find("#none-shown").is_displayed()
    browser.find("#filters button[type=reset]").click()
    shown = "return document.getElementById('shown').textContent"
    browser.wait_until(f"{shown}.startsWith('{len(everything)} ')")
    assert sorted(browser.run(NAMES)) == sorted(everything)
    assert browser.messages() == []


def test_a_recording_is_chosen_by_click_key_and_address_and_back_returns(browser, page):
    browser.open(page, "#recording=1mm/r02&detector=diagonal")
    wait_for_title(browser, "1mm/r02: 1 mm nodule, taken for ")
    current = "return document.querySelector('.judges [aria-current]').textContent"
    assert browser.run(current) == "diagonal"
    browser.find(".judges li:nth-child(3) a").click()
    browser.wait_until(f"{current} === 'taught'")
    # A link to a recording keeps the detector, and so do the buttons.
    browser.find("#recordings-table a[href='#recording=6mm/r02']").send_keys("\ue007")
    wait_for_title(browser, "6mm/r02")
    assert browser.run("return document.activeElement.id") == "viewer-title"
    browser.find("#next").send_keys(" ")
    wait_for_title(browser, "6mm/r03")
    assert browser.run("return location.hash") == "#recording=6mm/r03&detector=taught"
    for title in ("6mm/r02", "1mm/r02"):
        browser.driver.back()
        wait_for_title(browser, title)
    browser.driver.back()
    browser.wait_until(f"{current} === 'diagonal'")
    browser.driver.forward()
    browser.wait_until(f"{current} === 'taught'")
    # The last of several choices in a row is shown.
    browser.open(page, "#recording=0mm/r01")
    wait_for_title(browser, "0mm/r01: ")
    browser.run("for (let step = 0; step < 9; step += 1) document.getElementById('next').click()")
    wait_for_title(browser, f"{RECORDINGS[9]}: ")
    assert browser.messages() == []


@pytest.mark.parametrize(
    ("address", "first"),
    [
        ("#recording=%E0%A4%A", "unlabelled/u1"),
        ("#recording=no/such&detector=diagonal", "unlabelled/u1"),
        ("#detector=%3Cscript%3E&recording=1mm/r01", "1mm/r01"),
        ("#recording=__proto__&scheme=constructor", "unlabelled/u1"),
        ("#made", "unlabelled/u1"),
    ],
)
def test_what_an_address_does_not_name_is_that_of_the_first_card(browser, page, address, first):
    browser.open(page, address)
    wait_for_title(browser, f"{first}: ")
    assert browser.messages() == []


def test_the_drawn_signals_are_those_of_the_files(browser, page, project):
    browser.open(page)
    script = """
      return readEvidence(arguments[0]).then((e) => ({
        readings: unpack(e.readings), matrix: matrixOf(e), every: e.envelope.every,
      }))
    """
    results = Results.of_table(project.results, project.results / "recordings.csv")
    for name in ("0mm/r02", "6mm/r03"):
        shown = browser.run(script, name)
        with (project.raw / f"{name}.csv").open("rb") as stream:
            recording = read_recording(stream, 4)
        assert np.array_equal(np.array(shown["readings"]), recording.values)
        expected = results.matrix(name)[:, : recording.time_s.size : shown["every"]]
        assert np.allclose(shown["matrix"], expected, atol=0.02)


STACKED = """
  const rows = [[0, 9, null, 0], [0, 0, null, -9]];
  const drawing = { time: [0, 1, 2, 3], rows, distance: 4, middle: 0, unit: "" };
  const { scales } = drawStacked(document.body, drawing);
  return Promise.resolve().then(() => [scales.y.min, scales.y.max])
"""


def test_what_the_scripts_compute(browser, page):
    browser.open(page)
    written = browser.run(
        "return [number(-0.004, 2), number(-0.25, 2), number(-0), significant(-0.0012345),"
        " significant(1234.5)]"
    )
    assert written == ["0.00", "\u22120.25", "0", "\u22120.00123", "1230"]
    formulas = ["=1+1", "a;=1", "-1.5", "-1.5e-3", "- 1", "+inf", "-x", "@a", 'x,"=2"', "|+b"]
    formulas += ["\uff1d1", "plain", "", "a\t@b", "2024-06-03", "'=1"]
    said = browser.run("return arguments[0].map(withoutFormula)", formulas)
    assert said == [without_formula(text) for text in formulas]
    written = browser.run("return toCsv([['=a,\"b\"', 'line\\nbreak', null, -2]])")
    assert list(csv.reader(io.StringIO(written))) == [[' =a,"b"', "line\nbreak", "", "-2"]]
    # Kills: a range of rows alone, which cuts off the last sensor's dip over a nodule.
    assert browser.run(STACKED) == [-1 - 9 / 4, 9 / 4]


def test_tables_charts_and_figures_are_saved(browser, page, project, tmp_path):
    browser.open(page, "#recording=6mm/r02&detector=diagonal")
    browser.find("#search").send_keys("1mm/r")
    lead = leading_detector(browser)
    browser.save_into(tmp_path)

    def saved(label, name):
        browser.find(f"button[aria-label='Save the {label}']").click()
        browser.wait_until_there(tmp_path / name)
        return (tmp_path / name).read_bytes()

    def table(label, name):
        return list(csv.reader(io.StringIO(saved(f"table as CSV: {label}", name).decode())))

    heads, *rows = table("all recordings", "recordings-table.csv")
    assert heads[0] == "Recording" and [row[0] for row in rows] == ["1mm/r01", "1mm/r02", "1mm/r03"]
    heads, first, *_ = table(f"rates of {lead}", "rates-table.csv")
    row = dict(zip(heads, first, strict=True))
    rate = "Exact size, leave-one-out"
    hits, of = row[f"{rate}: count"].split(" of ")
    assert of == "3" and float(row[rate]) == int(hits) / 3 and "to" in row[f"{rate}: interval"]
    chart = "6mm/r02: Score along the gut, diagonal"
    assert len(saved(f"chart as PNG: {chart}", "6mm_r02_diagonal_Score_along_the_gut.png")) > 5000
    assert len(saved("figure as PNG: templates", "templates.png")) > 5000
    drawn = (project.results / "figures" / "templates.svg").read_bytes()
    assert saved("figure as SVG: templates", "templates.svg") == drawn
    assert browser.messages() == []


def test_most_of_the_page_is_folded_and_a_link_or_a_click_opens_a_fold(browser, page):
    browser.open(page)
    assert browser.run("return document.querySelectorAll('main details[open]').length") == 0
    browser.find("#viewer details > summary").click()
    browser.wait_until("return document.querySelectorAll('#viewer details canvas').length === 2")
    for name in ("benches", "term-rmse"):
        within = f"return document.getElementById('{name}').closest('details').open"
        browser.run(f"location.hash = '{name}'")
        browser.wait_until(within)
        browser.open(page, f"#{name}")
        assert browser.run(within) is True
    # Every other link leads somewhere, too.
    assert browser.run(LINKS_TO_NOTHING) == []


def test_axe_finds_no_fault(browser, page):
    for width, dark in ((PHONE, False), (DESKTOP, True)):
        browser.open(page, "#recording=2.5mm/r01&detector=diagonal", width=width, dark=dark)
        browser.run(OPEN)
        assert browser.violations() == [] and browser.messages() == []
        colour = browser.run("return getComputedStyle(document.body).backgroundColor")
        assert (max(int(part) for part in re.findall(r"\d+", colour)[:3]) < 60) == dark
        browser.run("window.before = document.querySelector('#viewer canvas')")
        browser.prefer(dark=not dark)
        # A page hears of the theme just before it draws its next frame, and draws its charts anew.
        browser.wait_for_frame()
        assert browser.run("return !window.before.isConnected")


def test_a_survey_is_replayed_by_keys_buttons_and_a_mark_in_its_picture(browser, page, project):
    browser.open(page)
    assert browser.texts("#surveys > article h3") == ["demo, simulated"]
    assert browser.texts("#surveys-not-shown code") == ["sessions/running"]
    slider, said = browser.find("#moment-demo"), browser.find("output.moment")
    # It begins at the first nodule.
    assert slider.get_attribute("aria-valuetext").startswith("1 min 36 s")
    slider.send_keys("\ue011")
    assert slider.get_attribute("aria-valuetext").startswith("0 min 00 s: the capsule waits")
    found = browser.driver.find_elements("css selector", ".steps button")
    buttons = {each.text: each for each in found}
    moves = {"Place 2": 320, "Place 1": 96, "Next event": 120, "Previous event": 96}
    for button, time_s in moves.items():
        buttons[button].send_keys("\ue007" if "Place" in button else " ")
        assert float(slider.get_attribute("value")) == pytest.approx(time_s, abs=1)
    assert "Last event: suspected" in said.text
    frame = json.loads((project.results / "surveys/demo/survey.json").read_text())["frame"]
    for time_s, state in ((160, "returning"), (60, "exploring")):
        browser.run(PICK, "#moment-demo", time_s)
        assert STATES[state] in said.text
        assert ("position not measured" in said.text) == (state == "returning")
    left, _, width, _ = frame["map"]["box"]
    across = np.interp(head_mm(60.0), frame["map"]["x"], [left, left + width])
    place = "return document.querySelector('#surveys > article .overlay .head').cx.baseVal.value"
    assert browser.run(place) == pytest.approx(across, abs=0.5)
    # A survey that was folded away is drawn when it is opened.
    browser.find("#survey-second summary").click()
    browser.wait_until("return document.querySelector('#survey-second .uplot').clientWidth > 600")
    assert browser.messages() == []


def test_paper_holds_the_whole_page_in_one_theme_and_nothing_folded(browser, page):
    printed = []
    widths = "return [...document.querySelectorAll('#viewer .canvas canvas')].map((c) => c.width)"
    sides = """
      return [...document.querySelectorAll('main :is(table, img, canvas, .card)')]
        .filter((part) => part.offsetParent !== null)
        .map((part) => [part.getBoundingClientRect(), part.id || part.className || part.tagName])
        .map(([{ left, right }, name]) => [name, Math.floor(left), Math.ceil(right)])
    """
    for dark in (True, False):
        browser.open(page, "#recording=2.5mm/r01", dark=dark)
        on_screen = browser.run(widths)
        browser.run("window.dispatchEvent(new Event('beforeprint'))")
        # 44rem; no chart is drawn again between this event and the paper.
        assert set(browser.run(widths)) == {704}
        browser.run("window.dispatchEvent(new Event('afterprint'))")
        assert browser.run(widths) == on_screen
        browser.lay_on_paper(dark=dark)
        assert [row for row in browser.run(sides) if row[1] < 0 or row[2] > PAPER] == []
        assert browser.run("return document.querySelectorAll('main details[open]').length") == 0
        printed.append(imread(io.BytesIO(browser.picture_at_rest()))[..., :3])
        browser.run("window.dispatchEvent(new Event('afterprint'))")
    # Edges may be smoothed otherwise; a colour of the other theme is farther away.
    assert printed[0].shape == printed[1].shape
    assert np.abs(printed[0] - printed[1]).max() < 0.2 and np.median(printed[0]) == 1.0
    browser.open(page)
    paper = base64.b64decode(browser.driver.print_page())
    assert 3 <= len(re.findall(rb"/Type\s*/Page\b", paper)) <= 11


def test_the_same_inputs_give_the_same_page_but_for_one_marked_line(page, project, tmp_path):
    again = project.copy(tmp_path / "again")
    assert again.snakemake("--forcerun", "report").status == 0
    made = page, again.results / "report.html"
    before, after = (each.read_text(encoding="utf-8").splitlines() for each in made)
    changed = [n for n, pair in enumerate(zip(before, after, strict=True)) if len({*pair}) > 1]
    assert {before[n - 1] for n in changed} <= {"<!-- the next line changes from run to run -->"}


def test_a_long_table_lists_some_rows_and_sees_all(browser, page, tmp_path):
    # As the page of a large archive, of which the table begins with some rows.
    text = page.read_text(encoding="utf-8")
    large = tmp_path / "report.html"
    later = r'<tr data-recording="(?!0mm)[^"]+"'
    large.write_text(re.sub(later, r"\g<0> hidden", text), encoding="utf-8")
    box = "const { top, bottom } = document.querySelector(arguments[0]).getBoundingClientRect();"
    for width in (DESKTOP, 400):
        # A link brings the row and the drawing into view.
        browser.open(large, "#recording=unlabelled/u1", width=width)
        wait_for_title(browser, "unlabelled/u1: unlabelled, taken for ")
        for seen in ("#recordings-table tr[aria-current]", "#viewer-title"):
            top, bottom = browser.run(f"{box} return [top, bottom]", seen)
            assert 0 <= top < bottom <= 900
    count = len(RECORDINGS) + 2
    browser.open(large)
    assert browser.run(NAMES) == ["0mm/r01", "0mm/r02", "0mm/r03"]
    assert browser.find("#shown").text == f"{count} of {count} fit, the first 3 are listed"
    browser.find("#list-more").click()
    assert len(browser.run(NAMES)) == 6 and "first 6 " in browser.find("#shown").text
    browser.run("for (let n = 0; n < 3; n += 1) document.getElementById('list-more').click()")
    assert len({*browser.run(NAMES)}) == count
    assert not browser.find("#list-more").is_displayed()
    browser.find("#search").send_keys("r02")
    fitting = ["0mm/r02", "1mm/r02", "2.5mm/r02", "6mm/r02"]
    assert browser.run(NAMES) == fitting[:3]
    # The file has all that fit.
    browser.save_into(tmp_path)
    browser.find("[aria-label$='as CSV: all recordings']").click()
    browser.wait_until_there(saved := tmp_path / "recordings-table.csv")
    rows = saved.read_text(encoding="utf-8").splitlines()[1:]
    assert [line.split(",")[0] for line in rows] == fitting
