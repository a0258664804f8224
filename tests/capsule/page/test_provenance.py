"""Tests of what the page says of its making: differences from the paper, equations, code."""

import json
import re

import pytest
import yaml

from capsule.page import provenance
from support.evaluated import read_paper
from support.project import ROOT

PAPER = read_paper()
EQUATIONS = PAPER["equations"]


def test_the_configuration_is_compared_with_the_paper():
    schema = {
        "properties": {
            "fit": {
                "properties": {
                    "particles": {"symbol": "N", "unit": "1", "description": "Number."},
                    "amplitude_range": {"symbol": "A", "unit": "SD"},
                    "seed": {},
                }
            }
        }
    }
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


def test_the_papers_settings_are_keys_of_the_configuration():
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    for key in PAPER["settings"]:
        section, _, name = key.partition(".")
        assert name in config[section], key


def test_the_shipped_configuration_is_the_papers():
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    schema = json.loads((ROOT / "workflow/schemas/config.schema.json").read_text(encoding="utf-8"))
    rows = provenance.configuration_table(config, schema, PAPER)
    beside = {row["key"]: (row["paper"], row["where"]) for row in rows}
    assert beside["diagonal.wave_speed_mm_s"] == ("25", "section III-A, Data Collection")
    assert beside["diagonal.wavelength_mm"] == ("80", "section II-C, Small Intestine Simulator")
    assert beside["preprocessing.window"] == ("84", "Eq. 2")
    assert not any("eq. " in where for _, where in beside.values())
    assert [row["key"] for row in rows if row["differs"]] == []


def test_equations_have_the_numbers_that_the_paper_prints():
    # "By substituting the parameters ... into equations (10) and (11)": surface and particle.
    assert provenance.cited("eq. generateP", EQUATIONS) == "Eq. 10"
    assert provenance.cited("eq. G", EQUATIONS) == "Eq. 11"
    assert provenance.cited("eq. RMS_envelope", EQUATIONS) == "Eq. 2"
    assert provenance.cited("eq. F' to eq. RMSEmin", EQUATIONS) == "Eq. 15 to Eq. 19"
    assert provenance.cited("section IV-B", EQUATIONS) == "section IV-B"
    assert len(set(EQUATIONS)) == len(EQUATIONS) == 28


def test_a_label_that_the_paper_does_not_have_is_refused():
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
