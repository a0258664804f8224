"""Tests of the data for the page's scripts: every detector's verdicts and scores."""

import pytest

from capsule.page.page_data import MAX_MARKS, page_data, score_marks
from capsule.page.recordings import OUTCOMES

SCHEMES = ["leave_one_out", "resubstitution"]


def row(name, size_mm, *, accepted=True):
    return {"recording": name, "size_mm": size_mm, "accepted": accepted, "sha256": "0123456789" * 6}


def verdict(detector, scheme, predicted_mm, score):
    return {
        "detector": detector,
        "scheme": scheme,
        "predicted_mm": predicted_mm,
        "score": score,
    }


def test_every_detector_and_scheme_has_a_verdict_on_every_row():
    rows = [row("0mm/a", 0.0), row("2mm/a", 2.0), row("2mm/b", 2.0, accepted=False)]
    rows.append(row("unlabelled/a", None))
    verdicts = {
        "0mm/a": [
            verdict("template", "leave_one_out", 1.0, 3.0),
            verdict("template", "resubstitution", None, None),
        ],
        "2mm/a": [
            verdict("template", "leave_one_out", 0.0, -2.0),
            verdict("template", "resubstitution", 2.0, 7.0),
        ],
        "unlabelled/a": [verdict("template", "all", 3.0, 9.0)],
    }
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
    assert list(data["checksums"]) == ["0mm/a", "2mm/a", "unlabelled/a"]


@pytest.mark.parametrize("count", [1, 2, MAX_MARKS, MAX_MARKS + 1, 5 * MAX_MARKS])
def test_of_many_scores_those_of_even_ranks_are_marked(count):
    rows = [row(f"0mm/{number}", 0.0) for number in range(count)]
    judged = [verdict("diagonal", "leave_one_out", 0.0, float(count - n)) for n in range(count)]
    (marks,) = score_marks(rows, judged)
    assert marks["of"] == count
    assert len(marks["scores"]) == min(count, MAX_MARKS)
    assert marks["scores"] == sorted(set(marks["scores"]))
    assert (marks["scores"][0], marks["scores"][-1]) == (1.0, float(count))
