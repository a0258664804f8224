"""Surveys in the report, by eye and by hand: the picture, the places, and the slider."""

import json

import numpy as np
import pytest

from capsule.geometry.origami import sensor_offsets, vertices
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.survey.cycle import STATES
from support.browser import PHONE, needed
from support.surveys import head_mm

pytestmark = [
    pytest.mark.browser,
    needed,
]

PHANTOM = read_phantom(DEFAULT_TABLE, [])
FOLDED_MM = PHANTOM.folding.half_width_mm
MOVE = (
    "const slider = document.getElementById('moment-demo'); slider.value = arguments[0];"
    "slider.dispatchEvent(new Event('input'))"
)
CORNERS = (
    "return [...document.querySelectorAll(`${arguments[0]} .hexagon`)].map((path) => "
    "[path.dataset.sensor, ...path.getAttribute('d').match(/-?[\\d.]+/g).map(Number)])"
)


def hexagons(browser, where="#surveys > article .closeup"):
    """Return the corners of each sensor's hexagon, (6, 2), in pixels of the drawing."""
    return {
        int(sensor): np.array(numbers).reshape(6, 2)
        for sensor, *numbers in browser.run(CORNERS, where)
    }


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
        ["1", "confirmed", "3.1 mm (2.4 to 3.9)", "36.4 mm", "2", "6.00"],
        ["2", "undecided", "n/a", "71.0 mm", "1", "not known"],
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


def pixels_of(browser):
    """Return a function from places in mm to pixels, from the ticks of the axis."""
    ticks = browser.run(
        "return [...document.querySelector('#surveys > article .closeup').querySelectorAll('text')]"
        ".filter((text) => text.getAttribute('text-anchor') === 'middle')"
        ".map((text) => [Number(text.textContent), Number(text.getAttribute('x'))])"
        ".filter(([mm]) => !Number.isNaN(mm))"
    )
    places, pixels = np.array(sorted(ticks)).T
    unit = (pixels[-1] - pixels[0]) / (places[-1] - places[0])
    return lambda mm: pixels[0] + (mm - places[0]) * unit, unit


@pytest.mark.parametrize(("time_s", "half_mm"), [(50.4, 10.0), (160.0, FOLDED_MM)])
def test_the_hexagons_are_the_capsules_where_the_head_was(browser, page, project, time_s, half_mm):
    browser.open(page)
    browser.run(MOVE, time_s)
    drawn = hexagons(browser)
    assert set(drawn) == {1, 2, 3, 4}
    corners = vertices(PHANTOM.origami)
    upper = np.array([corners[name] for name in "ACB"])
    # A drawing's y points downward; folded, the awns are drawn in.
    wanted = np.concatenate([upper * [1, -1], upper[::-1]]) * [1, half_mm / 10]
    scale, unit = pixels_of(browser)
    track = json.loads((project.results / "surveys/demo/survey.json").read_text())["player"]
    head = np.interp(time_s, *np.array(track["head"]).T)
    if half_mm == 10.0:
        assert head == pytest.approx(head_mm(np.array(time_s)), abs=0.5)
    for sensor, offset in enumerate(sensor_offsets(PHANTOM.origami, 4), start=1):
        shoulder = drawn[sensor][1]
        assert shoulder[0] == pytest.approx(scale(head - offset), abs=0.05)
        middle = shoulder + np.array([0, wanted[4, 1] * unit])
        np.testing.assert_allclose((drawn[sensor] - middle) / unit, wanted, atol=0.01)


def test_the_capsule_moves_through_the_picture_itself(browser, page, project):
    browser.open(page)
    frame = json.loads((project.results / "surveys/demo/survey.json").read_text())["frames"]["wide"]
    browser.run(MOVE, 60.0)
    drawn = hexagons(browser, "#surveys > article .overlay")[1]
    left, top, width, height = frame["map"]["box"]
    low, high = frame["map"]["x"]
    end, start = frame["map"]["y"]
    assert drawn[1, 0] == pytest.approx(
        left + (head_mm(np.array(60.0)) - low) / (high - low) * width, abs=0.5
    )
    assert drawn[:, 1].mean() == pytest.approx(
        top + (1.0 - start) / (end - start) * height, abs=0.5
    )


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
    wide = "return document.querySelector(`#survey-second ${arguments[0]}`).clientWidth"
    shown = browser.run("return document.querySelector('article .closeup').clientWidth")
    assert shown > 600
    assert browser.run(wide, ".closeup") == pytest.approx(shown, abs=2)
    assert browser.run(wide, ".uplot") > 600
    assert browser.messages() == []


def test_it_fits_a_phone_and_stays_within_it(browser, page):
    browser.open(page, width=PHONE, dark=True)
    browser.run(MOVE, 160.0)
    assert browser.run("return document.documentElement.scrollWidth") == PHONE
    assert browser.run(
        "const image = document.querySelector('#surveys img');"
        "return image.currentSrc === document.querySelector('#surveys source').srcset"
    )
    assert hexagons(browser, "#surveys > article .overlay")
    assert browser.messages() == []


def test_on_paper_the_picture_stands_alone(browser, page):
    browser.open(page)
    browser.lay_on_paper()
    assert browser.find("#surveys img").is_displayed()
    assert not browser.find("#surveys .player").is_displayed()
    assert not browser.find("#surveys .overlay").is_displayed()
    browser.run("window.dispatchEvent(new Event('afterprint'))")
    browser.prefer(dark=False)
