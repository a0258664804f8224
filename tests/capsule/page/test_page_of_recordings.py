"""The table of all recordings, the answers in words, and the files from elsewhere."""

import json
import re
from pathlib import Path

import pandas as pd
import pytest
import yaml

from capsule.evaluation.beside_paper import Evaluation
from capsule.evaluation.paper import printed_tables
from capsule.evaluation.rates import COLUMNS, tables
from capsule.page import cards, detector_sections, provenance, recordings

ROOT = Path(__file__).parents[3]
UNKNOWN = float("nan")
RATES = {"schemes": ["leave_one_out"], "tolerance_mm": 1.0, "confidence": 0.95}
SETTINGS = {
    "fit": {"seed": 1},
    "evaluation": {**RATES, "specificity": 0.95},
    "report": {"reliable_rate": 0.85},
}


@pytest.fixture(scope="module")
def printed():
    text = (ROOT / "workflow" / "report" / "paper.yaml").read_text(encoding="utf-8")
    return yaml.safe_load(text)


def evaluated(printed, verdicts, sizes_mm=(0.0, 2.0, 3.0), detectors=("template",)):
    """Judge triples of recording, true and predicted size."""
    rows = [
        {
            "recording": name,
            "size_mm": true,
            "detector": detector,
            "scheme": "leave_one_out",
            "predicted_mm": predicted,
            **{f"rmse_{size:g}mm": abs(predicted - size) / 10 for size in sizes_mm},
        }
        for detector in detectors
        for name, true, predicted in verdicts
    ]
    columns = ["recording", "size_mm", "detector", "scheme", "predicted_mm"]
    columns += [f"rmse_{size:g}mm" for size in sizes_mm]
    made = tables(rows, list(sizes_mm), **RATES)
    paper = {name: pd.DataFrame(rows) for name, rows in printed_tables(printed, 0.95).items()}
    ours = {name: pd.DataFrame(table, columns=COLUMNS[name]) for name, table in made.items()}
    return Evaluation(pd.DataFrame(rows, columns=columns), ours, paper)


def index_of(*rows):
    columns = ["recording", "size_mm", "status", "reason", "source", "sha256", "duration_s"]
    frame = pd.DataFrame(rows, columns=columns)
    return frame.assign(samples=100)


DETECTIONS = pd.DataFrame(columns=["recording", "detector", "predicted_mm", "rmse_0mm"])


@pytest.mark.parametrize(
    ("truth", "verdict", "expected"),
    [
        (0.0, 0.0, "rightly none"),
        (0.0, 1.0, "false alarm"),
        (3.0, 0.0, "missed"),
        (3.0, 3.0, "exact"),
        (2.5, 2.3, "within tolerance"),
        (3.0, 5.0, "off"),
        (UNKNOWN, 2.0, "unlabelled"),
        (3.0, UNKNOWN, "not judged"),
    ],
)
def test_an_outcome_relates_the_verdict_to_the_truth(truth, verdict, expected):
    assert recordings.outcome(truth, verdict, 0.2 if truth == 2.5 else 1.0) == expected
    assert expected in recordings.OUTCOMES


def test_rows_hold_the_chosen_verdict_and_the_reason_of_the_rejected(printed):
    evaluation = evaluated(
        printed, [("2mm/a", 2.0, 3.0)], detectors=("template", "template_threshold")
    )
    found = recordings.verdicts_by_recording(evaluation.predictions, DETECTIONS)
    assert [each["label"] for each in found["2mm/a"]] == [
        "template, leave-one-out",
        "template_threshold, leave-one-out",
    ]
    index = index_of(
        ["2mm/a", 2.0, "accepted", UNKNOWN, "bench 2", "aa", 70.0],
        ["2mm/bad", 2.0, "rejected", "the file is empty", UNKNOWN, "bb", UNKNOWN],
    )
    good, bad = recordings.recording_rows(index, found, "template", "leave_one_out", 1.0)
    assert (good["verdict"], good["outcome"], good["nearest_words"]) == (
        "3 mm",
        "within tolerance",
        "0.0000",
    )
    assert recordings.title(good) == "2 mm nodule, taken for 3 mm by template (within tolerance)"
    assert (bad["outcome"], bad["reason"], bad["verdict"]) == ("rejected", "the file is empty", "")


def test_the_summary_says_what_is_found_and_the_false_alarms(printed):
    verdicts = [(f"0mm/{n}", 0.0, 0.0 if n else 2.0) for n in range(4)]
    verdicts += [(f"3mm/{n}", 3.0, 3.0) for n in range(9)]
    verdicts += [(f"2mm/{n}", 2.0, 3.0 if n % 2 else 0.0) for n in range(4)]
    evaluation = evaluated(printed, verdicts)
    (result,) = detector_sections.results_of(evaluation, SETTINGS, printed["sizing_tolerance_mm"])
    text = cards.summary("simulated", 17, result["cards"], SETTINGS["evaluation"])
    assert text.startswith(
        "On 17 simulated recordings, the paper's detector reliably finds nodules of 3 mm and larger"
    )
    assert "it reports a nodule in 25 % of the runs without one" in text
    assert "within 1 mm in 84.6 % of the runs with a nodule" in text


def test_every_answer_has_the_papers_beside_it(printed):
    verdicts = [("0mm/a", 0.0, 0.0), ("2mm/a", 2.0, 2.0), ("3mm/a", 3.0, 3.0)]
    (result,) = detector_sections.results_of(evaluated(printed, verdicts), SETTINGS, 1)
    said = {card["id"]: card["paper"] for card in result["cards"]}
    assert said["smallest"] == "2 mm, by the same rule"
    assert said["specificity"].startswith("30 % (15 to 52 %)")
    assert said["within"].startswith("81.2 %") and "lacks some of these sizes" in said["within"]


@pytest.mark.parametrize(
    ("verdicts", "sizes_mm", "expected"),
    [
        ([], (0.0,), "There is no recording to judge by yet."),
        ([("0mm/a", 0.0, 0.0)], (0.0,), "none of a nodule of known size"),
        ([("2mm/a", 2.0, 0.0)], (0.0, 2.0), "reliably finds no nodule size"),
    ],
)
def test_what_cannot_be_said_is_not_said(printed, verdicts, sizes_mm, expected):
    evaluation = evaluated(printed, verdicts, sizes_mm)
    rows = [[name, true, "accepted", UNKNOWN, "", "aa", 70.0] for name, true, _ in verdicts]
    found = recordings.verdicts_by_recording(evaluation.predictions, DETECTIONS)
    said = detector_sections.judgement(evaluation, index_of(*rows), found, SETTINGS, printed)
    assert expected in said["summary"]
    assert "nan" not in json.dumps(said["results"], allow_nan=True).replace("NaN", "").lower()
    assert not any("nan" in card["answer"] + card["detail"] for card in said["results"][0]["cards"])


def test_too_few_healthy_recordings_to_promise_a_specificity_are_told():
    assert detector_sections.few_healthy(19, 0.95) == detector_sections.few_healthy(9, 0.9) == ""
    assert detector_sections.few_healthy(0, 0.95) == ""  # then there is no threshold at all
    assert "that takes 19" in detector_sections.few_healthy(18, 0.95)
    assert detector_sections.few_healthy(1, 0.9).startswith(
        "1 recording without a nodule cannot promise"
    )


def test_the_papers_settings_are_keys_of_the_configuration(printed):
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    for key in printed["settings"]:
        section, _, name = key.partition(".")
        assert name in config[section], key


def test_the_shipped_configuration_is_the_papers(printed):
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    schema = json.loads((ROOT / "workflow/schemas/config.schema.json").read_text(encoding="utf-8"))
    rows = provenance.configuration_table(config, schema, printed["settings"])
    assert [row["key"] for row in rows if row["differs"]] == []


def test_bibtex_names_all_authors(printed):
    entry = provenance.bibtex(printed)
    assert entry.startswith("@misc{ge2024capsule,")
    assert entry.count(" and ") == len(printed["authors"]) - 1
    assert entry.count("{") == entry.count("}")


@pytest.mark.parametrize(
    ("package", "file"),
    [
        ("uplot", "workflow/report/vendor/uplot/uPlot.iife.min.js"),
        ("axe-core", "tests/vendor/axe-core/axe.min.js"),
    ],
)
def test_the_files_from_elsewhere_are_what_the_lock_pins(package, file):
    folder = ROOT / "workflow" / "report" / "vendor"
    lock = json.loads((folder / "package-lock.json").read_text(encoding="utf-8"))
    head = (ROOT / file).read_text(encoding="utf-8")[:200]
    assert re.search(r"v\d+\.\d+\.\d+", head)[0] == (
        "v" + lock["packages"][f"node_modules/{package}"]["version"]
    )
    assert (ROOT / file).with_name("LICENSE").stat().st_size > 500
    assert '"resolved"' not in json.dumps(lock)
