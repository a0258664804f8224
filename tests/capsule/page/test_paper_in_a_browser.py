"""The report on paper: whole, dark on white, whatever screen and theme it is printed from."""

import numpy as np
import pytest
from matplotlib.image import imread

from support.browser import DESKTOP, PAPER, PHONE, needed

pytestmark = [
    pytest.mark.browser,
    needed,
]
CHOSEN = "#recording=2.5mm/r01&detector=diagonal"
WIDTHS = "return [...document.querySelectorAll('#viewer .canvas canvas')].map((c) => c.width)"


@pytest.mark.parametrize("width", [PHONE, DESKTOP])
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_nothing_is_cut_off(browser, page, width, dark):
    browser.open(page, CHOSEN, width=width, dark=dark)
    browser.lay_on_paper(dark=dark)
    shown = browser.run(
        "return [...document.querySelectorAll('main :is(table, img, canvas, pre, .card, .facts)')]"
        ".filter((e) => e.offsetParent !== null).map((e) => {"
        "const { left, right, height } = e.getBoundingClientRect();"
        "const box = e.closest('.canvas')?.getBoundingClientRect();"
        "return [e.id || e.className || e.tagName, Math.floor(left), Math.ceil(right), height,"
        "Math.ceil(box?.right ?? right)]})"
    )
    names = [name for name, *_ in shown]
    assert {"recordings-table", "configuration", "CANVAS", "IMG"} <= set(names)
    assert [row for row in shown if row[1] < 0 or row[2] > min(PAPER, row[4]) or row[3] == 0] == []


def test_the_table_of_recordings_is_let_out_of_its_box(browser, page):
    browser.open(page)
    box = (
        "const { maxHeight, overflowY } = getComputedStyle(document.querySelector('.tall'));"
        "return [maxHeight, overflowY]"
    )
    assert browser.run(box) == ["336px", "auto"]
    browser.lay_on_paper()
    assert browser.run(box) == ["none", "visible"]
    # A button would be missing in the heads that are repeated on every page.
    displays = (
        "return [...document.querySelectorAll('th button')].map((b) => getComputedStyle(b).display)"
    )
    assert set(browser.run(displays)) == {"contents"}


@pytest.mark.parametrize("width", [PHONE, DESKTOP])
def test_charts_are_drawn_for_paper_and_then_for_the_screen_again(browser, page, width):
    browser.open(page, CHOSEN, width=width)
    on_screen = browser.run(WIDTHS)
    browser.run("window.dispatchEvent(new Event('beforeprint'))")
    # 44rem; no chart is drawn again between this event and the paper.
    assert set(browser.run(WIDTHS)) == {704}
    browser.run("window.dispatchEvent(new Event('afterprint'))")
    assert browser.run(WIDTHS) == on_screen and 704 not in on_screen


def test_paper_does_not_show_the_theme_that_it_was_printed_from(browser, page, tmp_path):
    printed = []
    for dark in (False, True):
        browser.open(page, CHOSEN, dark=dark)
        browser.lay_on_paper(dark=dark)
        browser.picture_at_rest(tmp_path / f"{dark}.png")
        printed.append(imread(tmp_path / f"{dark}.png")[..., :3])
    light, dark = printed
    assert light.shape == dark.shape
    assert np.array_equal(light, dark)
    assert np.median(light) == 1.0
