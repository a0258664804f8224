"""The leading detector: the best on this archive, the first of equals, or the one named."""

import math

import pandas as pd
import pytest

from capsule.evaluation.intervals import rate
from capsule.evaluation.lead import (
    Lead,
    balanced_accuracy,
    choosing_scheme,
    headline_confidence,
    leading,
)
from capsule.seeding import generator

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


def test_held_out_recordings_never_choose():
    assert choosing_scheme(["held_out", "leave_one_out", "resubstitution"]) == "leave_one_out"
    assert choosing_scheme(["held_out", "resubstitution"]) == "resubstitution"
    # On the held-out recordings, the rule of the paper is the only one that is right.
    apart = TABLE[TABLE["scheme"] == "leave_one_out"].assign(scheme="held_out")
    apart = apart.assign(
        predicted_mm=apart["size_mm"].where(apart["detector"] == "template", 2 - apart["size_mm"])
    )
    both = pd.concat([apart, TABLE])
    assert leading(both, NAMES, ["held_out", *SCHEMES], "best").detector == "diagonal"


def test_the_choice_of_the_best_is_paid_for_where_it_was_made():
    chosen, named = (Lead("diagonal", named, 0.9, 4) for named in (False, True))
    assert headline_confidence(chosen, "leave_one_out", 0.95) == pytest.approx(0.9875)
    assert headline_confidence(named, "leave_one_out", 0.95) == 0.95
    assert headline_confidence(chosen, "held_out", 0.95) == 0.95
    assert headline_confidence(Lead("template", False, math.nan, 0), "held_out", 0.95) == 0.95


def test_the_corrected_interval_of_the_best_of_four_holds_the_truth():
    numbers, inside, plainly = generator(1, "best of four"), 0, 0
    for _ in range(1500):
        hits = int(numbers.binomial(100, 0.7, 4).max())
        level = headline_confidence(Lead("best", False, 0.7, 4), "leave_one_out", 0.95)
        _, low, high = rate(hits, 100, level)
        inside += low <= 0.7 <= high
        _, low, high = rate(hits, 100, 0.95)
        plainly += low <= 0.7 <= high
    assert inside / 1500 >= 0.95 > 0.93 > plainly / 1500


def test_only_the_main_scheme_counts():
    other = TABLE.assign(scheme="resubstitution", predicted_mm=TABLE["size_mm"])
    other = other[other["detector"] == "template"]
    both = pd.concat([TABLE[TABLE["scheme"] == "leave_one_out"], other])
    assert leading(both, NAMES, SCHEMES, "best").detector == "diagonal"
