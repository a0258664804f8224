"""The report in a real browser: opened from disk, with no network, by eye, hand and ear."""

import re
import shutil
from itertools import product

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.image import imread

from capsule import words
from capsule.figures.registry import FIGURES
from capsule.recordings.recording import read_recording
from support.browser import DESKTOP, PHONE, needed
from support.project import ROOT
from support.report_page import EVIL, RECORDINGS, SIZES, wait_for_title

pytestmark = [
    pytest.mark.browser,
    needed,
]

PICTURES = ROOT / "build" / "report"


def shown_recordings(browser):
    return browser.texts("#recordings-table tbody tr:not([hidden]) th")


def test_it_opens_from_disk_without_a_message_or_a_request(browser, page):
    browser.open(page)
    assert browser.messages() == []
    asked = browser.run("return performance.getEntriesByType('resource').map((e) => e.name)")
    assert [name for name in asked if not name.startswith("data:")] == []
    assert browser.find("h1").is_displayed()
    assert browser.run("return document.querySelectorAll('#viewer canvas').length") >= 3


def test_the_network_is_really_off(browser, page):
    browser.open(page)
    assert browser.run("return navigator.onLine") is False


def test_what_a_recording_says_stays_text(browser, page):
    browser.open(page, "#recording=1mm/r03")
    assert browser.run("return document.title") != "1"
    assert EVIL in browser.find("#sources").get_attribute("textContent")
    assert f"bench {EVIL}" in browser.texts("#viewer dd")
    assert "1mm/<b>.txt" in browser.texts("#passed-over-list code")
    assert browser.messages() == []


def test_an_injected_script_would_not_run(browser, page):
    browser.open(page)
    browser.run(
        "const s = document.createElement('script'); s.textContent = 'document.title = 1';"
        "document.body.append(s)"
    )
    assert browser.run("return document.title") != "1"


def test_rejected_recordings_stand_at_the_top_with_their_reason(browser, page, project):
    browser.open(page)
    listed = dict(
        zip(browser.texts("#rejected-list code"), browser.texts("#rejected-list li"), strict=True)
    )
    rejected = [row for row in project.table("recordings.csv") if row["status"] == "rejected"]
    assert set(listed) == {row["recording"] for row in rejected} == {"1mm/empty", "1mm/wrong"}
    assert all(row["reason"] in listed[row["recording"]] for row in rejected)
    assert "2 rejected" in browser.find(".facts-line").text


RATES = [
    ("detection", "precision", "tp", "fp"),
    ("detection", "recall", "tp", "fn"),
    ("sizing", "exact_rate", "exact", None),
    ("sizing", "within_rate", "within", None),
]


def test_the_tables_hold_the_numbers_of_the_csv_files(browser, page, project):
    browser.open(page)
    browser.run("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    tables = {name: project.table(f"evaluation/{name}.csv") for name in ("detection", "sizing")}
    named = browser.run("return JSON.parse(document.getElementById('page-data').textContent)")
    detectors = [each["name"] for each in named["detectors"]]
    assert set(detectors) == {row["detector"] for row in tables["detection"]}
    assert detectors[0] == leading_detector(project) and len(detectors) > 1
    schemes = list(dict.fromkeys(row["scheme"] for row in tables["detection"]))
    for (number, detector), size in product(enumerate(detectors), (1.0, 2.5, 6.0)):
        of_size = {
            (name, row["scheme"]): row
            for name, rows in tables.items()
            for row in rows
            if row["detector"] == detector and float(row["size_mm"]) == size
        }
        cells = browser.run(
            "return [...document.querySelectorAll(`#${arguments[0]} tbody tr`)]"
            ".filter((row) => row.cells[0].textContent.startsWith(arguments[1]))"
            ".flatMap((row) => [...row.querySelectorAll('td')].map((cell) => "
            "[cell.dataset.value ?? null, cell.textContent.replace(/\\s+/g, ' ')]))",
            f"rates-table-{number}" if number else "rates-table",
            f"{size:g} mm",
        )
        for group, (file, rate, hits, misses) in enumerate(RATES):
            for place, scheme in enumerate(schemes):
                row = of_size[file, scheme]
                value, text = cells[group * (len(schemes) + 1) + place]
                if row[rate] == "":
                    assert (value, text.strip()) == (None, "not known")
                    continue
                of = int(row[hits]) + int(row[misses]) if misses else int(row["recordings"])
                assert float(value) == float(row[rate])
                assert words.percent(float(row[rate])) in text
                assert f"{row[hits]} of {of}" in text
                low, high = float(row[f"{rate}_low"]), float(row[f"{rate}_high"])
                assert words.interval(low, high) in text


def leading_detector(project):
    """Work out the detector that finds most at a specificity of 95 % from the predictions."""
    scores = {}
    for row in project.table("evaluation/predictions.csv"):
        if row["scheme"] == "leave_one_out":
            nodule, score = float(row["size_mm"]) > 0, -np.inf
            if row["predicted_mm"]:
                score = float(row["score"]) - float(row["threshold"])
            elif not nodule:
                score = np.inf
            scores.setdefault(row["detector"], ([], []))[nodule].append(score)
    reached = {}
    for name, (healthy, nodules) in scores.items():
        threshold = sorted(healthy, reverse=True)[int(0.05 * len(healthy) + 1e-9)]
        reached[name] = np.mean(np.array(nodules) > threshold)
    return max(reached, key=reached.get)


def test_the_first_section_is_the_verdict_of_the_csv_file(browser, page, project):
    browser.open(page)
    assert browser.run("return document.querySelector('main section').id") == "verdicts"
    lead = leading_detector(project)
    (verdict,) = [row for row in project.table("detections.csv") if row["detector"] == lead]
    (card,) = browser.run("return [...document.querySelectorAll('.card')].map((e) => e.dataset)")
    assert card["verdict"] == verdict["verdict"]
    assert browser.find(".card h3 a").text == "u1"
    if verdict["probability"] and verdict["verdict"] != "no verdict":
        chance = words.probability(float(verdict["probability"]))
        assert chance in browser.find(".card .fact").text


def test_the_counts_are_those_of_the_predictions(browser, page, project):
    browser.open(page)
    lead = leading_detector(project)
    found = [
        float(row["predicted_mm"] or 0) > 0
        for row in project.table("evaluation/predictions.csv")
        if (row["detector"], row["scheme"]) == (lead, "leave_one_out")
        and float(row["size_mm"]) >= 2
    ]
    assert browser.find(".count.large strong").text == f"{sum(found)} of {len(found)}"


def test_the_slider_moves_the_frequencies_and_at_its_start_says_what_the_page_says(browser, page):
    browser.open(page)
    said = "return document.querySelector('#meaning').textContent.replace(/\\s+/g, ' ')"
    move = (
        "const s = document.getElementById('prevalence'); s.value = arguments[0];"
        "s.dispatchEvent(new Event('input'))"
    )
    before = browser.run(said)
    browser.run(move, 10)
    assert browser.run(said) == before
    browser.run(move, 50)
    assert browser.run(said) != before and "If 50 of 100" in browser.run(said)


def test_the_confusions_are_those_of_the_csv_file(browser, page, project):
    browser.open(page)
    rows = [
        row
        for row in project.table("evaluation/confusion.csv")
        if (row["detector"], row["scheme"]) == ("template", "leave_one_out")
    ]
    cells = browser.texts("#confusion-table-1 tbody td:not(:last-child)")
    assert cells == [row["count"] for row in rows]


def test_every_recording_is_listed_with_its_verdict(browser, page, project):
    browser.open(page)
    index = project.table("recordings.csv")
    said = {
        row["recording"]: row["predicted_mm"]
        for row in project.table("evaluation/predictions.csv")
        if (row["detector"], row["scheme"]) == ("template", "leave_one_out")
    } | {
        row["recording"]: row["predicted_mm"]
        for row in project.table("detections.csv")
        if row["detector"] == "template"
    }
    rows = browser.run(
        "return [...document.querySelectorAll('#recordings-table tbody tr')]"
        ".map((row) => [row.dataset.recording, row.cells[2].dataset.value])"
    )
    assert [name for name, _ in rows] == [row["recording"] for row in index]
    for name, verdict in rows:
        assert (float(verdict) if verdict else None) == (
            float(said[name]) if name in said else None
        )


def test_sorting_by_a_number_and_back(browser, page, project):
    browser.open(page)
    button = browser.find("#recordings-table th:nth-child(5) button")
    key = "return [...document.querySelectorAll('#recordings-table tbody tr')]" + (
        ".map((row) => row.cells[4].dataset.value)"
    )
    button.click()
    ascending = browser.run(key)
    numbers = [float(value) for value in ascending if value]
    assert numbers == sorted(numbers) and len(numbers) == len(RECORDINGS)
    assert ascending[-2:] == ["", ""]
    assert browser.find("#recordings-table th:nth-child(5)").get_attribute("aria-sort") == (
        "ascending"
    )
    button.click()
    descending = browser.run(key)
    assert [float(value) for value in descending if value] == numbers[::-1]
    assert descending[-2:] == ["", ""]


def test_sorting_by_name_counts_numbers_as_numbers(browser, page):
    browser.open(page)
    browser.find("#recordings-table th:nth-child(1) button").send_keys("\ue007")
    names = shown_recordings(browser)
    assert names[:3] == ["0mm/r01", "0mm/r02", "0mm/r03"]
    assert names[-1] == "unlabelled/u1"


def test_filters_and_search_work_together(browser, page):
    browser.open(page)
    everything = len(shown_recordings(browser))
    browser.run(
        "const size = document.getElementById('filter-size'); size.value = '2.5 mm';"
        "size.dispatchEvent(new Event('change'))"
    )
    assert shown_recordings(browser) == ["2.5mm/r01", "2.5mm/r02", "2.5mm/r03"]
    browser.find("#search").send_keys("R02")
    assert shown_recordings(browser) == ["2.5mm/r02"]
    assert browser.find("#shown").text == f"1 of {everything} shown"
    browser.find("#search").send_keys("\ue007")
    assert shown_recordings(browser) == ["2.5mm/r02"]
    browser.find("#search").send_keys(" no such")
    assert browser.find("#none-shown").is_displayed()
    browser.find("#filters button[type=reset]").click()
    browser.run("return new Promise((done) => setTimeout(done, 50))")
    assert len(shown_recordings(browser)) == everything
    assert browser.messages() == []


def test_the_last_of_several_choices_in_a_row_is_shown(browser, page):
    browser.open(page, "#recording=0mm/r01")
    wait_for_title(browser, "0mm/r01: ")
    browser.run("for (let step = 0; step < 9; step += 1) document.getElementById('next').click()")
    wait_for_title(browser, f"{RECORDINGS[9]}: ")
    assert not browser.run("return document.getElementById('viewer').hasAttribute('aria-busy')")


def test_choosing_a_recording_by_click_key_and_address(browser, page):
    browser.open(page)
    browser.find("a[href='#recording=6mm/r02']").click()
    wait_for_title(browser, "6mm/r02: 6 mm nodule, taken for ")
    assert browser.run("return document.activeElement.id") == "viewer-title"
    browser.find("a[href='#recording=0mm/r03']").send_keys("\ue007")
    wait_for_title(browser, "0mm/r03: no nodule")
    browser.find("#next").send_keys(" ")
    wait_for_title(browser, "1mm/r01: ")
    browser.find("#previous").click()
    wait_for_title(browser, "0mm/r03: ")
    browser.open(page, "#recording=unlabelled/u1")
    wait_for_title(browser, "unlabelled/u1: unlabelled, taken for ")
    assert browser.find("#next").get_attribute("disabled")
    assert browser.messages() == []


def test_next_keeps_to_the_filter(browser, page):
    browser.open(page, "#recording=1mm/r01")
    browser.run(
        "const size = document.getElementById('filter-size'); size.value = '6 mm';"
        "size.dispatchEvent(new Event('change'))"
    )
    browser.find("#next").click()
    wait_for_title(browser, "6mm/r01")


def test_the_signals_in_the_page_are_those_of_the_files(browser, page, project):
    browser.open(page)
    script = (
        "return Chooser.read(arguments[0]).then((e) => [Signals.unpack(e.readings),"
        "Signals.unpack(e.matrix), e.matrix.every, e.verdicts])"
    )
    for name in ("0mm/r01", "6mm/r03"):
        readings, matrix, every, verdicts = browser.run(script, name)
        with (project.raw / f"{name}.csv").open("rb") as stream:
            recording = read_recording(stream, 4)
        assert np.array_equal(np.array(readings), recording.values)
        stored = np.load(project.results / "matrices" / f"{name}.npy")
        expected = stored[:, : recording.time_s.size : every]
        assert np.allclose(matrix, expected, atol=expected.max() / 250 + 1e-12)
        rows = project.table("evaluation/predictions.csv")
        (row,) = [
            r
            for r in rows
            if (r["recording"], r["detector"], r["scheme"]) == (name, "template", "leave_one_out")
        ]
        distances = [float(row[f"rmse_{size}mm"]) for size in SIZES]
        assert verdicts[0]["distances"] == distances
        assert verdicts[0]["predicted_mm"] == float(row["predicted_mm"])


def test_contours_lie_at_their_height(browser, page):
    browser.open(page)
    segments = np.array(
        browser.run(
            "const at = (x, y) => Math.hypot(x - 10, y - 10);"
            "const rows = Array.from({length: 21}, (_, y) => "
            "Array.from({length: 21}, (_, x) => at(x, y)));"
            "return Signals.contourSegments(rows, 6)"
        )
    )
    ends = segments.reshape(-1, 2)
    assert len(segments) > 30
    assert np.allclose(np.hypot(*(ends - 10).T), 6, atol=0.05)


def test_every_sensor_has_a_line_of_its_own_and_further_ones_repeat_them(browser, page):
    lines = "return Array.from({length: 12}, (_, s) => JSON.stringify(Palette.sensorLine(s)))"
    browser.open(page)
    light = browser.run(lines)
    distinct = len(set(light))
    assert distinct >= 4
    assert light == [light[sensor % distinct] for sensor in range(12)]
    browser.open(page, dark=True)
    dark = browser.run(lines)
    assert len(set(dark)) == distinct and not set(dark) & set(light)


def test_the_key_names_the_lines_that_are_drawn_also_when_the_theme_changes(browser, page):
    shown = (
        "return [...document.querySelectorAll('#viewer .key li')].map((item, sensor) => {"
        "const [drawn, line] = [item.querySelector('svg'), Palette.sensorLine(sensor)];"
        "return [item.textContent, drawn.getAttribute('stroke') === line.colour]})"
    )
    first = "return document.querySelector('#viewer .key svg').getAttribute('stroke')"
    browser.open(page, dark=True)
    assert browser.run(shown) == [[f"sensor {sensor}", True] for sensor in (1, 2, 3, 4)]
    on_dark = browser.run(first)
    browser.prefer(dark=False)
    # A page hears of the theme just before it draws its next frame.
    browser.wait_for_frame()
    assert browser.run(shown) == [[f"sensor {sensor}", True] for sensor in (1, 2, 3, 4)]
    assert browser.run(first) != on_dark


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [PHONE, DESKTOP])
def test_axe_finds_no_fault(browser, page, width, dark):
    browser.open(page, "#recording=2.5mm/r01", width=width, dark=dark)
    browser.run("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    assert browser.violations() == []
    assert browser.messages() == []


@pytest.mark.parametrize("width", [PHONE, DESKTOP])
def test_nothing_reaches_beyond_the_screen(browser, page, width):
    browser.open(page, "#recording=2.5mm/r01", width=width)
    assert browser.run("return document.documentElement.scrollWidth") <= width
    browser.picture(PICTURES / f"light-{width}.png")


def test_a_click_selects_the_methods_and_the_references_to_copy_them(browser, page, project):
    browser.open(page)
    browser.run("document.querySelectorAll('#made details').forEach((d) => { d.open = true; })")
    for name, start in (
        ("methods-text", "The archive holds N = 12 recordings"),
        ("bibtex", "@misc"),
    ):
        browser.find(f"#{name}").click()
        chosen = browser.run("return getSelection().toString().trim()")
        assert chosen == browser.find(f"#{name}").text.strip() and chosen.startswith(start)
    references = (ROOT / "workflow/report/references.bib").read_text(encoding="utf-8")
    assert browser.find("#bibtex").text.strip() == references.strip()
    # A copy of the project's folders holds neither pyproject.toml nor a clone.
    assert browser.find("#project").text == "origami-capsule, version not known"


def test_symbols_are_typeset_and_equations_have_numbers(browser, page):
    browser.open(page)
    rows = browser.run(
        "return Object.fromEntries([...document.querySelectorAll('#configuration tbody tr')]"
        ".map((row) => [row.cells[0].querySelector('code').textContent,"
        "[row.cells[0].querySelector('.symbol')?.innerHTML ?? '', row.cells[3].textContent]]))"
    )
    sigma, mu, delta = "\u03c3", "\u03bc", "\u0394"
    assert rows["fit.vertical_spread_range"] == [f"<i>{sigma}</i><sup>ver</sup>", "Eq. 14"]
    assert rows["fit.peak_spacing_range"] == [f"{delta}<i>{mu}</i><sup>hor</sup>", "Eq. 13"]
    assert rows["fit.integer_step"] == [f"<i>{sigma}</i><sub>ite</sub>", "Eq. 22"]
    assert rows["diagonal.wavelength_mm"][1] == "section II-C, Small Intestine Simulator"
    shown = browser.run("return document.body.innerText")
    assert not re.search(
        r"\beq\. \w|sigma_|\^(ver|hor)|[^\w\u2212-]-\d|\u22120(\.0+)?(?![\d.])", shown
    )


def test_the_dark_page_is_dark(browser, page):
    browser.open(page, dark=True)
    colour = browser.run("return getComputedStyle(document.body).backgroundColor")
    assert max(int(part) for part in re.findall(r"\d+", colour)[:3]) < 60
    browser.picture(PICTURES / "dark-1280.png")


@pytest.mark.parametrize("on_paper", [False, True])
@pytest.mark.parametrize("dark", [False, True])
def test_figures_are_dark_on_white_in_every_theme(browser, page, tmp_path, dark, on_paper):
    browser.open(page, dark=dark)
    # Behind a closed fold a figure has no place on the page.
    browser.run("for (const fold of document.querySelectorAll('details')) fold.open = true")
    browser.prefer(dark=dark, on_paper=on_paper)
    browser.picture(tmp_path / "page.png")
    pixels = imread(tmp_path / "page.png")[..., :3]
    corners = browser.run(
        "return [...document.querySelectorAll('main figure img')].map((image) => {"
        "const { left, top } = image.getBoundingClientRect();"
        "return [Math.round(left) + 8, Math.round(top + scrollY) + 2]})"
    )
    # The page does not show the learning curves: they are files.
    shown = len(FIGURES) - 1 + len(browser.texts("#surveys article"))
    assert len(corners) == shown
    assert {to_hex(pixels[y, x]) for x, y in corners} == {"#ffffff"}


def test_it_can_be_printed(browser, page):
    browser.open(page, "#recording=2.5mm/r01")
    printed = browser.print(PICTURES / "report.pdf")
    assert printed.startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", printed)) >= 4


def test_the_same_inputs_give_the_same_page_but_for_one_marked_line(page, project, tmp_path):
    before = page.read_text(encoding="utf-8").splitlines()
    again = project.copy(tmp_path / "again")
    shutil.rmtree(again.results / "figures")
    assert again.snakemake("--forcerun", "report").status == 0
    after = (again.results / "report.html").read_text(encoding="utf-8").splitlines()
    assert len(before) == len(after)
    changed = [number for number, line in enumerate(before) if line != after[number]]
    marks = [n for n, line in enumerate(before) if line.startswith("<!-- the next line changes")]
    assert len(marks) == 1
    assert set(changed) <= {marks[0] + 1}
