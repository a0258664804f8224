"""Tests of what the page says of its making: differences from the paper, equations, code."""

import re

import pytest

from capsule.page import provenance
from support.evaluated import read_paper
from support.project import ROOT
from support.sections import CONFIG, SCHEMA

PAPER = read_paper()
EQUATIONS = PAPER["equations"]


def test_the_configuration_is_compared_with_the_paper():
    fit = {
        "particles": {"symbol": "N", "unit": "1", "description": "Number."},
        "amplitude_range": {"symbol": "A", "unit": "SD"},
        "seed": {},
    }
    schema = {"properties": {"fit": {"properties": fit}}}
    printed = {
        "fit.particles": {"value": 2000, "where": "eq. particleSet"},
        "fit.amplitude_range": {"value": [0, 1.5], "open_at_low_end": True, "where": "eq. G"},
    }
    config = {"fit": {"seed": 1, "amplitude_range": [0.001, 1.5], "particles": 500}}
    rows = provenance.configuration_table(
        config, schema, {"settings": printed, "equations": EQUATIONS}
    )
    assert [row["key"] for row in rows] == ["fit.particles", "fit.amplitude_range", "fit.seed"]
    assert [row["differs"] for row in rows] == [True, False, False]
    assert rows[0]["value"] == "500" and rows[0]["paper"] == "2000"
    assert rows[1]["value"] == "0.001 to 1.5"
    assert [row["where"] for row in rows] == ["Eq. 8", "Eq. 11", ""]


def test_the_shipped_configuration_is_the_papers():
    rows = provenance.configuration_table(CONFIG, SCHEMA, PAPER)
    beside = {row["key"]: (row["paper"], row["where"]) for row in rows}
    assert {key for key, (value, _) in beside.items() if value} == PAPER["settings"].keys()
    assert beside["diagonal.wave_speed_mm_s"] == ("25", "section III-A, Data Collection")
    assert beside["diagonal.wavelength_mm"] == ("80", "section II-C, Small Intestine Simulator")
    assert beside["preprocessing.window"] == ("84", "Eq. 2")
    assert not any("eq. " in where for _, where in beside.values())
    assert [row["key"] for row in rows if row["differs"]] == []


@pytest.mark.parametrize(
    ("told", "cited"),
    [
        # "By substituting the parameters ... into equations (10) and (11)": surface and particle.
        ("eq. generateP", "Eq. 10"),
        ("eq. G", "Eq. 11"),
        ("eq. F' to eq. RMSEmin", "Eq. 15 to Eq. 19"),
        ("section IV-B", "section IV-B"),
    ],
)
def test_equations_have_the_numbers_that_the_paper_prints(told, cited):
    assert provenance.cited(told, EQUATIONS) == cited
    assert len(set(EQUATIONS)) == len(EQUATIONS) == 28
    with pytest.raises(ValueError, match="is not in list"):
        provenance.cited("eq. energy", EQUATIONS)


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
    assert [(part["kind"], part["text"]) for part in provenance.typeset(symbol)] == parts
