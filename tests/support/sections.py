"""Render single sections of the page, for tests of their words."""

import html
import re
from types import SimpleNamespace

from capsule.evaluation.lead import Lead
from capsule.page import detector_sections
from capsule.page.files import read_frame
from capsule.page.render import environment
from support.evaluated import SETTINGS
from support.project import ROOT


def section(name, **page):
    """Return a section as the browser shows its texts, with its tags."""
    templates = read_frame(ROOT / "workflow" / "report").templates
    template = environment(templates).get_template(f"sections/{name}.html.j2")
    return html.unescape(template.render(page=page))


def cards_of(rates, detector, tolerance_mm=1, lead=None):
    """Return the cards of the first screen by their names, each with its texts."""
    lead = lead or Lead(detector, True, 0.9, 1)
    values = detector_sections.page_values(rates, lead, tolerance_mm)
    page = section("answer", **values, bench_ranges=[], settings=rates.settings)
    cards = {}
    for name, card in re.findall(r'(?s)<div class="card" id="card-(\w+)">(.*?)\n</div>', page):
        value, answer = re.search(
            r'<p class="answer"(?: data-value="(.*?)")?>(.*?)</p>', card
        ).groups()
        beside = dict(re.findall(r'<p class="paper"><strong>(.*?):</strong> (.*?)\.</p>', card))
        cards[name] = {
            "question": re.search("<h4>(.*?)</h4>", card)[1],
            "answer": answer,
            "value": float(value) if value else None,
            "lines": re.findall("<li>(.*?)</li>", card),
            "detail": re.search("(?m)^<p>(.*?)</p>$", card)[1],
            "paper": beside.pop("Paper, as printed"),
            "beside": beside,
        }
    return cards


def summary(origin, ours, detector="diagonal"):
    """Return the sentences that summarise a detector's results."""
    subject = "the paper's detector" if detector == "template" else f"the detector {detector}"
    held_out = ours.scheme == "held_out"
    return section("summary", ours=ours, judged_origin=origin, subject=subject, held_out=held_out)


def trust(ours, single=True, together=(), origin="recorded"):
    """Return the sentences on how far to trust a verdict."""
    page = {"ours": ours, "held_out": ours.scheme == "held_out", "settings": SETTINGS}
    page |= {"single_passes": single, "together": together}
    page |= {"labelled_origin": SimpleNamespace(kind=origin)}
    return section("trust", **page).strip()
