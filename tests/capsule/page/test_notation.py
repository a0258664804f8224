"""Equations by their printed numbers, and symbols in parts."""

import re

import pytest

from capsule.page import notation
from support.evaluated import read_paper
from support.project import ROOT

EQUATIONS = read_paper()["equations"]


def test_equations_have_the_numbers_that_the_paper_prints():
    # "By substituting the parameters ... into equations (10) and (11)": surface and particle.
    assert notation.cited("eq. generateP", EQUATIONS) == "Eq. 10"
    assert notation.cited("eq. G", EQUATIONS) == "Eq. 11"
    assert notation.cited("eq. RMS_envelope", EQUATIONS) == "Eq. 2"
    assert notation.cited("eq. F' to eq. RMSEmin", EQUATIONS) == "Eq. 15 to Eq. 19"
    assert notation.cited("section IV-B", EQUATIONS) == "section IV-B"
    assert len(set(EQUATIONS)) == len(EQUATIONS) == 28


def test_a_label_that_the_paper_does_not_have_is_refused():
    with pytest.raises(ValueError, match="is not in list"):
        notation.cited("eq. energy", EQUATIONS)


def test_every_equation_that_the_code_cites_has_a_number():
    cited = set()
    for path in sorted((ROOT / "workflow").rglob("*.py")):
        cited |= set(re.findall(r"\beq\. ([A-Za-z0-9_*]+'?)", path.read_text(encoding="utf-8")))
    assert "RMSE" in cited and cited <= set(EQUATIONS)


def test_no_label_stands_where_a_reader_of_the_paper_looks():
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    for path in [*pages, *(ROOT / "workflow/report").rglob("*.j2")]:
        for label in EQUATIONS:
            assert f"eq. {label}" not in path.read_text(encoding="utf-8"), path.name


@pytest.mark.parametrize(
    ("symbol", "parts"),
    [
        ("", []),
        ("N", [("base", "N")]),
        ("sigma^ver", [("base", "\u03c3"), ("sup", "ver")]),
        ("sigma_ite", [("base", "\u03c3"), ("sub", "ite")]),
        ("Delta mu^hor", [("upright", "\u0394"), ("base", "\u03bc"), ("sup", "hor")]),
    ],
)
def test_a_symbol_is_shown_in_parts(symbol, parts):
    assert [(part["kind"], part["text"]) for part in notation.typeset(symbol)] == parts
