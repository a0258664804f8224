"""The table of all recordings: every verdict related to the truth, every rejection with reason."""

import numpy as np
import pandas as pd
import pytest

from capsule.page import recordings
from capsule.page.recordings import MAX_MARKS, OUTCOMES, page_data, score_marks
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
    evaluation = evaluated([("2mm/a", 2.0, 3.0)], detectors=("template", "diagonal"))
    verdicts = recordings.all_verdicts(evaluation.predictions, DETECTIONS)
    index = index_of(
        ["2mm/a", 2.0, "accepted", UNKNOWN, "bench 2", "aa", 70.0],
        ["2mm/bad", 2.0, "rejected", "the file is empty", UNKNOWN, "bb", UNKNOWN],
    )
    good, bad = recordings.recording_rows(index, verdicts, "template", ["leave_one_out"], 1.0)
    assert (good["verdict"], good["outcome"]) == ("3 mm", "within tolerance")
    assert (good["size"], good["place"], bad["place"]) == ("2 mm", 0, 1)
    assert (bad["outcome"], bad["reason"], bad["verdict"]) == ("rejected", "the file is empty", "")


# Kills: a recording of which a part is no evidence that looks like any other.
def test_an_accepted_recording_that_is_evidence_in_part_has_its_reason():
    part, both = (
        {"status": "accepted", "reason": "no wave ran from 44.8 s on", "no_verdict": no_verdict}
        for no_verdict in (UNKNOWN, "no wave")
    )
    assert recordings._why_not(part) == "no wave ran from 44.8 s on"
    assert recordings._why_not(both) == "no verdict: no wave; no wave ran from 44.8 s on"


def test_a_held_out_recording_has_its_own_verdict_and_the_others_that_of_their_place_left_out():
    schemes = ["held_out", "leave_one_out", "resubstitution"]
    verdicts = pd.DataFrame(
        [
            {"recording": name, "detector": "diagonal", "scheme": scheme, "predicted_mm": size}
            for name, scheme, size in zip("htt", schemes, (1.0, 2.0, 3.0), strict=True)
        ]
    )
    for shown, of_teaching in zip(schemes, (2, 2, 3), strict=True):
        found = recordings.verdicts_of(verdicts, ["t", "h", "n"], "diagonal", shown, schemes)
        assert found["predicted_mm"].to_list() == [
            of_teaching,
            1,
            pytest.approx(UNKNOWN, nan_ok=True),
        ]
    none = recordings.verdicts_of(verdicts, ["h"], "taught", "held_out", schemes)
    assert none["predicted_mm"].isna().all()


SCHEMES = ["leave_one_out", "resubstitution"]


def row(name, size_mm, *, accepted=True):
    return {"recording": name, "size_mm": size_mm, "accepted": accepted, "sha256": "0123456789" * 6}


def test_every_detector_and_scheme_has_a_verdict_on_every_row():
    rows = [row("0mm/a", 0.0), row("2mm/a", 2.0), row("2mm/b", 2.0, accepted=False)]
    rows.append(row("unlabelled/a", None))
    verdicts = pd.DataFrame(
        [
            ["0mm/a", "leave_one_out", 1.0, 3.0],
            ["0mm/a", "resubstitution", UNKNOWN, UNKNOWN],
            ["2mm/a", "leave_one_out", 0.0, -2.0],
            ["2mm/a", "resubstitution", 2.0, 7.0],
            ["unlabelled/a", "all", 3.0, 9.0],
        ],
        columns=["recording", "scheme", "predicted_mm", "score"],
    ).assign(detector="template")
    data = page_data(rows, verdicts, ["template"], [0.0, 2.0], SCHEMES, 1.0)
    said = {
        key: list(zip(each["predicted_mm"], [OUTCOMES[n] for n in each["outcome"]], strict=True))
        for key, each in data["verdicts"].items()
    }
    rejected, unlabelled = (None, "rejected"), (3.0, "unlabelled")
    assert said == {
        "template|leave_one_out": [(1.0, "false alarm"), (0.0, "missed"), rejected, unlabelled],
        "template|resubstitution": [(None, "not judged"), (2.0, "exact"), rejected, unlabelled],
    }
    marks = {
        key: [(m["size_mm"], m["scores"]) for m in each] for key, each in data["scores"].items()
    }
    assert marks == {
        "template|leave_one_out": [(0.0, [3.0]), (2.0, [-2.0])],
        "template|resubstitution": [(2.0, [7.0])],
    }
    assert data["main_scheme"] == "leave_one_out"
    (stands_in, _) = (each["stand_in"] for each in data["schemes"])
    assert stands_in == ["leave_one_out", "all", "resubstitution"]
    assert data["recordings"] == ["0mm/a", "2mm/a", "unlabelled/a"]


@pytest.mark.parametrize("count", [1, 2, MAX_MARKS, MAX_MARKS + 1, 5 * MAX_MARKS])
def test_of_many_scores_those_of_even_ranks_are_marked(count):
    (marks,) = score_marks(np.zeros(count), np.arange(count, 0.0, -1.0))
    assert marks["of"] == count
    assert len(marks["scores"]) == min(count, MAX_MARKS)
    assert marks["scores"] == sorted(set(marks["scores"]))
    assert (marks["scores"][0], marks["scores"][-1]) == (1.0, float(count))
