"""The answers in values: a size counts as found only with every larger one, and nothing is NaN."""

import pandas as pd
import pytest

from capsule import words
from capsule.evaluation.intervals import rate
from capsule.page import answers
from capsule.page.detector_sections import answers_of
from support.evaluated import evaluated, rates_of

UNKNOWN = float("nan")


def found(*rates):
    """Return how often each size is found, from triples: size, lower bound, number."""
    return [
        answers.Found(size, answers.Estimate(1.0, bound, 1.0, 1, of, at_least=bound))
        for size, bound, of in rates
    ]


@pytest.mark.parametrize(
    ("bounds", "specificity", "expected"),
    [
        ([(1, 0.6, 20), (2, 0.85, 20), (3, 0.88, 20)], 0.86, 2.0),
        ([(1, 0.9, 20), (2, 0.5, 20), (3, 0.9, 20)], 0.85, 3.0),
        ([(1, 0.9, 20), (2, 0.84, 20)], 0.9, None),
        ([(1, UNKNOWN, 20), (2.5, 0.9, 20)], 0.9, 2.5),
        ([(1, UNKNOWN, 20)], 0.9, None),
        ([(1, 0.9, 20), (2, 0.9, 20)], 0.84, None),
        ([(1, 0.9, 20), (2, 0.9, 20)], UNKNOWN, None),
        ([], 0.9, None),
    ],
)
def test_reliable_is_a_size_from_which_on_all_are_found(bounds, specificity, expected):
    assert answers.smallest_reliable_size(found(*bounds), specificity, 0.85) == expected


def test_the_lower_bound_makes_a_size_reliable_and_not_the_estimate():
    nodules = [(f"2mm/{run}", 2.0, 2.0 if run else 0.0) for run in range(20)]
    healthy = [(f"0mm/{run}", 0.0, 0.0) for run in range(40)]
    # 19 of 20 are 95 %, but with a lower bound of 80.4 %.
    one_missed = answers_of(rates_of(evaluated(nodules + healthy)), "template", "leave_one_out")
    assert one_missed.found[0].recall.value == 0.95
    assert one_missed.found[0].recall.at_least == pytest.approx(0.804, abs=0.001)
    assert one_missed.smallest_mm is None
    all_found = [(name, size, 2.0) for name, size, _ in nodules]
    answer = answers_of(rates_of(evaluated(all_found + healthy)), "template", "leave_one_out")
    assert answer.smallest_mm == 2.0


def test_so_many_recordings_can_show_that_a_size_is_reliably_found():
    for level in (0.8, 0.85, 0.9):
        needed = answers.recordings_to_show(level)
        assert rate(needed, needed, 0.9)[1] >= level > rate(needed - 1, needed - 1, 0.9)[1]
    assert answers.recordings_to_show(0.85) == 16


def test_a_threshold_sets_the_specificity_and_promises_what_it_can():
    enough = answers.set_specificity(20, 0.95, 0.95)
    # Beta(20, 1): the roots of 5 and 95 %.
    assert (enough.low, enough.high) == pytest.approx((0.05**0.05, 0.95**0.05))
    assert (enough.places, enough.least_places) == (20, 19)
    assert rate(0.95 * enough.needed, enough.needed, 0.95)[2] - rate(
        0.95 * enough.needed, enough.needed, 0.95
    )[1] == pytest.approx(0.1, abs=0.001)
    assert answers.set_specificity(0, 0.95, 0.95) is None


def test_where_the_threshold_sets_the_specificity_the_predictive_values_follow_from_it():
    verdicts = [(f"0mm/{run}", 0.0, 0.0 if run else 2.0) for run in range(20)]
    verdicts += [(f"2mm/{run}", 2.0, 2.0 if run % 10 else 0.0) for run in range(20)]
    rates = rates_of(evaluated(verdicts, (0.0, 2.0), ("template", "diagonal")))
    learned = answers_of(rates, "diagonal", "leave_one_out")
    assert learned.set_specificity.places == 20
    # 90 % of the nodules are found; of 1000 places 100 have one: 90 right, 45 false detections.
    assert learned.meaning.detection.value == pytest.approx(90 / 135)
    low = 0.09 / (0.09 + 0.9 * (1 - learned.set_specificity.low))
    assert learned.meaning.detection.low == pytest.approx(low)
    fixed = answers_of(rates, "template", "leave_one_out")
    assert fixed.set_specificity is None and fixed.specificity.value == 0.95
    (row,) = (
        rates.of("template", "leave_one_out")["predictive_values"]
        .query("size_mm.isna()")
        .to_dict("records")
    )
    assert fixed.meaning.detection.low == row["ppv_low"]
    held_out = rates_of(evaluated(verdicts, (0.0, 2.0), ("diagonal",), "held_out"))
    assert answers_of(held_out, "diagonal", "held_out").set_specificity is None


def test_the_papers_false_alarms_leave_no_size_reliably_found():
    paper = evaluated([]).paper
    settings = {"evaluation": {"confidence": 0.95, "tolerance_mm": 1.0}}
    settings["report"] = {"reliable_rate": 0.85}
    beside = answers.paper_answers(paper, sizing(), settings, 1)
    assert (beside.smallest_mm, beside.specificity.value) == (None, 0.3)
    # The one-sided bounds of 30 % of 20 and of 75 % of 20.
    settings["report"] = {"reliable_rate": 0.16}
    assert answers.paper_answers(paper, sizing(), settings, 1).smallest_mm == 1.0


def test_the_mean_error_counts_a_missed_nodule_as_0_mm():
    predictions = pd.DataFrame(
        {"size_mm": [0.0, 2.0, 2.0, 3.0], "predicted_mm": [5.0, 2.0, UNKNOWN, 4.0]}
    )
    error = answers.mean_size_error(predictions, 0.95)
    missed = predictions.fillna(0.0)
    assert answers.mean_size_error(missed, 0.95) == error
    assert error.value == 1.0
    assert error.of == 3
    # Student's t with 2 degrees of freedom is 4.3027 at 95 %.
    assert error.high == pytest.approx(1.0 + 4.3027 * 1.0 / 3**0.5, abs=1e-3)
    assert error.low == 0.0


def test_without_nodules_there_is_no_size_error():
    predictions = pd.DataFrame({"size_mm": [0.0], "predicted_mm": [0.0]})
    error = answers.mean_size_error(predictions, 0.95)
    assert error.of == 0
    assert words.number(error.value) == "not known"


def test_within_tolerance_pools_counts():
    sizing = pd.DataFrame({"size_mm": [1, 2, 3], "within": [1, 8, 9], "recordings": [10, 10, 10]})
    assert answers.within_tolerance(sizing, 0.95).value == 0.6
    assert answers.within_tolerance(sizing, 0.95, [2, 3]).value == 0.85
    assert answers.within_tolerance(sizing, 0.95, [7]).of == 0


def sizing(*sizes_mm):
    rows = {"size_mm": sizes_mm, "within": [9] * len(sizes_mm), "recordings": [10] * len(sizes_mm)}
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("sizes_mm", "of"), [((1, 2, 3), 20), ((2, 3), 20), ((1, 3), None), ((), None)]
)
def test_ours_is_compared_with_the_paper_only_over_all_of_its_sizes(sizes_mm, of):
    paper = {"sizing": sizing(3, 2), "detection": pd.DataFrame({"tp": [], "fn": [], "size_mm": []})}
    paper["specificity"] = pd.DataFrame()
    settings = {"evaluation": {"confidence": 0.95, "tolerance_mm": 1.0}}
    settings["report"] = {"reliable_rate": 0.85}
    beside = answers.paper_answers(paper, sizing(*sizes_mm), settings, 1)
    assert beside.sizes_mm == (2, 3) and beside.same_tolerance
    assert (beside.ours_within.of if beside.ours_within else None) == of
    assert not answers.paper_answers(paper, sizing(*sizes_mm), settings, 2).same_tolerance
