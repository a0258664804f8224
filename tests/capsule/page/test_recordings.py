"""The table of all recordings: every verdict related to the truth, every rejection with reason."""

import pytest

from capsule.page import recordings
from support.evaluated import DETECTIONS, UNKNOWN, evaluated, index_of


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


def test_rows_hold_the_chosen_verdict_and_the_reason_of_the_rejected():
    evaluation = evaluated([("2mm/a", 2.0, 3.0)], detectors=("template", "template_threshold"))
    verdicts = recordings.verdicts_by_recording(evaluation.predictions, DETECTIONS)
    assert [(each["detector"], each["scheme"]) for each in verdicts["2mm/a"]] == [
        ("template", "leave_one_out"),
        ("template_threshold", "leave_one_out"),
    ]
    assert recordings.in_words(verdicts["2mm/a"][0])["predicted_mm"] == 3.0
    index = index_of(
        ["2mm/a", 2.0, "accepted", UNKNOWN, "bench 2", "aa", 70.0],
        ["2mm/bad", 2.0, "rejected", "the file is empty", UNKNOWN, "bb", UNKNOWN],
    )
    good, bad = recordings.recording_rows(index, verdicts, "template", ["leave_one_out"], 1.0)
    assert (good["verdict"], good["outcome"]) == ("3 mm", "within tolerance")
    assert recordings.truth(good) == "2 mm nodule"
    assert (bad["outcome"], bad["reason"], bad["verdict"]) == ("rejected", "the file is empty", "")


def test_what_is_not_known_of_a_verdict_is_none_and_goes_without_words():
    row = dict.fromkeys(("predicted_mm", "estimate_mm", "probability", "location_s"), UNKNOWN)
    row |= {"detector": "template", "scheme": "all", "score": 1 / 3, "threshold": float("inf")}
    row |= {"rmse_0mm": 0.25, "rmse_3mm": UNKNOWN}
    said = recordings.in_words(row)
    assert (said["predicted_mm"], said["location_s"], said["details"]) == (None, None, "")
    assert recordings.in_words(row | {"no_verdict": "no wave"})["details"] == "no wave"
    assert (said["score"], said["threshold"]) == (0.3333333, None)
    assert said["distances"] == [0.25, None]
    # The detector by beats compares with no template.
    assert recordings.in_words(row | {"detector": "diagonal"})["distances"] == []


def test_a_held_out_recording_has_its_own_verdict_and_the_others_that_of_their_place_left_out():
    held_out, teaching = (
        [{"detector": "diagonal", "scheme": scheme, "predicted_mm": size} for scheme, size in rows]
        for rows in ([("held_out", 1.0)], [("leave_one_out", 2.0), ("resubstitution", 3.0)])
    )
    schemes = ["held_out", "leave_one_out", "resubstitution"]
    for shown, of_held_out, of_teaching in zip(schemes, (1, 1, 1), (2, 2, 3), strict=True):
        for verdicts, expected in ((held_out, of_held_out), (teaching, of_teaching)):
            found = recordings.verdict_of(verdicts, "diagonal", shown, schemes)
            assert found["predicted_mm"] == expected
    assert recordings.verdict_of(held_out, "taught", "held_out", schemes) is None
