import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from capsule.evaluation.rates import (
    COLUMNS,
    confusion_table,
    detection_table,
    rate,
    sizing_table,
    specificity_row,
    tables,
)

# A set of verdicts that gives every number the paper prints: none/1/2/3/4/5 mm per true size.
PAPER_COUNTS = {
    0: [6, 11, 3, 0, 0, 0],
    1: [5, 9, 6, 0, 0, 0],
    2: [3, 6, 6, 5, 0, 0],
    3: [0, 3, 3, 11, 3, 0],
    4: [0, 1, 2, 2, 14, 1],
    5: [0, 0, 2, 4, 11, 3],
}
SIZES = [0, 1, 2, 3, 4, 5]


def paper_verdicts():
    pairs = [
        (true, predicted)
        for true, counts in PAPER_COUNTS.items()
        for predicted, count in enumerate(counts)
        for _ in range(count)
    ]
    return np.array(pairs, dtype=float).T


def test_the_definitions_give_the_papers_precision_and_recall():
    rows = detection_table(*paper_verdicts(), SIZES[1:], confidence=0.95)
    precision = [round(100 * row["precision"], 1) for row in rows]
    recall = [round(100 * row["recall"], 1) for row in rows]
    assert precision == [57.7, 85.0, 100.0, 100.0, 100.0]
    assert recall == [75.0, 85.0, 100.0, 100.0, 100.0]
    assert (rows[0]["tp"], rows[0]["fp"], rows[0]["fn"]) == (15, 11, 5)


def test_the_definitions_give_the_papers_size_rates():
    rows = sizing_table(*paper_verdicts(), SIZES[1:], tolerance_mm=1, confidence=0.95)
    assert [row["exact_rate"] for row in rows[1:]] == [0.30, 0.55, 0.70, 0.15]
    assert [row["within_rate"] for row in rows[1:]] == [0.85, 0.85, 0.85, 0.70]
    assert [row["one_sided"] for row in rows] == [True, False, False, False, True]


def test_specificity_is_what_the_paper_leaves_unsaid():
    row = specificity_row(*paper_verdicts(), confidence=0.95)
    assert (row["healthy"], row["true_negatives"], row["specificity"]) == (20, 6, 0.3)


def test_the_confusion_table_counts_every_recording_once():
    rows = confusion_table(*paper_verdicts(), SIZES)
    counts = {(row["size_mm"], row["predicted_mm"]): row["count"] for row in rows}
    for true, expected in PAPER_COUNTS.items():
        assert [counts[true, predicted] for predicted in SIZES] == expected


def test_a_missed_nodule_has_no_size_within_the_tolerance():
    true_mm, predicted_mm = np.array([1.0, 1.0]), np.array([0.0, 2.0])
    (row,) = sizing_table(true_mm, predicted_mm, [1.0], tolerance_mm=1, confidence=0.95)
    assert row["within"] == 1
    assert row["mean_absolute_error_mm"] == 1.0


def test_decimal_sizes_lie_within_a_decimal_tolerance():
    (row,) = sizing_table(np.array([2.5]), np.array([2.3]), [2.5], 0.2, confidence=0.95)
    assert row["within"] == 1


@given(st.integers(1, 200).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_intervals_are_wilsons(pair):
    hits, count = pair
    z = 1.959963984540054
    p = hits / count
    centre = (p + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * math.sqrt(p * (1 - p) / count + z**2 / (4 * count**2))
    value, low, high = rate(hits, count, 0.95)
    assert value == p
    assert low == pytest.approx(max(centre - half, 0.0), abs=1e-12)
    assert high == pytest.approx(min(centre + half, 1.0), abs=1e-12)
    assert low <= value <= high


@pytest.mark.parametrize(("hits", "count"), [(0, 20), (15, 26), (17, 20), (20, 20)])
@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_intervals_are_those_of_scipy(hits, count, confidence):
    expected = binomtest(hits, count).proportion_ci(confidence, method="wilson")
    _, low, high = rate(hits, count, confidence)
    assert (low, high) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_a_rate_of_nothing_is_unknown():
    assert all(math.isnan(number) for number in rate(0, 0, 0.95))
    row = specificity_row(np.array([1.0]), np.array([1.0]), 0.95)
    assert math.isnan(row["specificity"])
    assert row["healthy"] == 0


def test_tables_keep_schemes_apart():
    row = {"detector": "template", "size_mm": 1.0}
    predictions = [
        {**row, "scheme": "leave_one_out", "predicted_mm": 0.0},
        {**row, "scheme": "resubstitution", "predicted_mm": 1.0},
    ]
    made = tables(
        predictions,
        [0.0, 1.0],
        schemes=["leave_one_out", "resubstitution"],
        tolerance_mm=1,
        confidence=0.95,
    )
    recall = {row["scheme"]: row["recall"] for row in made["detection"]}
    assert recall == {"leave_one_out": 0.0, "resubstitution": 1.0}
    assert len(made["confusion"]) == 2 * 4


def test_every_table_has_its_columns_whether_or_not_it_has_rows():
    rows = [{"detector": "a", "scheme": "leave_one_out", "size_mm": 1.0, "predicted_mm": 1.0}]
    settings = {"schemes": ["leave_one_out"], "tolerance_mm": 1.0, "confidence": 0.95}
    for name, table in tables(rows, [0.0, 1.0], **settings).items():
        assert all(list(row) == COLUMNS[name] for row in table)
    empty = tables([], [0.0], **settings)
    assert set(empty) == set(COLUMNS) and not any(empty.values())
