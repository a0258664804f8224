"""Tests of folded parts of the page, which open by hand, by a link and on paper."""

import re

import pytest

from support.browser import DESKTOP, needed

pytestmark = [
    pytest.mark.browser,
    needed,
]
FOLDS = "return [...document.querySelectorAll('main details')]"
TERMS = 18


def pages(printed):
    return len(re.findall(rb"/Type\s*/Page\b", printed))


def test_most_of_the_page_is_folded_and_what_stays_is_short(browser, page):
    browser.open(page, width=DESKTOP)
    assert browser.run(f"{FOLDS}.filter((fold) => fold.open).length") == 0
    # Rows scroll within the table of recordings: their number does not lengthen the page.
    folded = browser.run("return document.documentElement.scrollHeight")
    surveys = browser.run("return document.getElementById('surveys').offsetHeight")
    browser.run("document.querySelectorAll('details.fold').forEach((d) => { d.open = true; })")
    opened = browser.run("return document.documentElement.scrollHeight")
    assert folded - surveys <= 9200 and opened > 1.5 * folded
    # However many surveys there are, one of them stands open.
    assert surveys <= 2600


@pytest.mark.parametrize(
    "name", ["benches", "calibration", "glossary", "term-rmse", "all-settings"]
)
def test_a_link_opens_the_fold_that_it_leads_into(browser, page, name):
    browser.open(page)
    seen = f"return document.getElementById('{name}').checkVisibility()"
    browser.run(f"location.hash = '{name}'; return new Promise((done) => setTimeout(done, 100))")
    assert browser.run(seen)
    within = f"return document.getElementById('{name}').closest('details').open"
    assert browser.run(within) is True
    browser.open(page, f"#{name}")
    assert browser.run(within) is True


def test_charts_in_a_fold_of_the_viewer_are_drawn_when_it_opens(browser, page):
    browser.open(page)
    drawn = "return document.querySelectorAll('#viewer details canvas').length"
    assert browser.run(drawn) == 0
    browser.find("#viewer details > summary").click()
    browser.run("return new Promise((done) => setTimeout(done, 200))")
    assert browser.run(drawn) == 2
    # It stays open for the next recording.
    browser.run("document.getElementById('next').click()")
    browser.run("return new Promise((done) => setTimeout(done, 200))")
    assert browser.run(drawn) == 2
    widths = browser.run(
        "return [...document.querySelectorAll('#viewer canvas')].map((each) => each.clientWidth)"
    )
    assert len(set(widths)) == 1 and widths[0] > 500


def test_each_term_of_the_glossary_is_linked_where_it_first_stands(browser, page):
    browser.open(page)
    linked = browser.run(
        "return [...document.querySelectorAll('a.term')].map((each) => "
        "[each.getAttribute('href').slice(1), each.textContent])"
    )
    named = browser.run(
        "return [...document.querySelectorAll('.terms dt')].map((each) => "
        "[each.id, each.dataset.words, each.nextElementSibling.textContent])"
    )
    assert len(named) == TERMS and all(meaning.strip() for _, _, meaning in named)
    # The text before each link, and the whole text, without what no term is linked in.
    *before, whole = browser.run(
        "const main = document.querySelector('main');"
        "return [...document.querySelectorAll('a.term'), null].map((each) => {"
        " const range = document.createRange();"
        " range.selectNodeContents(main); if (each) range.setEndBefore(each);"
        " const part = range.cloneContents();"
        " part.querySelectorAll('h1, h2, h3, a, button, code, pre, blockquote, .terms, #viewer, "
        "#recordings-table, #configuration, [data-shown], output, summary, label, option, svg, "
        "script').forEach((apart) => apart.remove());"
        " return part.textContent; })"
    )
    words = {name: wanted for name, wanted, _ in named}

    def stands_in(text, name):
        return re.search(rf"(?<![\w-])(?:{words[name]})(?![\w-])", text, re.IGNORECASE)

    for (name, text), earlier in zip(linked, before, strict=True):
        assert re.fullmatch(words[name], text, re.IGNORECASE)
        assert not stands_in(earlier, name), name
    linked_names = [name for name, _ in linked]
    assert len(set(linked_names)) == len(linked_names) > TERMS / 2
    # This archive has no held-out session, so not every term stands on its page.
    assert not [name for name in set(words) - set(linked_names) if stands_in(whole, name)]
