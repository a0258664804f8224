"""What the page says of its making: differences from the paper, equations, methods, references."""

import datetime
import re

import pytest

from capsule.engine.project import ProjectState
from capsule.page import files as page_files
from capsule.page import provenance
from support.evaluated import UNKNOWN, evaluated, read_paper
from support.project import ROOT
from support.sections import CONFIG, REPORT, SCHEMA, page_of, section

PAPER = read_paper()
EQUATIONS = PAPER["equations"]
REFERENCES = (REPORT / "references.bib").read_text(encoding="utf-8")
OTHER = {"preprocessing": {"window": 50, "threshold": 1.25}}
OTHER |= {"evaluation": {"schemes": ["resubstitution"], "confidence": 0.9}}
LED, MIXED = {"report": {"lead": "template"}}, ["simulated", *["bench 2"] * 3]
VERDICTS = [("0mm/a", 0.0, 0.0), ("0mm/b", 0.0, 2.0), ("2mm/a", 2.0, 3.0), ("3mm/a", 3.0, 3.0)]


def compared_with_the_paper(**fit):
    """Return the rows of the shipped configuration with a changed section `fit`, by their keys."""
    rows = provenance.configuration_table(CONFIG | {"fit": CONFIG["fit"] | fit}, SCHEMA, PAPER)
    return {row["key"]: row for row in rows}


def test_the_shipped_configuration_is_the_papers_and_what_differs_is_marked():
    rows = compared_with_the_paper()
    assert {key for key, row in rows.items() if row["paper"]} == PAPER["settings"].keys()
    beside = {key: (row["paper"], row["where"]) for key, row in rows.items()}
    assert beside["diagonal.wave_speed_mm_s"] == ("25", "section III-A, Data Collection")
    assert beside["preprocessing.window"] == ("84", "Eq. 2")
    assert not any("eq. " in where for _, where in beside.values())
    assert [key for key, row in rows.items() if row["differs"]] == []
    # The paper's range of amplitudes is open at 0.
    ranges = {"amplitude_range": [0.005, 1.5], "vertical_spread_range": [0.02, 1]}
    rows = compared_with_the_paper(particles=500, **ranges)
    differing = {key for key, row in rows.items() if row["differs"]}
    assert differing == {"fit.particles", "fit.vertical_spread_range"}
    assert (rows["fit.particles"]["value"], rows["fit.particles"]["paper"]) == ("500", "2000")
    assert rows["fit.amplitude_range"]["value"] == "0.005 to 1.5"


def test_equations_have_the_numbers_that_the_paper_prints():
    assert provenance.cited("eq. F' to eq. RMSEmin", EQUATIONS) == "Eq. 15 to Eq. 19"
    assert provenance.cited("section IV-B", EQUATIONS) == "section IV-B"
    with pytest.raises(ValueError, match="is not in list"):
        provenance.cited("eq. energy", EQUATIONS)
    # So has each that the code cites.
    cited = set()
    for path in sorted((ROOT / "workflow").rglob("*.py")):
        cited |= set(re.findall(r"\beq\. ([A-Za-z0-9_*]+'?)", path.read_text(encoding="utf-8")))
    assert "RMSE" in cited and cited <= set(EQUATIONS)


def test_a_symbol_is_shown_in_parts():
    parts = [("span", "\u0394"), ("i", "\u03bc"), ("sup", "hor"), ("sub", "ite")]
    assert provenance.typeset("Delta mu^hor_ite") == parts


def text(verdicts=VERDICTS, sources=("simulated",) * 4, changes=(), columns=(), **top):
    """Return the paragraph for an archive that `diagonal` leads, with changed settings."""
    config = CONFIG | {"detectors": ["diagonal", "template"]} | top
    for section_of, changed in dict(changes).items():
        config |= {section_of: config[section_of] | changed}
    scheme = config["evaluation"]["schemes"][0]
    judged = evaluated(verdicts, detectors=("diagonal", "template"), scheme=scheme)
    for name, values in dict(columns).items():
        judged.predictions.loc[judged.predictions["detector"] == "diagonal", name] = values
    rows = [
        [name, true, "accepted", UNKNOWN, source, "aa", 70.0]
        for (name, true, _), source in zip(verdicts, sources, strict=False)
    ]
    rows += [["2mm/bad", 2.0, "rejected", "empty", "bench 2", "bb", UNKNOWN]]
    return section("methods", **page_of(judged, *rows, settings=config), project="", programs=[])


@pytest.mark.parametrize(
    ("archive", "said", "not_said"),
    [
        (
            {"columns": {"threshold": 0.12732, "estimate_low_mm": 1.5}},
            [
                "N = 4 recordings of known nodule size (2 without a nodule, 1 of 2 mm and 1 of 3 "
                "mm), of 4 sensors at 10 Hz. All were simulated. 1 recording could not be used.",
                *("W = 84 samples", "L = 1000 columns (Eq. 6)", "2000 iterations (Eq. 21; seed 1)"),
                "100 % (16.6 to 100 %) at 2 mm and 100 % (16.6 to 100 %) at 3 mm, with 97.5 %",
                *("Its specificity was set to 95 %", "judged by leave-one-out", "within 1 mm"),
                *("a prevalence of 10 %", "Of 2 detectors diagonal had the highest sensitivity"),
                *("; threshold 0.127)", "Estimated sizes have 90 % intervals"),
            ],
            [],
        ),
        (
            {"detectors": ["template"], "changes": OTHER, "sources": ["bench 2"] * 4},
            ["W = 50", "c = 1.25", "Intervals are at 90 %", "judged by resubstitution"],
            ["simulated", "Learned thresholds", "diagonal ("],
        ),
        (
            {"columns": {"threshold": [0.12732, 0.1309] * 2}, "sources": MIXED, "changes": LED},
            ["; threshold 0.127 to 0.131 over", "1 of these were sim", "sensitivity of template"],
            ["Estimated sizes have", "highest"],
        ),
        ({"verdicts": []}, ["N = 0 recordings", "of 4 sensors"], ["nan", "not known"]),
    ],
)
def test_another_archive_or_configuration_gives_another_paragraph(archive, said, not_said):
    paragraph = text(**archive)
    assert [part for part in said if part not in paragraph] == []
    assert [part for part in not_said if part in paragraph] == []


def test_every_reference_is_whole_and_cited_and_every_citation_has_a_reference():
    entries = dict(re.findall(r"@\w+\{(\S+),\n(.*?)\n\}\n", REFERENCES, re.DOTALL))
    assert len(entries) == REFERENCES.count("@")
    for entry in entries.values():
        fields = re.findall(r"^  (\w+) = \{.+\},?$", entry, re.MULTILINE)
        assert len(fields) == len(entry.splitlines()) and {"title", "author"} < {*fields}
        assert {"doi", "url", "eprint"} & {*fields}
    versions = page_files.read_versions(REPORT)
    made = datetime.datetime(2024, 6, 3, tzinfo=datetime.UTC)
    state = ProjectState("1.2.0", None, False)
    software = " ".join(provenance.how_made({}, versions, made, state)["programs"])
    paragraph = text(columns={"estimate_low_mm": 1.5})
    assert set(re.findall(r"\[(\w+)\]", f"{paragraph} {software}")) == set(entries)
    for name, version in versions:
        assert re.match(r"\d+\.\d+", version) and f"{name} {version} [" in software
