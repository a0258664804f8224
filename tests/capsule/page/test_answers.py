"""The answers in values: a size counts as found only with every larger one, and nothing is NaN."""

import pandas as pd
import pytest

from capsule import words
from capsule.page import answers
from support.evaluated import evaluated

UNKNOWN = float("nan")


def detection(*rates):
    rows = [
        {"size_mm": size, "precision": precision, "recall": recall}
        for size, precision, recall in rates
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("rates", "specificity", "expected"),
    [
        ([(1, 0.6, 0.9), (2, 0.85, 17 / 20), (3, 1.0, 1.0)], 0.95, 2.0),
        ([(1, 1.0, 1.0), (2, 0.5, 1.0), (3, 1.0, 1.0)], 17 / 20, 3.0),
        ([(1, 1.0, 1.0), (2, 1.0, 0.84)], 1.0, None),
        ([(1, 1.0, 1.0), (2.5, UNKNOWN, 1.0)], 1.0, None),
        ([(1, 1.0, UNKNOWN), (2.5, 1.0, 1.0)], 1.0, 2.5),
        ([(1, UNKNOWN, UNKNOWN)], 1.0, None),
        ([(1, 1.0, 1.0), (2, 1.0, 1.0)], 16 / 20, None),
        ([(1, 1.0, 1.0), (2, 1.0, 1.0)], UNKNOWN, None),
    ],
)
def test_reliable_is_a_size_from_which_on_all_are_found(rates, specificity, expected):
    found = answers.smallest_reliable_size(detection(*rates), specificity, 0.85)
    assert found == expected


def test_the_papers_false_alarms_leave_no_size_reliably_found():
    paper = evaluated([]).paper
    settings = {"evaluation": {"confidence": 0.95, "tolerance_mm": 1.0}}
    settings["report"] = {"reliable_rate": 0.85}
    beside = answers.paper_answers(paper, sizing(), settings, 1)
    assert (beside.smallest_mm, beside.specificity.value) == (None, 0.3)
    settings["report"] = {"reliable_rate": 0.3}
    assert answers.paper_answers(paper, sizing(), settings, 1).smallest_mm == 1.0


def test_the_mean_error_counts_a_missed_nodule_as_0_mm():
    predictions = pd.DataFrame(
        {"size_mm": [0.0, 2.0, 2.0, 3.0], "predicted_mm": [5.0, 2.0, 0.0, 4.0]}
    )
    error = answers.mean_size_error(predictions, 0.95)
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
    paper = {"sizing": sizing(3, 2), "detection": detection((2, 1.0, 1.0), (3, 1.0, 1.0))}
    paper["specificity"] = pd.DataFrame()
    settings = {"evaluation": {"confidence": 0.95, "tolerance_mm": 1.0}}
    settings["report"] = {"reliable_rate": 0.85}
    beside = answers.paper_answers(paper, sizing(*sizes_mm), settings, 1)
    assert beside.sizes_mm == (2, 3) and beside.same_tolerance
    assert (beside.ours_within.of if beside.ours_within else None) == of
    assert not answers.paper_answers(paper, sizing(*sizes_mm), settings, 2).same_tolerance
