"""The table of all recordings: every verdict related to the truth, every rejection with reason."""

from dataclasses import fields
from types import SimpleNamespace

import pandas as pd
import pytest

from capsule.detectors.familiar import Familiarity
from capsule.detectors.unlike import unlike
from capsule.page import recordings
from capsule.page.recordings import MAX_MARKS, score_marks
from capsule.page.tables import Tables
from support.evaluated import UNKNOWN, index_of


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


# Kills: a recording of which a part is no evidence, or that is unlike, and looks like any other.
def test_a_row_holds_the_verdict_and_what_is_wrong_with_a_recording_or_a_part_of_it():
    ended = "no wave ran from 44.8 s on"
    index = index_of(
        ["2mm/a", 2.0, "accepted", UNKNOWN, "bench 2", "aa", 70.0],
        ["2mm/b", 2.0, "accepted", UNKNOWN, "bench 2", "bb", 70.0],
        ["2mm/c", 2.0, "accepted", ended, "bench 2", "cc", 70.0],
        ["2mm/d", 2.0, "accepted", ended, "bench 2", "dd", 70.0],
        ["2mm/bad", 2.0, "rejected", "the file is empty", UNKNOWN, "ee", UNKNOWN],
    )
    index["no_verdict"] = [*[UNKNOWN] * 3, "no wave", UNKNOWN]
    row = {"detector": "template", "predicted_mm": 3.0}
    strange = row | Familiarity(False, ("noise",), 0.5, 0.1, 0.2).cells
    verdicts = {"2mm/a": [row], "2mm/b": [strange], "2mm/c": [row]}
    cells = [{"value": 0.3, "text": "0.30", "shade": 4}] * 4
    quality = {"2mm/a": {"cells": cells, "remarks": ["sensor 2 drifts"]}}
    rows = recordings.recording_rows(index, verdicts, "template", 1.0, quality)
    assert [(row["outcome"], row["remark"]) for row in rows] == [
        ("within tolerance", "sensor 2 drifts"),
        ("within tolerance", unlike(strange)),
        ("within tolerance", ended),
        ("not judged", f"no verdict: no wave; {ended}"),
        ("rejected", "the file is empty"),
    ]
    assert "bends by 50.0 %" in rows[1]["remark"]
    assert (rows[0]["size"], rows[0]["quality"]) == ("2 mm", cells)
    assert [cell["text"] for cell in rows[-1]["quality"]] == [""] * 4


def test_a_held_out_recording_has_its_own_verdict_and_the_others_that_of_their_place_left_out():
    schemes = ["held_out", "leave_one_out", "resubstitution"]
    predictions = pd.DataFrame(
        {"recording": [*"htt"], "scheme": schemes, "predicted_mm": [1, 2, 3]}
    )
    detections = pd.DataFrame([{"recording": "u", "detector": "diagonal", "predicted_mm": 4.0}])
    evaluation = SimpleNamespace(predictions=predictions.assign(detector="diagonal"))
    of_page = dict.fromkeys(field.name for field in fields(Tables)) | {"settings": {}}
    found = Tables(**of_page | {"evaluation": evaluation, "detections": detections}).by_recording
    said = {name: [row["predicted_mm"] for row in rows] for name, rows in found.items()}
    assert said == {"h": [1.0], "t": [2.0], "u": [4.0]}
    assert found["u"][0]["scheme"] == "all"


@pytest.mark.parametrize("count", [1, 2, MAX_MARKS, MAX_MARKS + 1, 5 * MAX_MARKS])
def test_of_many_scores_those_of_even_ranks_are_marked(count):
    scores = [*range(count, 0, -1), UNKNOWN, -7.0]
    size_mm = [2.0] * count + [2.0, 0.0]
    healthy, marks = score_marks(pd.DataFrame({"size_mm": size_mm, "score": scores}))
    assert healthy == {"size": "no nodule", "of": 1, "scores": [-7.0]}
    assert (marks["size"], marks["of"]) == ("2 mm", count)
    assert len(marks["scores"]) == min(count, MAX_MARKS)
    assert marks["scores"] == sorted(set(marks["scores"]))
    assert (marks["scores"][0], marks["scores"][-1]) == (1.0, float(count))
