"""The first screen answers in ten seconds: its height, its words, and tables inside their boxes."""

import pytest

from support import browser as chromium

pytestmark = [pytest.mark.browser, chromium.needed]
WORDS = """
  const first = document.querySelector('main svg'), words = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode;
    if (first.compareDocumentPosition(text) & Node.DOCUMENT_POSITION_FOLLOWING) break;
    if (!text.parentElement.closest('script, style, .skip')) {
      words.push(...text.data.split(/\\s+/).filter((word) => /\\w/.test(word)));
    }
  }
  return words.length
"""
WIDE = """
  return [...document.querySelectorAll('main table')].filter((table) =>
    table.getClientRects().length && table.scrollWidth > table.parentElement.clientWidth + 1
  ).map((table) => table.id)
"""
BOTTOM = "return Math.max(...[...document.querySelectorAll(arguments[0])].map((each) => each.getBoundingClientRect().bottom))"  # fmt: skip  # noqa: E501


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (400, 800)])
def test_the_first_screen_holds_the_verdict_and_its_drawing(browser, page, width, height):
    browser.open(page, width=width)
    assert browser.run(BOTTOM, ".card:first-child svg") <= height
    assert width < 600 or browser.run(BOTTOM, ".panels .count") <= height
    assert browser.run(WORDS) <= 60


@pytest.mark.parametrize("width", [1280, 768, 400])
def test_no_table_is_wider_than_its_box(browser, page, width):
    browser.open(page, width=width)
    browser.run("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    assert browser.run(WIDE) == []


def test_what_is_folded_is_not_printed(browser, page):
    browser.open(page)
    browser.lay_on_paper()
    assert browser.run("return document.querySelectorAll('main details[open]').length") == 0
    browser.run("window.dispatchEvent(new Event('afterprint'))")
