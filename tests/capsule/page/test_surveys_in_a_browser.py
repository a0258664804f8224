"""Surveys in the report, by eye and by hand: the picture, the places, and the slider."""

import json
import re

import numpy as np
import pytest

from capsule.figures.draw_survey import frame_of, survey_drawing
from capsule.figures.style import PAGE_WIDTH_IN
from capsule.page.surveys import page_values, player, survey_values
from capsule.survey.cycle import STATES
from capsule.survey.files import parse_session
from capsule.survey.track import crest_at_mm, pins_of, track_of
from support.browser import PHONE, needed
from support.surveys import DETECTOR, head_mm, lost_contents

pytestmark = [
    pytest.mark.browser,
    needed,
]

MOVE = (
    "const slider = document.getElementById('moment-demo'); slider.value = arguments[0];"
    "slider.dispatchEvent(new Event('input'))"
)


def test_the_section_shows_each_survey_with_its_places(browser, page):
    browser.open(page)
    assert browser.find("nav a[href='#surveys']").is_displayed()
    assert browser.texts("#surveys > article h3") == ["demo, simulated"]
    assert browser.texts("#survey-second > summary") == ["second, simulated"]
    rows = browser.run(
        "return [...document.querySelectorAll('#survey-demo-table tbody tr')]"
        ".map((row) => [...row.cells].map((cell) => cell.textContent))"
    )
    assert rows == [
        ["1", "nodule", "3.1 mm (2.4 to 3.9)", "36.4 mm", "2", "6.00"],
        ["2", "uncertain: pass again", "n/a", "71.0 mm", "1", "not known"],
    ]
    assert browser.run(
        "const image = document.querySelector('#surveys img'); return image.naturalWidth > 400"
    )
    text = browser.find("#surveys").text
    assert "Neither this project nor the paper measured the folding" in text
    assert "A gut offers no such odometer" in text
    assert browser.texts("#surveys-not-shown code") == ["sessions/running"]
    assert "--resume" in browser.find("#surveys-not-shown").text


def test_the_slider_is_named_and_moved_by_keys(browser, page):
    browser.open(page)
    slider = browser.find("#moment-demo")
    assert browser.texts("label[for='moment-demo']") == ["Moment of the survey demo, simulated"]
    slider.send_keys("\ue011")
    first = slider.get_attribute("aria-valuetext")
    assert first.startswith("0 min 00 s: the capsule waits")
    slider.send_keys("\ue014" * 3)
    assert slider.get_attribute("aria-valuetext").startswith("0 min 03 s")
    slider.send_keys("\ue010")
    assert slider.get_attribute("aria-valuetext").startswith("5 min 4")
    assert browser.messages() == []


def test_it_says_in_words_what_the_capsule_does(browser, page, project):
    browser.open(page)
    stored = json.loads((project.results / "surveys/demo/survey.json").read_text())
    for time_s, state in ((50, "exploring"), (160, "returning"), (240, "passing")):
        browser.run(MOVE, time_s)
        said = browser.find("output.moment").text
        assert STATES[state] in said
        assert ("position not measured" in said) == (state == "returning")
        assert stored["player"]["words"][state] == STATES[state]
    assert "score 0.05, threshold 0.15" in said


def test_a_mark_moves_through_the_picture_itself(browser, page, project):
    browser.open(page)
    frame = json.loads((project.results / "surveys/demo/survey.json").read_text())["frame"]
    browser.run(MOVE, 60.0)
    left, top, width, height = frame["map"]["box"]
    low, high = frame["map"]["x"]
    end, start = frame["map"]["y"]
    across = left + (head_mm(np.array(60.0)) - low) / (high - low) * width
    down = top + (1.0 - start) / (end - start) * height
    place = "const { cx, cy } = document.querySelector('#surveys > article .overlay .head');"
    drawn = browser.run(f"{place} return [cx.baseVal.value, cy.baseVal.value]")
    assert drawn == pytest.approx([across, down], abs=0.5)


def test_buttons_lead_to_places_and_events(browser, page):
    browser.open(page)
    buttons = {
        each.text: each for each in browser.driver.find_elements("css selector", ".steps button")
    }
    buttons["Place 2"].send_keys("\ue007")
    slider = browser.find("#moment-demo")
    assert float(slider.get_attribute("value")) == pytest.approx(320, abs=0.5)
    buttons["Place 1"].send_keys("\ue007")
    assert slider.get_attribute("aria-valuetext").startswith("1 min 36 s")
    buttons["Next event"].send_keys(" ")
    assert slider.get_attribute("aria-valuetext").startswith("2 min 00 s")
    buttons["Previous event"].send_keys(" ")
    assert "Last event: suspected" in browser.find("output.moment").text


def test_a_survey_that_was_folded_away_is_drawn_when_it_is_opened(browser, page):
    browser.open(page)
    browser.find("#survey-second summary").click()
    browser.run("return new Promise((done) => setTimeout(done, 100))")
    wide = "return document.querySelector('#survey-second .uplot').clientWidth"
    assert browser.run(wide) > 600
    assert browser.messages() == []


def test_a_survey_that_never_knew_its_position_is_replayed_without_a_mark(browser, page, tmp_path):
    lost = parse_session("demo", lost_contents())
    track, pins = track_of(lost), pins_of(lost)
    _, draw = survey_drawing(lost, "demo", track, pins, (80.0, crest_at_mm(lost, DETECTOR)))
    values = survey_values(lost, track, pins) | {"player": player(lost, track)}
    (shown,) = page_values([values | {"frame": frame_of(draw(PAGE_WIDTH_IN))}], {})["shown"]
    before, data, after = re.split(
        '(?<=data-survey="demo">)(.*?)(?=</script>)', page.read_text("utf-8"), maxsplit=1
    )
    assert json.loads(data)["player"]["head"]
    (tmp_path / "report.html").write_text(f"{before}{shown['data']}{after}", "utf-8")
    browser.open(tmp_path / "report.html")
    browser.run(MOVE, 60.0)
    assert "Head anywhere, position not measured; score 0.05" in browser.find("output.moment").text
    assert not browser.run("return document.querySelector('#surveys > article .overlay .head')")
    assert browser.texts("#survey-second > summary") and browser.find("#chosen").is_displayed()
    assert browser.messages() == []


def test_it_fits_a_phone_and_stays_within_it(browser, page):
    browser.open(page, width=PHONE, dark=True)
    browser.run(MOVE, 160.0)
    assert browser.run("return document.documentElement.scrollWidth") == PHONE
    assert browser.find("#surveys > article .overlay .head").is_displayed()
    assert browser.messages() == []


def test_on_paper_the_picture_stands_alone(browser, page):
    browser.open(page)
    browser.lay_on_paper()
    assert browser.find("#surveys img").is_displayed()
    assert not browser.find("#surveys .player").is_displayed()
    assert not browser.find("#surveys .overlay").is_displayed()
    browser.run("window.dispatchEvent(new Event('afterprint'))")
    browser.prefer(dark=False)
