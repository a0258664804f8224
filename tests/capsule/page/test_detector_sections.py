"""What is said of each detector, and that nothing is said which is not known."""

import json

import pytest

from capsule.page import detector_sections
from support.evaluated import SETTINGS, UNKNOWN, evaluated, index_of, read_paper

PAPER = read_paper()


@pytest.mark.parametrize(
    ("verdicts", "sizes_mm", "expected"),
    [
        ([], (0.0,), "There is no recording to judge by yet."),
        ([("0mm/a", 0.0, 0.0)], (0.0,), "none of a nodule of known size"),
        ([("2mm/a", 2.0, 0.0)], (0.0, 2.0), "reliably finds no nodule size"),
    ],
)
def test_what_cannot_be_said_is_not_said(verdicts, sizes_mm, expected):
    evaluation = evaluated(verdicts, sizes_mm)
    rows = [[name, true, "accepted", UNKNOWN, "", "aa", 70.0] for name, true, _ in verdicts]
    values = detector_sections.page_values(
        evaluation, index_of(*rows), SETTINGS, PAPER["sizing_tolerance_mm"]
    )
    assert expected in values["summary"]
    assert "nan" not in json.dumps(values["results"], allow_nan=True).replace("NaN", "").lower()
    cards = values["results"][0]["cards"]
    assert not any("nan" in card["answer"] + card["detail"] for card in cards)


def test_too_few_healthy_recordings_to_promise_a_specificity_are_told():
    assert detector_sections.few_healthy(19, 0.95) == detector_sections.few_healthy(9, 0.9) == ""
    assert detector_sections.few_healthy(0, 0.95) == ""  # then there is no threshold at all
    assert "that takes 19" in detector_sections.few_healthy(18, 0.95)
    assert detector_sections.few_healthy(1, 0.9).startswith(
        "1 recording without a nodule cannot promise"
    )
