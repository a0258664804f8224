"""The leading detector: the best on this archive, the first of equals, or the one named."""

import math

import pandas as pd
import pytest

from capsule.evaluation.lead import balanced_accuracy, leading

SCHEMES = ["leave_one_out", "resubstitution"]


def predictions(**by_detector):
    """Return predictions for two healthy recordings and four of 2 mm, in this order."""
    rows = [
        {"detector": detector, "scheme": scheme, "size_mm": true, "predicted_mm": predicted}
        for detector, each in by_detector.items()
        for scheme in SCHEMES
        for true, predicted in zip([0.0] * 2 + [2.0] * 4, each, strict=True)
    ]
    return pd.DataFrame(rows, columns=["detector", "scheme", "size_mm", "predicted_mm"])


NAMES = ["template", "diagonal", "taught"]
TABLE = predictions(
    template=[2, 2, 2, 2, 2, 2], diagonal=[0, 0, 2, 2, 2, 0], taught=[0, 0, 3, 0, 2, 2]
)


@pytest.mark.parametrize(
    ("named", "detector", "accuracy"),
    [("best", "diagonal", 0.875), ("taught", "taught", 0.875), ("template", "template", 0.5)],
)
def test_the_best_leads_unless_another_is_named(named, detector, accuracy):
    lead = leading(TABLE, NAMES, SCHEMES, named)
    assert (lead.detector, lead.named) == (detector, named != "best")
    assert (lead.balanced_accuracy, lead.compared) == (accuracy, 3)
    assert leading(TABLE, NAMES[::-1], SCHEMES, "best").detector == "taught"


def test_no_verdict_counts_as_a_wrong_one():
    unknown = float("nan")
    table = predictions(template=[0, 0, 2, 2, 0, 0], taught=[0, unknown, 2, unknown, unknown, 2])
    assert balanced_accuracy(table[table["detector"] == "taught"]) == 0.5
    assert leading(table, NAMES, SCHEMES, "best").detector == "template"


def test_where_nothing_can_be_compared_the_first_leads():
    healthy = TABLE[TABLE["size_mm"] == 0]
    for table in (healthy, TABLE[TABLE["size_mm"] > 0], predictions()):
        lead = leading(table, NAMES, SCHEMES, "best")
        assert (lead.detector, lead.compared) == ("template", 0)
        assert math.isnan(lead.balanced_accuracy)


def test_only_the_main_scheme_counts():
    other = TABLE.assign(scheme="resubstitution", predicted_mm=TABLE["size_mm"])
    other = other[other["detector"] == "template"]
    both = pd.concat([TABLE[TABLE["scheme"] == "leave_one_out"], other])
    assert leading(both, NAMES, SCHEMES, "best").detector == "diagonal"
