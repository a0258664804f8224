"""The methods paragraph: the numbers that were used, and a reference for each tool."""

import datetime
import re

import pytest

from capsule.engine.project_state import ProjectState
from capsule.page import files as page_files
from capsule.page.provenance import how_made
from support.evaluated import UNKNOWN, evaluated, read_paper
from support.sections import CONFIG, REPORT, page_of, section

REFERENCES = (REPORT / "references.bib").read_text(encoding="utf-8")
PAPER = read_paper()
VERDICTS = [("0mm/a", 0.0, 0.0), ("0mm/b", 0.0, 2.0), ("2mm/a", 2.0, 3.0), ("3mm/a", 3.0, 3.0)]


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
    return section("methods", **page_of(judged, *rows, settings=config), software="")


def test_the_numbers_are_those_of_the_archive_and_the_configuration():
    paragraph = text()
    for part in (
        "N = 4 recordings of known nodule size (2 without a nodule, 1 of 2 mm and 1 of 3 mm), of 4 "
        "sensors at 10 Hz. All were simulated. 1 recording could not be used.",
        "W = 84 samples was taken (Eq. 2)",
        "c = 1 standard deviations (Eq. 5)",
        "S = 4 rows and L = 1000 columns (Eq. 6)",
        "best of 2000 random particles (Eq. 8)",
        "improved in 2000 iterations (Eq. 21; seed 1)",
        "Learned thresholds aim at a specificity of 95 %.",
        "judged by leave-one-out",
        "The sensitivity of diagonal was 100 % (16.6 to 100 %) at 2 mm and 100 % (16.6 to 100 %) "
        "at 3 mm, with 97.5 % intervals",
        "Its specificity was set to 95 % by its threshold, not measured.",
        "Intervals are at 95 %",
        "a prevalence of 10 %",
        "Of 2 detectors diagonal had the highest sensitivity at a specificity of 95 %, 100 %.",
        "within 1 mm",
        "template (",
        "diagonal (",
    ):
        assert part in paragraph


@pytest.mark.parametrize(
    ("archive", "said", "not_said"),
    [
        (
            {
                "detectors": ["template"],
                "changes": {
                    "preprocessing": {"window": 50, "threshold": 1.25},
                    "evaluation": {"schemes": ["resubstitution"], "confidence": 0.9},
                },
                "sources": ["bench 2"] * 4,
            },
            ["W = 50", "c = 1.25", "Intervals are at 90 %", "judged by resubstitution"],
            ["simulated", "Learned thresholds", "diagonal ("],
        ),
        (
            {"columns": {"threshold": [0.12732, 0.1309] * 2}},
            ["; threshold 0.127 to 0.131 over the folds)"],
            ["Estimated sizes have"],
        ),
        (
            {"columns": {"threshold": 0.12732, "estimate_low_mm": 1.5}},
            ["; threshold 0.127)", "Estimated sizes have 90 % intervals"],
            [],
        ),
        ({"sources": ["simulated", *["bench 2"] * 3]}, ["1 of these were simulated."], []),
        (
            {"verdicts": []},
            ["N = 0 recordings of known nodule size, of 4"],
            ["nan", "not known"],
        ),
    ],
)
def test_another_archive_or_configuration_gives_another_paragraph(archive, said, not_said):
    paragraph = text(**archive)
    assert [part for part in said if part not in paragraph] == []
    assert [part for part in not_said if part in paragraph] == []


@pytest.fixture(scope="module")
def entries():
    """Read the references: fields by key, each with its braces in pairs."""
    found = {}
    for kind, key, body in re.findall(r"@(\w+)\{(\S+),\n(.*?)\n\}\n", REFERENCES, re.DOTALL):
        fields = dict(re.findall(r"^  (\w+) = \{(.*)\},?$", body, re.MULTILINE))
        assert body.count("{") == body.count("}") and len(fields) == body.count("\n") + 1
        found[key] = {"kind": kind, **fields}
    assert len(found) == REFERENCES.count("@")
    return found


def test_every_reference_is_cited_and_every_citation_has_a_reference(entries):
    versions = page_files.read_versions(REPORT)
    made = datetime.datetime(2024, 6, 3, tzinfo=datetime.UTC)
    software = how_made({}, versions, made, ProjectState("1.2.0", None, False))["software"]
    paragraph = text(columns={"estimate_low_mm": 1.5})
    assert set(re.findall(r"\[(\w+)\]", f"{paragraph} {software}")) == set(entries)
    for name, version in versions:
        assert f"{name} {version} [" in software


def test_every_article_says_where_it_stands_and_the_papers_entry_is_the_papers(entries):
    for fields in entries.values():
        found = {"title", "author", "year", "doi", "url", "eprint"} & fields.keys()
        assert found > {"title", "author"}
        assert {"year", "doi"} <= found or (fields["kind"] == "misc" and {"url", "eprint"} & found)
    entry = entries["ge2024capsule"]
    assert (entry["title"], int(entry["year"])) == (PAPER["title"], PAPER["year"])
    assert entry["author"].split(" and ") == PAPER["authors"]
    assert f"{entry['archivePrefix']}:{entry['eprint']}" == PAPER["identifier"]
