import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from capsule.evaluation.columns import RATES
from capsule.evaluation.intervals import Units, lower_bound, rate, rate_of
from capsule.evaluation.measures import measure_tables
from capsule.evaluation.rates import cluster_unit, is_right, of_each

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
RULES = {"tolerance_mm": 1.0, "confidence": 0.95}
UNKNOWN = float("nan")


def predictions(pairs, scheme="leave_one_out", detector="template"):
    """Make predictions of pairs of true and predicted size."""
    rows = [
        {"recording": f"{true:g}mm/r{number}", "size_mm": true, "predicted_mm": predicted}
        for number, (true, predicted) in enumerate(pairs)
    ]
    columns = ["recording", "size_mm", "predicted_mm"]
    return pd.DataFrame(rows, columns=columns).assign(detector=detector, scheme=scheme)


def rate_tables(predictions, sizes, rules, index=None):
    return measure_tables(predictions, sizes, rules, index, RATES)


def table(name, pairs, sizes=SIZES, rules=RULES):
    return rate_tables(predictions(pairs), sizes, rules)[name].to_dict("records")


PAPER = [
    (true, predicted)
    for true, counts in PAPER_COUNTS.items()
    for predicted, count in enumerate(counts)
    for _ in range(count)
]


def test_the_definitions_give_the_papers_precision_and_recall():
    _, *rows = table("detection", PAPER)
    precision = [round(100 * row["precision"], 1) for row in rows]
    recall = [round(100 * row["recall"], 1) for row in rows]
    assert precision == [57.7, 85.0, 100.0, 100.0, 100.0]
    assert recall == [75.0, 85.0, 100.0, 100.0, 100.0]
    assert (rows[0]["tp"], rows[0]["fp"], rows[0]["fn"]) == (15, 11, 5)
    ends = [rows[0][f"precision_{end}"] for end in ("low", "high")]
    assert ends == list(rate(15, 26, 0.95)[1:])


def test_the_definitions_give_the_papers_size_rates():
    whole, *rows = table("sizing", PAPER)
    # Of all sizes together: 43 of 100 exact.
    assert (whole["recordings"], whole["exact"], whole["one_sided"]) == (100, 43, False)
    assert [row["exact_rate"] for row in rows[1:]] == [0.30, 0.55, 0.70, 0.15]
    assert [row["within_rate"] for row in rows[1:]] == [0.85, 0.85, 0.85, 0.70]
    assert [row["one_sided"] for row in rows] == [True, False, False, False, True]


def test_specificity_is_what_the_paper_leaves_unsaid():
    none, *_ = table("detection", PAPER)
    assert (none["size_mm"], none["tp"], none["fn"], none["recall"]) == (0.0, 6, 14, 0.3)
    assert none["recall_at_least"] == rate(6, 20, 0.9)[1]
    # Eight nodules are missed, so 6 of 14 verdicts of no nodule are right.
    assert (none["fp"], none["precision"]) == (8, 6 / 14)


def test_the_confusion_table_counts_every_recording_once():
    rows = table("confusion", PAPER)
    counts = {(row["size_mm"], row["predicted_mm"]): row["count"] for row in rows}
    for true, expected in PAPER_COUNTS.items():
        assert [counts[true, predicted] for predicted in SIZES] == expected
    first = [rows[0][f"share{end}"] for end in ("", "_low", "_high")]
    assert first == list(rate(6, 20, 0.95))


def test_a_missed_nodule_has_no_size_within_the_tolerance():
    for row in table("sizing", [(1.0, 0.0), (1.0, 2.0)], [0.0, 1.0]):
        assert row["within"] == 1
        assert row["mean_absolute_error_mm"] == 1.0


def test_decimal_sizes_lie_within_a_decimal_tolerance():
    _, row = table("sizing", [(2.5, 2.3)], [0.0, 2.5], RULES | {"tolerance_mm": 0.2})
    assert row["within"] == 1


def test_a_recording_without_a_verdict_is_a_failure_in_every_rate_but_the_precision():
    pairs = [(0.0, 0.0), (0.0, UNKNOWN), (0.0, 1.0), (1.0, 1.0), (1.0, UNKNOWN), (1.0, 0.0)]
    made = rate_tables(predictions(pairs), [0.0, 1.0], RULES)
    specific, detection = made["detection"].to_dict("records")
    assert (detection["tp"], detection["fp"], detection["fn"]) == (1, 1, 2)
    assert (detection["recall"], detection["precision"]) == (1 / 3, 1 / 2)
    assert (specific["tp"], specific["fp"], specific["fn"]) == (1, 1, 2)
    _, sizing = made["sizing"].to_dict("records")
    assert (sizing["recordings"], sizing["exact"], sizing["within"]) == (3, 1, 1)
    assert sizing["mean_absolute_error_mm"] == pytest.approx(2 / 3)
    confusion = made["confusion"]
    assert confusion["count"].sum() == 6
    silent = confusion[confusion["predicted_mm"].isna()]
    assert silent["count"].tolist() == [1, 1]
    # A detector that is never silent has no row for it; one that always is has no rows.
    assert len(table("confusion", PAPER)) == 36
    assert rate_tables(predictions([(0.0, UNKNOWN)]), [0.0, 1.0], RULES)["detection"].empty


def test_no_verdict_is_never_right():
    predicted, true = np.array([0.0, 1.0, UNKNOWN] * 2), np.repeat([0.0, 2.0], 3)
    assert is_right(predicted, true).tolist() == [True, False, False, False, True, False]


def index_of(names, **columns):
    rows = {name: {"site": "", "session": "", "setup": "", "near_copies": ""} for name in names}
    for column, values in columns.items():
        for name, value in zip(names, values, strict=True):
            rows[name][column] = value
    return rows


def test_the_interval_of_a_rate_is_over_places():
    pairs = [(0.0, 0.0)] * 6 + [(0.0, 1.0)] * 2
    table_of = predictions(pairs)
    index = index_of(table_of["recording"], site=["a", "a", "b", "b", "c", "c", "d", "d"])
    row, _ = rate_tables(table_of, [0.0, 1.0], RULES, index)["detection"].to_dict("records")
    right = np.array([True] * 6 + [False] * 2)
    places = Units.of_places(np.repeat(np.arange(4), 2))
    expected = rate_of(right, places, 0.95)
    assert [row[f"recall{end}"] for end in ("", "_low", "_high")] == list(expected)
    assert row["recall_at_least"] == lower_bound(right, places)
    assert row["clusters"] == 4
    copies = index_of(table_of["recording"], near_copies=[table_of["recording"][1], *[""] * 7])
    row, _ = rate_tables(table_of, [0.0, 1.0], RULES, copies)["detection"].to_dict("records")
    assert row["clusters"] == 7


@pytest.mark.parametrize(
    ("scheme", "setups", "unit"),
    [
        ("held_out", "aabbcc", "setup"),
        ("leave_one_setup_out", "aabbcc", "setup"),
        ("leave_one_session_out", "aabbcc", "setup"),
        ("leave_one_out", "aabbcc", "place"),
        ("resubstitution", "aabbcc", "place"),
        ("held_out", "aabbbb", "place"),
        ("held_out", ["a", "a", "b", "b", "c", ""], "place"),
    ],
)
def test_clusters_are_set_ups_where_there_are_enough_and_the_scheme_may_leave_them_out(
    scheme, setups, unit
):
    verdicts = predictions([(0.0, 0.0)] * 6, scheme)
    index = index_of(verdicts["recording"], setup=setups)
    ((_, rows),) = of_each(verdicts, 1.0, index)
    assert cluster_unit(rows) == unit
    # Of two kinds of recordings, both need set-ups of their own.
    assert cluster_unit(rows, rows[:2]) == "place"


@pytest.mark.parametrize("turned", [False, True])
def test_detectors_come_in_their_order_and_what_was_held_out_first(turned):
    order = ["held_out", "leave_one_out", "leave_one_session_out", "resubstitution"]
    table_of = pd.concat(
        predictions([(0.0, 0.0)], scheme, name)
        for name in "ba"
        for scheme in (order[::-1] if turned else order)
    )
    keys = [tuple(key.values()) for key, _ in of_each(table_of, 1.0)]
    assert keys == [(name, scheme) for name in "ba" for scheme in order]


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
    none, *_ = table("detection", [(1.0, 1.0)])
    assert math.isnan(none["recall"]) and math.isnan(none["recall_at_least"])
    assert (none["tp"] + none["fn"], none["clusters"]) == (0, 0)


def test_tables_keep_schemes_apart():
    both = [predictions([(1.0, 0.0)]), predictions([(1.0, 1.0)], "resubstitution")]
    made = rate_tables(pd.concat(both), [0.0, 1.0], RULES)
    of_nodules = made["detection"].query("size_mm > 0")
    recall = dict(zip(of_nodules["scheme"], of_nodules["recall"], strict=True))
    assert recall == {"leave_one_out": 0.0, "resubstitution": 1.0}
    assert len(made["confusion"]) == 2 * 4


def test_every_table_has_its_columns_whether_or_not_it_has_rows():
    for pairs in ([(1.0, 1.0)], []):
        made = rate_tables(predictions(pairs), [0.0, 1.0], RULES)
        assert {name: list(rows) for name, rows in made.items()} == RATES
        assert made["detection"].empty == (not pairs)
