"""The leading detector: the best on this archive, the first of equals, or the one named."""

import math

import numpy as np
import pandas as pd
import pytest

from capsule.evaluation.lead import (
    Lead,
    headline_confidence,
    leading,
)
from capsule.evaluation.measures import measure_tables

RULES = {"tolerance_mm": 1.0, "confidence": 0.95, "specificity": 0.75, "prevalence": 0.1}
SCHEMES = ["leave_one_out", "resubstitution"]


def summary(**by_detector):
    """Return the summary of scores above a threshold of 1, of four healthy recordings and of 2 mm.

    The thresholds let a quarter of the healthy recordings pass, and that of `template` all.
    """
    rows = [
        {"detector": detector, "scheme": scheme, "score": score, "size_mm": true, "threshold": 1.0}
        | {"predicted_mm": score if np.isnan(score) else 2.0 * (score > 1)}
        for detector, scores in by_detector.items()
        for scheme in SCHEMES
        for true, score in zip([0.0] * 4 + [2.0] * 4, scores, strict=True)
    ]
    columns = ["detector", "scheme", "score", "size_mm", "threshold", "predicted_mm"]
    table = pd.DataFrame(rows, columns=columns)
    return measure_tables(table, [0.0, 2.0], RULES, names=["summary"])["summary"]


NAMES = ["template", "diagonal", "taught"]
# By balanced accuracy `template` would lead, whose threshold of 1 raises no false alarm here.
SCORES = {
    "template": [0, 0, 0.9, 0.8, 2, 2, 0.5, 0.5],
    "diagonal": [0, 0, 2, 0.8, 2, 2, 1.5, 0.5],
    "taught": [0, 0, 0.9, 2, 1.5, 0.5, 3, 1.2],
}
TABLE = summary(**SCORES)


@pytest.mark.parametrize(
    ("named", "detector", "sensitivity"),
    [("best", "diagonal", 0.75), ("taught", "taught", 0.75), ("template", "template", 0.5)],
)
def test_the_one_that_finds_most_at_the_same_specificity_leads_unless_another_is_named(
    named, detector, sensitivity
):
    lead = leading(TABLE, NAMES, SCHEMES, named)
    assert (lead.detector, lead.named) == (detector, named != "best")
    assert (lead.sensitivity, lead.compared) == (sensitivity, 3)
    assert leading(TABLE, NAMES[::-1], SCHEMES, "best").detector == "taught"


def test_a_threshold_that_is_set_too_high_or_too_low_does_not_choose():
    # Every score of `taught` is moved, so that its own threshold finds all, or nothing.
    for moved in (+5, -5):
        scores = SCORES | {"taught": [each + moved for each in SCORES["taught"]]}
        lead = leading(summary(**scores), ["template", "taught"], SCHEMES, "best")
        assert (lead.detector, lead.sensitivity) == ("taught", 0.75)
    # Half of the folds add 10 to score and threshold alike, as an adapted network may.
    added, sizes_mm = np.tile([0.0, 10.0], 4), np.repeat([0.0, 2.0], 4)
    made = {"size_mm": sizes_mm, "predicted_mm": sizes_mm, "score": added + sizes_mm}
    made = pd.DataFrame(made | {"threshold": added + 1, "detector": "one", "scheme": SCHEMES[0]})
    made = measure_tables(made, [0.0, 2.0], RULES, names=["summary"])["summary"]
    assert made["sensitivity_at_specificity"][0] == 1.0


def test_no_verdict_counts_as_a_false_alarm_or_a_missed_nodule():
    unknown = float("nan")
    table = summary(template=SCORES["template"], taught=[0, 0, unknown, 0.5, 2, 2, unknown, 0.2])
    assert leading(table, NAMES, SCHEMES, "taught").sensitivity == 0.5
    table = summary(taught=[unknown, unknown, 0, 0.5, 2, 2, 2, 2])
    assert leading(table, NAMES, SCHEMES, "taught").sensitivity == 0.0


def test_held_out_recordings_never_choose_and_where_nothing_can_be_compared_the_first_leads():
    apart = TABLE[TABLE["scheme"] == "leave_one_out"].assign(scheme="held_out")
    apart["sensitivity_at_specificity"] = (apart["detector"] == "template").astype(float)
    both = pd.concat([apart, TABLE])
    assert leading(both, NAMES, ["held_out", *SCHEMES], "best").detector == "diagonal"
    healthy = {name: [*each[:4], *[math.nan] * 4] for name, each in SCORES.items()}
    for table in (summary(), summary(**healthy).assign(sensitivity_at_specificity=math.nan)):
        lead = leading(table, NAMES, SCHEMES, "best")
        assert (lead.detector, lead.compared) == ("template", 0)
        assert math.isnan(lead.sensitivity)


@pytest.mark.parametrize(
    ("named", "scheme", "compared", "level"),
    [
        (False, "leave_one_out", 4, 0.9875),
        (True, "leave_one_out", 4, 0.95),
        (False, "held_out", 4, 0.95),
        (False, "leave_one_out", 0, 0.95),
    ],
)
def test_the_choice_of_the_best_is_paid_for_where_it_was_made(named, scheme, compared, level):
    lead = Lead("diagonal", named, 0.7, compared)
    assert headline_confidence(lead, scheme, 0.95) == pytest.approx(level)
