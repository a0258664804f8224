"""The methods paragraph: the numbers that were used, and a reference for each tool."""

import datetime
import re

import pandas as pd
import yaml

from capsule import words
from capsule.engine.project_state import ProjectState
from capsule.evaluation.lead import Lead
from capsule.page import detector_sections, overview, provenance
from capsule.page import files as page_files
from capsule.page.provenance import how_made
from capsule.store import files
from support.evaluated import UNKNOWN, evaluated, index_of, rates_of, read_paper
from support.project import ROOT
from support.sections import section

CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
SCHEMA = files.read_json(ROOT / "workflow/schemas/config.schema.json")
REFERENCES = (ROOT / "workflow/report/references.bib").read_text(encoding="utf-8")
PAPER = read_paper()
VERDICTS = [("0mm/a", 0.0, 0.0), ("0mm/b", 0.0, 2.0), ("2mm/a", 2.0, 3.0), ("3mm/a", 3.0, 3.0)]


def paragraph_of(rates, lead, config):
    values = detector_sections.page_values(rates, lead)
    values |= overview.overview(rates.index, pd.DataFrame(columns=["path", "reason"]), [])
    values |= provenance.page_values([], CONFIG, SCHEMA, PAPER)
    return section(
        "methods",
        **values,
        methods=detector_sections.methods_values(rates, values["ours"]),
        settings=config,
        software="",
        confidence=words.percent(config["evaluation"]["confidence"]),
        size_confidence=words.percent(config["evaluation"]["size_confidence"]),
        prevalence=words.percent(config["evaluation"]["prevalence"]),
        tolerance=f"{config['evaluation']['tolerance_mm']:g} mm",
    )


def text(config=CONFIG, verdicts=VERDICTS, source="simulated phantom", threshold=(), bounded=True):
    scheme = config["evaluation"]["schemes"][0]
    evaluation = evaluated(verdicts, detectors=("template", "diagonal"), scheme=scheme)
    if threshold:
        rows = evaluation.predictions
        learned = rows["detector"].map({"template": [0.0, 0.0], "diagonal": list(threshold)})
        values = [each[place % 2] for place, each in enumerate(learned)]
        evaluation = type(evaluation)(
            rows.assign(threshold=values), evaluation.tables, evaluation.paper
        )
    if bounded:
        evaluation.predictions["estimate_low_mm"] = 1.5
    rows = [[name, true, "accepted", UNKNOWN, source, "aa", 70.0] for name, true, _ in verdicts]
    rows += [["2mm/bad", 2.0, "rejected", "empty", UNKNOWN, UNKNOWN, UNKNOWN]]
    lead = Lead("diagonal", False, 0.75, 2)
    config = config | {"evaluation": {"held_out": [], **config["evaluation"]}}
    rates = rates_of(evaluation, config, index_of(*rows))
    return paragraph_of(rates, lead, config)


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
        "at 3 mm, with 97.5 % intervals, which correct for the choice.",
        "Its specificity was set to 95 % by its threshold, not measured.",
        "Intervals are at 95 %",
        "a prevalence of 10 %",
        "Of 2 detectors diagonal had the highest sensitivity at a specificity of 95 %, 75 %.",
        "within 1 mm. Estimated sizes have 90 % intervals",
    ):
        assert part in paragraph
    for name in CONFIG["detectors"]:
        assert f"{name} (" in paragraph


def test_another_configuration_gives_another_paragraph():
    config = {name: value.copy() for name, value in CONFIG.items() if isinstance(value, dict)}
    config["detectors"] = ["template"]
    config["preprocessing"] |= {"window": 50, "threshold": 1.25}
    config["evaluation"] |= {"schemes": ["resubstitution"], "confidence": 0.9}
    paragraph = text(config, source="bench 2")
    assert (
        "W = 50" in paragraph and "c = 1.25" in paragraph and "Intervals are at 90 %" in paragraph
    )
    assert "judged by resubstitution" in paragraph and "simulated" not in paragraph
    assert "Learned thresholds" not in paragraph and "diagonal (" not in paragraph


def test_a_learned_threshold_has_its_range_over_the_folds():
    assert "against a threshold; threshold 0.127 to 0.131 over the folds)" in text(
        threshold=(0.12732, 0.1309)
    )
    assert "against a threshold; threshold 0.127)" in text(threshold=(0.12732, 0.12732))


def test_what_is_not_known_is_not_told():
    paragraph = text(verdicts=[])
    assert "N = 0 recordings of known nodule size, of 4" in paragraph
    assert "nan" not in paragraph and "not known" not in paragraph
    assert "Estimated sizes have" not in text(bounded=False)


def entries():
    """Read the references: fields by key, each with its braces in pairs."""
    found = {}
    for kind, key, body in re.findall(r"@(\w+)\{(\S+),\n(.*?)\n\}\n", REFERENCES, re.DOTALL):
        assert body.count("{") == body.count("}")
        fields = dict(re.findall(r"^  (\w+) = \{(.*)\},?$", body, re.MULTILINE))
        assert len(fields) == body.count("\n") + 1
        found[key] = {"kind": kind, **fields}
    assert len(found) == REFERENCES.count("@")
    return found


def test_every_reference_is_cited_and_every_citation_has_a_reference():
    versions = page_files.read_versions(ROOT / "workflow" / "report")
    made = datetime.datetime(2024, 6, 3, tzinfo=datetime.UTC)
    software = how_made({}, versions, made, ProjectState("1.2.0", None, False))["software"]
    cited = set(re.findall(r"\[(\w+)\]", f"{text()} {software}"))
    assert cited == set(entries())
    for name, version in versions:
        assert f"{name} {version} [" in software


def test_every_article_says_where_it_stands_and_the_papers_entry_is_the_papers():
    for fields in entries().values():
        assert {"title", "author"} <= fields.keys()
        assert {"year", "doi"} <= fields.keys() or fields["kind"] == "misc"
        assert {"url", "eprint"} & fields.keys() or fields["kind"] != "misc"
    entry = entries()["ge2024capsule"]
    assert (entry["title"], int(entry["year"])) == (PAPER["title"], PAPER["year"])
    assert entry["author"].split(" and ") == PAPER["authors"]
    assert f"{entry['archivePrefix']}:{entry['eprint']}" == PAPER["identifier"]


def test_recordings_of_several_origins_are_counted():
    rows = [["0mm/a", 0.0, "accepted", UNKNOWN, "simulated phantom", "aa", 70.0]]
    rows += [["2mm/a", 2.0, "accepted", UNKNOWN, "bench 2", "bb", 70.0]]
    lead = Lead("template", False, UNKNOWN, 0)
    rates = rates_of(evaluated([]), CONFIG, index_of(*rows))
    assert "at 10 Hz. 1 of these were simulated. Pre-" in paragraph_of(rates, lead, CONFIG)
