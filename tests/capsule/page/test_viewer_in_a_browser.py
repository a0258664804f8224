"""One recording in a real browser: what every detector judged by, and the address that shows it."""

import numpy as np
import pytest

from support.browser import DESKTOP, PHONE, needed
from support.report_page import SIZES, wait_for_title

pytestmark = [
    pytest.mark.browser,
    needed,
]
EVIDENCE = "return Chooser.read(arguments[0]).then((e) => "
DETECTORS = {
    "template": ["Score", "Nearest template"],
    "diagonal": ["Score", "Beats", "Score along the gut"],
    "taught": ["Score", "Beats", "What each stretch adds"],
}


def prediction(project, recording, detector, scheme="leave_one_out"):
    rows = project.table("evaluation/predictions.csv")
    wanted = recording, detector, scheme
    (row,) = [r for r in rows if (r["recording"], r["detector"], r["scheme"]) == wanted]
    return row


def figures(browser):
    pairs = browser.run(
        "return [...document.querySelectorAll('#viewer .chart')].map((f) => ["
        "f.querySelector('strong').textContent.replace('. ', ''),"
        "f.querySelector('.canvas').getAttribute('aria-label')])"
    )
    return dict(pairs)


@pytest.mark.parametrize("detector", DETECTORS)
def test_every_detector_shows_what_it_judged_by(browser, page, project, detector):
    browser.open(page, f"#recording=6mm/r01&detector={detector}")
    drawn = figures(browser)
    assert list(drawn) == [*DETECTORS[detector], "Readings", "Envelope", "Matrix"]
    row = prediction(project, "6mm/r01", detector)
    exceeds = float(row["score"]) > float(row["threshold"])
    assert ("exceeds it" if exceeds else "does not exceed it") in drawn["Score"]
    for key in ("score", "threshold"):
        number = float(f"{float(row[key]):.3g}")
        assert f"{key} {number:g}" in drawn["Score"].replace("\u2212", "-").replace(
            "threshold is", "threshold"
        ).replace("Score", "score")
    size = float(row["predicted_mm"])
    said = browser.find("#viewer .verdict strong").text
    assert said.startswith(f"{size:g} mm" if size else "no nodule")
    wait_for_title(browser, "6mm/r01: 6 mm nodule, taken for ")
    assert f" by {detector} (" in browser.find("#viewer-title").text
    assert browser.messages() == []


def test_the_score_along_the_gut_ends_in_the_verdict(browser, page, project):
    browser.open(page)
    script = EVIDENCE + "[Signals.unpack(e.gut)[0], e.gut.step_mm, e.nodule_at_mm, e.beats])"
    index = {row["recording"]: row for row in project.table("recordings.csv")}
    for name in ("0mm/r02", "1mm/r01", "6mm/r03"):
        scores, step_mm, truth, beats = browser.run(script, name)
        row = prediction(project, name, "diagonal")
        assert max(scores) == pytest.approx(float(row["score"]), abs=0.01)
        (searched,) = [
            each
            for each in project.table(f"best_places/{name.split('/')[0]}/batch.csv")
            if each["recording"] == name
        ]
        assert step_mm * int(np.argmax(scores)) == float(searched["location_mm"])
        assert beats["passed_s"][0] == pytest.approx(float(searched["location_samples"]) / 10)
        written = index[name]["nodule_at_mm"]
        assert truth == (float(written) if written else None)


def test_the_template_is_drawn_as_it_was_averaged_at_its_best_lag(browser, page, project):
    browser.open(page)
    script = EVIDENCE + (
        "e.templates.resubstitution).then((t) => "
        "[t.size_mm, t.from, Signals.surfaceRows(t, 4, 1000, 1)])"
    )
    with np.load(project.results / "templates.npz") as stored:
        templates = dict(stored.items())
    for name in ("1mm/r02", "6mm/r03"):
        size, shift, rows = browser.run(script, name)
        row = prediction(project, name, "template", "resubstitution")
        distances = {each: float(row[f"rmse_{each:g}mm"]) for each in SIZES if each}
        assert size == min(distances, key=distances.get)
        template = templates[f"{size:g}mm"]
        moved = np.zeros((4, 1000))
        source = np.arange(1000) - shift
        inside = (source >= 0) & (source < template.shape[1])
        moved[:, inside] = template[:, source[inside]]
        assert np.allclose(rows, moved, atol=1e-3)
        # Where it lies, the margin is the score of the table.
        matrix = np.load(project.results / "matrices" / f"{name}.npy")
        gain = 2 * np.sum(matrix * moved) - np.sum(template**2)
        assert gain == pytest.approx(float(row["score"]), rel=1e-4, abs=1e-3)


def test_the_marks_are_the_scores_of_the_csv_file(browser, page, project):
    browser.open(page)
    data = browser.run("return JSON.parse(document.getElementById('page-data').text).scores")
    rows = project.table("evaluation/predictions.csv")
    for detector, scheme in [("diagonal", "leave_one_out"), ("taught", "resubstitution")]:
        chosen = [r for r in rows if (r["detector"], r["scheme"]) == (detector, scheme)]
        for marks in data[f"{detector}|{scheme}"]:
            of_size = [r for r in chosen if float(r["size_mm"]) == marks["size_mm"]]
            scores = sorted(float(r["score"]) for r in of_size if r["score"])
            assert marks["scores"] == pytest.approx(scores, rel=1e-4)


def test_the_fit_is_told_between_the_checksum_and_the_header(browser, page):
    names = "return [...document.querySelectorAll('#viewer .facts dt')].map((n) => n.textContent)"
    for recording, first in (
        ("6mm/r01", ["File", "SHA-256", "Fit"]),
        ("0mm/r01", ["File", "SHA-256"]),
    ):
        browser.open(page, f"#recording={recording}")
        wait_for_title(browser, recording)
        told = browser.run(names)
        assert told[: len(first)] == first
        assert all(name.startswith("# ") for name in told[len(first) :])


def test_the_address_names_recording_and_detector_and_back_returns(browser, page):
    browser.open(page, "#recording=1mm/r02&detector=diagonal")
    title = "1mm/r02: 1 mm nodule, taken for "
    wait_for_title(browser, title)
    current = "return document.querySelector('.judges [aria-current]').textContent"
    assert browser.run(current) == "diagonal"
    browser.find(".judges li:nth-child(3) a").click()
    address = "return location.hash"
    assert browser.run(address) == "#recording=1mm/r02&detector=taught"
    wait_for_title(browser, title)
    # A link to a recording keeps the detector, and so does the button.
    browser.find("#recordings-table a[href='#recording=6mm/r02']").click()
    wait_for_title(browser, "6mm/r02")
    assert browser.run(address) == "#recording=6mm/r02&detector=taught"
    browser.find("#next").click()
    wait_for_title(browser, "6mm/r03")
    assert browser.run(address) == "#recording=6mm/r03&detector=taught"
    browser.driver.back()
    wait_for_title(browser, "6mm/r02")
    browser.driver.back()
    wait_for_title(browser, "1mm/r02")
    browser.driver.back()
    browser.run("return new Promise((done) => setTimeout(done, 200))")
    assert browser.run(current) == "diagonal"
    browser.driver.forward()
    browser.run("return new Promise((done) => setTimeout(done, 200))")
    assert browser.run(current) == "taught"
    assert browser.messages() == []


@pytest.mark.parametrize(
    "address",
    [
        "#recording=%E0%A4%A",
        "#recording=no/such&detector=diagonal",
        "#detector=%3Cscript%3E&recording=1mm/r01",
        "#recording=__proto__&scheme=constructor",
        "#recording=&detector=",
        "#made",
    ],
)
def test_an_address_that_names_nothing_of_the_page_shows_the_recording_of_the_first_card(
    browser, page, address
):
    browser.open(page, address)
    first = (
        "1mm/r01" if "1mm/r01" in address else browser.find("#viewer").get_attribute("data-first")
    )
    wait_for_title(browser, f"{first}: ")
    assert browser.messages() == []


def test_readings_have_their_unit(browser, page):
    browser.open(page, "#recording=2.5mm/r01")
    assert figures(browser)["Readings"] == "Readings of 4 sensors over time, in counts of the ADC."
    length = "return [0.3, 7, 10, 49.9, 1234].map(ChartFrame.roundLength)"
    assert browser.run(length) == pytest.approx([0.2, 5, 10, 20, 1000])


@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [PHONE, DESKTOP])
def test_axe_finds_no_fault_in_the_evidence(browser, page, width, dark, detector):
    browser.open(page, f"#recording=2.5mm/r01&detector={detector}", width=width, dark=dark)
    # The rest of the page is the same for every detector.
    assert browser.violations("#viewer") == []
    assert browser.run("return document.documentElement.scrollWidth") <= width
    assert browser.messages() == []


def test_numbers_have_a_minus_sign_and_zero_has_none(browser, page):
    browser.open(page)
    written = browser.run(
        "const { number, significant } = Elements;"
        "return [number(-0.004, 2), number(-0.25, 2), number(-0), number(-3), number(1.5, 0),"
        "significant(-0.0012345), significant(1234.5), significant(-1e-9), number(1.25)]"
    )
    minus = "\u2212"
    assert written == [
        *("0.00", f"{minus}0.25", "0", f"{minus}3", "2"),
        *(f"{minus}0.00123", "1230", f"{minus}1e{minus}9", "1.25"),
    ]


def test_charts_write_numbers_as_the_page_does(browser, page):
    written = []
    for detector in ("template", "diagonal", "taught"):
        browser.open(page, f"#recording=0mm/r01&detector={detector}")
        browser.run(
            "window.written = [];"
            "const fill = CanvasRenderingContext2D.prototype.fillText;"
            "CanvasRenderingContext2D.prototype.fillText = function (text, ...where) {"
            "window.written.push(String(text)); return fill.call(this, text, ...where); };"
        )
        # In the other theme all charts are drawn again, before the page's next frame.
        browser.prefer(dark=True)
        browser.wait_for_frame()
        written += browser.run("return window.written")
    assert any(text.startswith("\u2212") for text in written)
    assert [text for text in written if "-" in text or text == "\u22120"] == []
