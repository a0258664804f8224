"""The answers in words: each with the paper's beside it, and in one sentence."""

import pytest

from capsule.evaluation.lead import Lead
from capsule.page import cards, detector_sections
from support.evaluated import SETTINGS, UNKNOWN, evaluated


def test_the_summary_says_what_is_found_and_the_false_alarms():
    verdicts = [(f"0mm/{n}", 0.0, 0.0 if n else 2.0) for n in range(8)]
    verdicts += [(f"3mm/{n}", 3.0, 3.0) for n in range(9)]
    verdicts += [(f"2mm/{n}", 2.0, 3.0 if n % 2 else 0.0) for n in range(4)]
    evaluation = evaluated(verdicts)
    answers = detector_sections.answers_of(evaluation, "template", SETTINGS)
    text = cards.summary("simulated", 21, answers, "template")
    assert text == (
        "On 21 simulated recordings, the paper's detector reliably finds nodules of 3 mm and "
        "larger. It reports a nodule in 12.5 % of the recordings without one. It gives the size "
        "within 1 mm in 84.6 % of the recordings with a nodule."
    )
    assert "the detector diagonal" in cards.summary("simulated", 21, answers, "diagonal")


def test_with_many_false_alarms_no_size_is_called_reliably_found():
    verdicts = [(f"0mm/{n}", 0.0, 0.0 if n else 2.0) for n in range(4)]
    verdicts += [(f"3mm/{n}", 3.0, 3.0) for n in range(9)]
    answers = detector_sections.answers_of(evaluated(verdicts), "template", SETTINGS)
    assert (answers.specificity.value, answers.smallest_mm) == (0.75, None)
    text = cards.summary("recorded", 13, answers, "template")
    assert text.startswith("On 13 recordings, the paper's detector reliably finds no nodule size.")


def test_every_answer_has_the_papers_beside_it():
    verdicts = [("0mm/a", 0.0, 0.0), ("2mm/a", 2.0, 2.0), ("3mm/a", 3.0, 3.0)]
    result = detector_sections.result_of(evaluated(verdicts), "template", SETTINGS, 1)
    paper = {card["id"]: card["paper"] for card in result["cards"]}
    assert paper["smallest"] == "none, by the same rule"
    assert paper["specificity"].startswith("30 % (14.5 to 51.9 %)")
    assert paper["within"].startswith("81.2 %") and "lacks some of these sizes" in paper["within"]
    assert not any(card["method"] for card in result["cards"])


def test_every_answer_of_another_detector_has_the_papers_own_detector_beside_it():
    verdicts = [("0mm/a", 0.0, 0.0), ("2mm/a", 2.0, 0.0), ("3mm/a", 3.0, 3.0)]
    both = evaluated(verdicts, detectors=("template", "diagonal"))
    result = detector_sections.result_of(both, "diagonal", SETTINGS, 1)
    method = {card["id"]: card["method"] for card in result["cards"]}
    assert method == {
        "smallest": "3 mm",
        "specificity": "100 % (20.7 to 100 %)",
        "within": "50 % (9.5 to 90.5 %)",
        "error": "1.00 mm",
    }


@pytest.mark.parametrize(
    ("lead", "expected"),
    [
        (Lead("diagonal", False, 0.93, 4), "Of 4 detectors it has the highest balanced accuracy"),
        (
            Lead("template", True, 0.605, 4),
            "The configuration names it (report.lead). Its balanced accuracy is 60.5 %.",
        ),
        (
            Lead("template", False, UNKNOWN, 0),
            "No other detector could be compared with it on this archive.",
        ),
    ],
)
def test_the_page_tells_why_a_detector_leads(lead, expected):
    assert cards.lead_words(lead, "leave_one_out").startswith(expected)


def test_another_tolerance_is_told_and_not_compared():
    verdicts = [("0mm/a", 0.0, 0.0), *((f"{n}mm/a", float(n), float(n)) for n in range(2, 6))]
    evaluation = evaluated(verdicts, (0.0, 2.0, 3.0, 4.0, 5.0))
    for tolerance_mm, end in (
        (1, "; here over the same sizes 100 %"),
        (2, ", with another tolerance"),
    ):
        result = detector_sections.result_of(evaluation, "template", SETTINGS, tolerance_mm)
        (within,) = [card for card in result["cards"] if card["id"] == "within"]
        assert within["paper"].endswith(f"over 2, 3, 4 and 5 mm{end}")


def test_without_a_healthy_recording_nothing_is_called_reliably_found():
    verdicts = [(f"{size}mm/{n}", float(size), float(size)) for size in (2, 3) for n in range(9)]
    answers = detector_sections.answers_of(evaluated(verdicts), "template", SETTINGS)
    text = cards.summary("recorded", 18, answers, "template")
    assert text.startswith(
        "On 18 recordings, it is not known how reliably the paper's detector finds a nodule, "
        "because each of them has one."
    )
    assert "reliably finds" not in text
    (smallest,) = [
        card
        for card in detector_sections.result_of(evaluated(verdicts), "template", SETTINGS, 1)[
            "cards"
        ]
        if card["id"] == "smallest"
    ]
    assert (smallest["answer"], smallest["value"]) == ("not known", None)
    assert "precision has no meaning" in smallest["detail"]
