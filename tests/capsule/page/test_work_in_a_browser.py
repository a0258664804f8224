"""The page as a place to work in: switches, files to keep and links."""

import csv
import io
import time
from contextlib import contextmanager
from itertools import product

import pytest

from capsule import words
from capsule.detectors.registry import detector_row
from capsule.recordings.names import without_formula
from support.browser import DESKTOP, PHONE, needed
from support.report_page import RECORDINGS, wait_for_title

pytestmark = [
    pytest.mark.browser,
    needed,
]
FORMULAS = [
    "=1+1",
    "a;=1",
    "-1.5",
    "-1.5e-3",
    "- 1",
    "+inf",
    "-x",
    "@a",
    'x,"=2"',
    "|+b",
    "\uff1d1",
]
FORMULAS += ["plain", "", "a\t@b", "2024-06-03", "'=1"]


def choose(browser, title, value):
    browser.run(
        "const label = [...document.querySelectorAll('.switches label')]"
        ".find((each) => each.textContent.startsWith(arguments[0]));"
        "const select = label.querySelector('select'); select.value = arguments[1];"
        "select.dispatchEvent(new Event('change', { bubbles: true }))",
        title,
        value,
    )


def shown_table(browser, kind):
    """Return the id and the visible rows of the one visible table of a kind."""
    return browser.run(
        "const tables = [...document.querySelectorAll(`main table[id^='${arguments[0]}']`)]"
        ".filter((t) => t.offsetParent !== null);"
        "if (tables.length !== 1) return [tables.map((t) => t.id), []];"
        "return [tables[0].id, [...tables[0].rows].map((row) => [...row.cells]"
        ".filter((c) => !c.hidden).map((c) => [c.dataset.value ?? null, c.innerText.trim()]))]",
        kind,
    )


@contextmanager
def saved(browser, tmp_path):
    """Let the browser save into a folder; gives what waits for the one file there."""
    browser._command("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))

    def file():
        deadline = time.monotonic() + 15
        while time.monotonic() < deadline:
            whole = [p for p in tmp_path.iterdir() if not p.name.endswith((".crdownload", ".tmp"))]
            hidden = [p for p in whole if not p.name.startswith(".")]
            if hidden and hidden[0].stat().st_size:
                return hidden[0]
            time.sleep(0.05)
        raise AssertionError("no file was saved")

    yield file


def press(browser, label):
    browser.run(
        "[...document.querySelectorAll('button')]"
        ".find((b) => b.getAttribute('aria-label') === arguments[0]).click()",
        label,
    )


def read_csv(path):
    return list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))


@pytest.mark.parametrize("detector", ["template", "diagonal", "taught"])
@pytest.mark.parametrize("scheme", ["leave_one_out", "resubstitution"])
def test_one_switch_chooses_whose_rates_all_sections_show(browser, page, project, detector, scheme):
    browser.open(page)
    choose(browser, "Detector", detector)
    choose(browser, "Scheme", scheme)
    chosen = [
        row
        for row in project.table("evaluation/detection.csv")
        if (row["detector"], row["scheme"]) == (detector, scheme)
    ]
    browser.run("document.querySelectorAll('details.fold').forEach((d) => { d.open = true; })")
    _, (_, schemes, *rows) = shown_table(browser, "rates-table")
    shown = [words.scheme(scheme), words.scheme("paper")] * 4 + [words.scheme(scheme)]
    assert [text for _, text in schemes] == shown
    for row, cells in zip(chosen, rows, strict=True):
        for place, rate in ((1, "precision"), (3, "recall")):
            value = cells[place][0]
            assert (float(value) if value else None) == (float(row[rate]) if row[rate] else None)
    _, (_, *rows) = shown_table(browser, "confusion-table")
    counts = [
        row["count"]
        for row in project.table("evaluation/confusion.csv")
        if (row["detector"], row["scheme"]) == (detector, scheme)
    ]
    assert [text for row in rows for _, text in row[1:-1]] == counts
    assert shown_table(browser, "negatives-table")[1]
    # Detectors are compared under one scheme alone, which stays; the chosen one is marked.
    assert len(browser.texts("#detectors #compared-table caption")) == 1
    marked = browser.texts("#compared-table th.chosen code, #calibration-table tr.chosen code")
    assert set(marked) == {detector}
    sentence = f"{detector_row(detector).sentence}; {words.scheme(scheme)}"
    assert set(browser.texts("p.by")) == {f"Verdicts of {detector}, {sentence}."}
    assert browser.messages() == []


def test_the_glossary_leaves_apart_what_the_switch_writes(browser, page):
    browser.open(page)
    assert browser.texts("a.term")
    owned = "return document.querySelectorAll('main [data-shown]').length"
    assert browser.run(owned) > 1
    inside = "return document.querySelectorAll('[data-shown] *, output a, #viewer a.term').length"
    assert browser.run(inside) == 0
    # No text that the switch replaces has lost its element, for any detector and scheme.
    for detector, scheme in product(
        ("taught", "template", "diagonal"), ("resubstitution", "leave_one_out")
    ):
        choose(browser, "Detector", detector)
        choose(browser, "Scheme", scheme)
        assert browser.run(inside) == 0
        judge = browser.find("[data-shown='judge']").text
        assert judge == f"{detector}, {words.scheme(scheme)}"


@pytest.mark.parametrize("detector", ["template", "diagonal"])
def test_the_switch_brings_the_detectors_verdicts_into_the_table(browser, page, project, detector):
    browser.open(page, f"#detector={detector}&scheme=resubstitution")
    rows = project.table("evaluation/predictions.csv") + project.table("detections.csv")
    said = {
        row["recording"]: float(row["predicted_mm"])
        for row in rows
        if row["detector"] == detector and row.get("scheme", "resubstitution") == "resubstitution"
        if row["predicted_mm"]
    }
    shown = browser.run(
        "return [...document.querySelectorAll('#recordings-table tbody tr')].map((row) => "
        "[row.dataset.recording, row.cells[2].dataset.value, row.cells[2].textContent,"
        " row.dataset.outcome, row.cells[3].textContent, row.dataset.size])"
    )
    for name, value, text, outcome, judged, size in shown:
        assert (float(value) if value else None) == said.get(name)
        assert text == (words.size(said[name]) if name in said else "")
        assert outcome == judged
        if size == "no nodule" and name in said:
            assert outcome == ("rightly none" if said[name] == 0 else "false alarm")
    assert browser.find("[data-shown='judge']").text == f"{detector}, resubstitution"
    options = browser.run(
        "return [...document.getElementById('filter-outcome').options].map((each) => each.text)"
    )
    assert set(options) == {"all", *(outcome for _, _, _, outcome, _, _ in shown)}


def test_resubstitution_is_hidden_until_asked_for(browser, page):
    browser.open(page)
    seen = "return [...document.querySelectorAll('main th, main caption, #viewer td')]" + (
        ".filter((e) => e.offsetParent !== null && e.innerText.includes('resubstitution')).length"
    )
    assert browser.run(seen) == 0
    choose(browser, "Scheme", "resubstitution")
    assert browser.run(seen) > 0
    assert browser.run("return location.hash") == "#scheme=resubstitution"
    browser.driver.back()
    browser.run("return new Promise((done) => setTimeout(done, 200))")
    assert browser.run(seen) == 0


def test_a_saved_table_holds_the_numbers_of_the_csv_file(browser, page, project, tmp_path):
    browser.open(page, "#detector=diagonal")
    with saved(browser, tmp_path) as file:
        press(browser, "Save the table as CSV: rates of diagonal")
        heads, *rows = read_csv(file())
    chosen = [
        row
        for row in project.table("evaluation/sizing.csv")
        if (row["detector"], row["scheme"]) == ("diagonal", "leave_one_out")
    ]
    place = heads.index("Exact size, leave-one-out")
    assert heads[place : place + 3] == [heads[place] + end for end in ("", ": interval", ": count")]
    for row, cells in zip(chosen, rows, strict=True):
        assert cells[place] == str(float(row["exact_rate"]))
        low, high = float(row["exact_rate_low"]), float(row["exact_rate_high"])
        assert cells[place + 1] == words.interval(low, high)
        assert cells[place + 2] == f"{row['exact']} of {row['recordings']}"


def test_the_saved_recordings_are_those_shown_and_harmless(browser, page, tmp_path):
    browser.open(page, "#recording=1mm/r03")
    browser.find("#search").send_keys("1mm/r")
    with saved(browser, tmp_path) as file:
        press(browser, "Save the table as CSV: all recordings")
        heads, *rows = read_csv(file())
    assert heads[0] == "Recording" and [row[0] for row in rows] == ["1mm/r01", "1mm/r02", "1mm/r03"]
    assert rows[2][-1] == ""
    assert browser.messages() == []


def test_no_cell_of_a_saved_table_is_a_formula(browser, page):
    browser.open(page)
    said = browser.run("return arguments[0].map(Saving.withoutFormula)", FORMULAS)
    assert said == [without_formula(text) for text in FORMULAS]
    written = browser.run("return Saving.toCsv([['=a,\"b\"', 'line\\nbreak', null, -2]])")
    assert list(csv.reader(io.StringIO(written))) == [[' =a,"b"', "line\nbreak", "", "-2"]]


@pytest.mark.parametrize(
    ("label", "name"),
    [
        ("Save the chart as PNG: 6mm/r02: Score along the gut, diagonal", "6mm_r02_diagonal_"),
        ("Save the chart as PNG: 6mm/r02: Readings", "6mm_r02_Readings"),
        ("Save the figure as PNG: roc", "roc"),
    ],
)
def test_charts_and_figures_are_saved_as_pictures(browser, page, tmp_path, label, name):
    browser.open(page, "#recording=6mm/r02&detector=diagonal")
    with saved(browser, tmp_path) as file:
        press(browser, label)
        path = file()
    assert path.name.startswith(name) and path.suffix == ".png"
    content = path.read_bytes()
    assert content.startswith(b"\x89PNG") and len(content) > 5000
    assert browser.messages() == []


def test_a_figure_is_saved_as_the_svg_that_it_is(browser, page, project, tmp_path):
    browser.open(page)
    with saved(browser, tmp_path) as file:
        press(browser, "Save the figure as SVG: templates")
        path = file()
    assert path.name == "templates.svg"
    assert path.read_bytes() == (project.results / "figures" / "templates.svg").read_bytes()


def test_every_name_of_a_recording_leads_to_its_drawing(browser, page):
    browser.open(page)
    browser.run("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    plain = browser.run(
        "const names = new Set(arguments[0].flatMap((n) => [n, `raw/${n}.csv`]));"
        "return [...document.querySelectorAll('main *')].filter((e) => !e.children.length"
        " && !e.closest('a, #viewer, script, label') && names.has(e.textContent.trim()))"
        ".map((e) => e.outerHTML)",
        RECORDINGS,
    )
    assert plain == []
    browser.find("#verdicts a[href='#recording=unlabelled/u1']").click()
    wait_for_title(browser, "unlabelled/u1: ")
    browser.find("#checksums a[href='#recording=2.5mm/r02']").click()
    wait_for_title(browser, "2.5mm/r02: ")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [PHONE, DESKTOP])
def test_axe_finds_no_fault_after_switching(browser, page, width, dark):
    browser.open(page, "#detector=taught&scheme=resubstitution", width=width, dark=dark)
    assert browser.violations() == []
    assert browser.run("return document.documentElement.scrollWidth") <= width
    assert browser.messages() == []
