"""Tests of the texts on each detector, which claim nothing unknown."""

import json

import pytest

from capsule.evaluation.lead import Lead
from capsule.page import detector_sections
from support.evaluated import SETTINGS, UNKNOWN, evaluated, index_of, read_paper
from support.project import ROOT

PAPER = read_paper()
LEAD = Lead("template", False, UNKNOWN, 0)


@pytest.mark.parametrize(
    ("verdicts", "sizes_mm", "expected"),
    [
        ([], (0.0,), "There is no recording to judge by yet."),
        (
            [("0mm/a", 0.0, 0.0)],
            (0.0,),
            "cannot be judged, because none has a nodule of known size",
        ),
        ([("2mm/a", 2.0, 0.0)], (0.0, 2.0), "reliably finds no nodule size"),
    ],
)
def test_what_cannot_be_said_is_not_said(verdicts, sizes_mm, expected):
    evaluation = evaluated(verdicts, sizes_mm)
    rows = [[name, true, "accepted", UNKNOWN, "", "aa", 70.0] for name, true, _ in verdicts]
    values = detector_sections.page_values(
        evaluation, index_of(*rows), LEAD, SETTINGS, PAPER["sizing_tolerance_mm"]
    )
    assert expected in values["summary"]
    assert "nan" not in json.dumps(values["results"], allow_nan=True).replace("NaN", "").lower()
    cards = values["results"][0]["cards"]
    assert not any("nan" in card["answer"] + card["detail"] for card in cards)


def test_too_few_healthy_recordings_to_promise_a_specificity_are_told():
    assert detector_sections.few_healthy(19, 0.95) == detector_sections.few_healthy(9, 0.9) == ""
    assert detector_sections.few_healthy(0, 0.95) == ""  # then there is no threshold at all
    said = detector_sections.few_healthy(18, 0.95)
    assert said.startswith("A specificity of 95 % needs 19 recordings without a nodule;")
    assert "this archive has 18." in said
    assert "90 % needs 9 " in detector_sections.few_healthy(1, 0.9)


def test_an_unlabelled_recording_is_no_evidence():
    verdicts = [("0mm/a", 0.0, 0.0), ("2mm/a", 2.0, 2.0)]
    rows = [[name, true, "accepted", UNKNOWN, "bench 2", "aa", 70.0] for name, true, _ in verdicts]
    rows += [["unlabelled/a", UNKNOWN, "accepted", UNKNOWN, "simulated phantom", "bb", 70.0]] * 5
    values = detector_sections.page_values(
        evaluated(verdicts, (0.0, 2.0)),
        index_of(*rows),
        LEAD,
        SETTINGS,
        PAPER["sizing_tolerance_mm"],
    )
    assert values["summary"].startswith("On 2 recordings, the paper's detector")


@pytest.mark.parametrize(
    ("schemes", "scheme"),
    [
        (["leave_one_out", "resubstitution"], "leave-one-out"),
        (["leave_one_out"], "leave-one-out"),
        (["resubstitution"], "resubstitution"),
    ],
)
def test_the_page_names_the_scheme_that_it_stands_on(schemes, scheme):
    settings = SETTINGS | {"evaluation": SETTINGS["evaluation"] | {"schemes": schemes}}
    values = detector_sections.page_values(
        evaluated([("0mm/a", 0.0, 0.0)], (0.0,)),
        index_of(["0mm/a", 0.0, "accepted", UNKNOWN, "", "aa", 70.0]),
        LEAD,
        settings,
        PAPER["sizing_tolerance_mm"],
    )
    assert values["scheme_note"].startswith(f"Results are {scheme}: ")
    assert values["figure_series"] == f"template ({scheme}) and the paper"


def test_the_leading_detector_stands_first_and_the_others_keep_their_order():
    detectors = ["template", "diagonal", "taught"]
    lead = Lead("diagonal", False, 0.9, 3)
    assert detector_sections.lead_first(detectors, lead) == ["diagonal", "template", "taught"]
    # One that has judged nothing can lead, if the configuration names it.
    assert detector_sections.lead_first(detectors[:1], lead) == ["diagonal", "template"]


def test_no_section_names_a_scheme_by_itself():
    for path in sorted((ROOT / "workflow/report").rglob("*.j2")):
        if path.name == "glossary.html.j2":  # which says what both of them are
            continue
        text = path.read_text(encoding="utf-8").casefold()
        assert "leave-one-out" not in text and "resubstitution" not in text, path.name
