import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, binomtest, rankdata

from capsule.evaluation import roc, tables
from capsule.evaluation.agreement import exceedance, paired_difference, permuted_areas
from capsule.evaluation.all_tables import all_tables
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.prevalence import predictive_values
from capsule.evaluation.reliability import brier_score, calibration_table
from capsule.evaluation.size_error import median_interval, size_error_row
from capsule.seeding import generator

SCORES = st.lists(st.integers(0, 9), min_size=1, max_size=12).map(np.array)


@given(SCORES, SCORES)
def test_the_area_counts_the_pairs_in_the_right_order(healthy, nodule):
    pairs = [(n > h) + 0.5 * (n == h) for n in nodule for h in healthy]
    assert roc.auc(healthy, nodule) == pytest.approx(np.mean(pairs))


@given(SCORES, SCORES)
def test_the_area_is_the_area_under_the_curve(healthy, nodule):
    _, false_rate, true_rate = roc.curve(healthy, nodule)
    assert np.trapezoid(true_rate, false_rate) == pytest.approx(roc.auc(healthy, nodule))


def test_the_curves_height_is_what_a_threshold_reaches():
    healthy, nodule = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.5, 3.5, 5.0, 6.0])
    heights = roc.height_at(healthy, nodule, np.array([0.0, 0.25, 1.0]))
    assert heights.tolist() == [0.5, 0.75, 1.0]


@given(SCORES, SCORES, st.booleans(), st.booleans())
def test_draws_that_are_judged_together_are_judged_as_each_alone(healthy, nodule, lowest, large):
    healthy = np.where(healthy == 0, -np.inf, healthy) if lowest else healthy
    grid, level, repeats = np.linspace(0, 1, 5), 0.5, 8
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(roc, "_VALUES_AT_ONCE", 3 * (healthy.size + nodule.size))
        patch.setattr(roc, "_CALL_FOR_EACH_FROM", 0 if large else 1000)
        area, low, high = roc.bootstrap(
            healthy, nodule, grid, generator(1, "one by one"), repeats, level
        )
    numbers = generator(1, "one by one")
    drawn = [
        [part[numbers.integers(0, part.size, part.size)] for part in (healthy, nodule)]
        for _ in range(repeats)
    ]
    areas = [roc.auc(*each) for each in drawn]
    ends = np.quantile(areas, [0.25, 0.75])
    observed = roc.auc(healthy, nodule)
    assert area == (min(ends[0], observed), max(ends[1], observed))
    band = np.quantile([roc.height_at(*each, grid) for each in drawn], [0.25, 0.75], axis=0)
    height = roc.height_at(healthy, nodule, grid)
    np.testing.assert_array_equal(
        [low, high], [np.minimum(band[0], height), np.maximum(band[1], height)]
    )


def test_bootstrap_intervals_hold_the_truth_as_often_as_they_say():
    numbers, inside = generator(1, "coverage"), 0
    for _ in range(100):
        healthy, nodule = numbers.normal(0, 1, 40), numbers.normal(1, 1, 40)
        (low, high), _, _ = roc.bootstrap(healthy, nodule, np.array([0.1]), numbers, 200, 0.95)
        inside += low <= 0.7602 <= high  # Phi(1 / sqrt(2))
    assert 87 <= inside <= 100


def test_predictive_values_follow_bayes():
    values = predictive_values(90, 100, 80, 100, prevalence=0.1, confidence=0.95)
    assert values["ppv"] == pytest.approx(0.09 / (0.09 + 0.18))
    assert values["npv"] == pytest.approx(0.72 / (0.72 + 0.01))
    for name in ("ppv", "npv"):
        assert values[f"{name}_low"] < values[name] < values[f"{name}_high"]
    assert np.isnan(predictive_values(0, 0, 5, 5, 0.1, 0.95)["ppv"])
    perfect = predictive_values(20, 20, 20, 20, 0.1, 0.95)
    assert perfect["ppv"] == 1.0
    assert 0.2 < perfect["ppv_low"] < 0.9


def test_a_true_probability_is_calibrated_and_a_false_one_is_not():
    numbers = generator(1, "calibration")
    truth = numbers.random(20000)
    nodule = numbers.random(20000) < truth
    share = nodule.mean()
    rows = calibration_table(truth, nodule, share, 5, 0.95)
    for row in rows:
        assert row["observed"] == pytest.approx(row["stated"], abs=0.03)
        assert row["observed_low"] <= row["observed"] <= row["observed_high"]
    assert brier_score(truth, nodule, share) < brier_score(1 - truth, nodule, share)
    assert brier_score(np.full(nodule.size, 0.1), nodule, 0.1) == pytest.approx(0.09)


def test_a_few_nodules_in_a_bin_do_not_prove_certainty():
    probability = np.array([0.1] * 20 + [0.9] * 5)
    low, empty, high = calibration_table(probability, probability > 0.5, 0.1, 3, 0.95)
    assert (low["observed"], high["observed"]) == (0.0, 1.0)
    assert low["observed_high"] > 0.01 and high["observed_low"] < 0.7
    assert empty["recordings"] == 0 and np.isnan(empty["observed"])


def test_the_comparison_of_two_detectors_is_mcnemars():
    first = np.array([True] * 2 + [False] * 10 + [True] * 28)
    second = np.array([False] * 2 + [True] * 10 + [True] * 28)
    row = paired_difference(first, second, 0.95)
    assert (row["only_first"], row["only_second"]) == (2, 10)
    assert row["difference"] == pytest.approx(8 / 40)
    assert row["difference_low"] < 0.2 < row["difference_high"]
    # Twice the binomial tail of 2 of 12: (1 + 12 + 66) / 4096.
    assert row["mcnemar_p"] == pytest.approx(2 * 79 / 4096)
    assert paired_difference(first, first, 0.95)["mcnemar_p"] == 1.0


@given(st.integers(0, 200), st.integers(0, 200))
def test_its_probability_is_that_of_the_binomial_test(first, second):
    right = np.repeat([[True, False], [False, True]], [first, second], axis=0).T
    expected = binomtest(first, first + second).pvalue if first + second else np.nan
    found = paired_difference(*right, 0.95)["mcnemar_p"]
    assert found == pytest.approx(expected, rel=1e-9, nan_ok=True)


@given(st.integers(1, 300), st.floats(0.5, 0.999))
def test_the_medians_interval_leaves_out_the_binomials_tails(count, confidence):
    median, low, high = median_interval(np.arange(count, dtype=float), confidence)
    skipped = binom.ppf((1 - confidence) / 2, count, 0.5)
    assert median == (count - 1) / 2
    np.testing.assert_equal(
        (low, high), (skipped - 1, count - skipped) if skipped else (np.nan,) * 2
    )


@given(SCORES.filter(lambda scores: scores.size > 1))
def test_equal_scores_share_their_rank(scores):
    nodule = np.arange(scores.size) % 2 == 0
    (area,) = permuted_areas(scores, nodule, generator(1, "ranks"), 1)
    sum_of_ranks = generator(1, "ranks").permutation(rankdata(scores))[: nodule.sum()].sum()
    pairs = nodule.sum() * (~nodule).sum()
    assert area * pairs == pytest.approx(sum_of_ranks - nodule.sum() * (nodule.sum() + 1) / 2)


def test_dealt_out_labels_fall_to_chance():
    numbers = generator(1, "chance")
    nodule = np.arange(60) >= 20
    areas = permuted_areas(nodule + 0.1 * numbers.normal(size=60), nodule, numbers, 500)
    assert areas.mean() == pytest.approx(0.5, abs=0.02)
    ties = np.array([0.0, 1.0, 1.0, 2.0])
    (area,) = permuted_areas(ties, np.array([False, True, False, True]), generator(1, "ties"), 1)
    dealt = generator(1, "ties").permutation(ties)
    assert area == pytest.approx(roc.auc(dealt[2:], dealt[:2]))
    assert exceedance(1.0, areas) == pytest.approx(1 / 501)


def test_a_missed_nodule_has_no_size_error():
    row = size_error_row(np.array([2.0, 2.0, 3.0]), np.array([2.5, np.nan, 2.5]), 0.95)
    assert (row["recordings"], row["detected"]) == (3, 2)
    assert row["bias_mm"] == 0.0
    assert row["absolute_error_mm"] == 0.5


def rows(detector, predicted):
    names = [name for name in tables.Verdicts.__annotations__ if name not in ("key", "recordings")]
    blank = dict.fromkeys(names, "")
    return [
        blank
        | {"recording": f"{size}mm/r{place}", "size_mm": str(size), "detector": detector}
        | {"scheme": "leave_one_out", "predicted_mm": str(value), "score": str(value)}
        for place, (size, value) in enumerate(zip((0, 0, 1, 1, 2), predicted, strict=True))
    ]


def test_tables_compare_detectors_with_each_other_and_with_always_nodule():
    one, other = tables.collect(rows("one", [0, 1, 0, 1, 2]) + rows("other", [0, 0, 1, 1, 2]))
    summary = {row["detector"]: row for row in tables.summary([one, other], 1.0, 0.95)}
    assert summary["one"]["balanced_accuracy"] == pytest.approx((2 / 3 + 1 / 2) / 2)
    assert summary["always_nodule"]["sensitivity"] == 1.0
    assert summary["always_nodule"]["balanced_accuracy"] == 0.5
    # "one" misses a nodule of 1 mm, which then has no size; "other" has all three sizes right.
    assert summary["one"]["exact_rate"] == summary["one"]["within_rate"] == pytest.approx(2 / 3)
    assert summary["other"]["exact_rate"] == 1.0
    assert np.isnan(summary["always_nodule"]["exact_rate"])
    low, high = (summary["one"][f"balanced_accuracy_{end}"] for end in ("low", "high"))
    assert low < summary["one"]["balanced_accuracy"] < high
    compared = {
        (row["measure"], row["size_mm"]): row["difference"]
        for row in tables.comparisons([one, other], 1.0, 0.95)
    }
    assert compared["detection", 0.0] == 0.5
    assert compared["detection", 1.0] == 0.5
    assert compared["detection", tables.ANY] == pytest.approx(1 / 3)
    assert compared["size_within_tolerance", 2.0] == 0.0


RULES = {
    "confidence": 0.95,
    "tolerance_mm": 1.0,
    "prevalence": 0.5,
    "specificity": 0.5,
    "seed": 1,
    "bootstrap": 50,
    "permutations": 50,
    "calibration_bins": 2,
    "passes": [1, 2],
}


def test_every_table_is_made_of_each_detector_and_scheme():
    once = rows("template", [0, 1, 0, 1, 2]) + rows("diagonal", [0, 0, 1, 1, 2])
    by_site = [row | {"scheme": "leave_one_site_out"} for row in once]
    stated = [row | {"probability": "0.5", "location_mm": "7"} for row in once + by_site]
    names = [row["recording"] for row in once[:5]]
    sites = dict(zip(names, ["a", "a", "b", "b", ""], strict=True))
    found = all_tables(stated, sites, dict.fromkeys(names, 6.0), RULES)
    assert list(found) == list(COLUMNS)
    for name, made in found.items():
        assert set(COLUMNS[name]) <= set(made[0]), name
        # Verdicts on several passes over a site are valid only if the site taught nothing.
        schemes = {"leave_one_site_out"} | ({"leave_one_out"} if name != "retest" else set())
        assert {row["scheme"] for row in made} == schemes, name
    assert {row["passes"] for row in found["retest"]} == {1, 2}


def test_without_a_verdict_every_table_is_empty():
    assert all_tables([], {}, {}, RULES) == {name: [] for name in COLUMNS}


def test_a_recording_without_a_score_enters_no_curve():
    unknown = rows("one", [0, 1, 0, 1, 2])
    unknown[1]["score"] = ""
    (verdicts,) = tables.collect(unknown)
    areas, _ = tables.curves(verdicts, 1, 100, 0.95)
    assert areas[0]["auc"] == pytest.approx((0.5 + 1 + 1) / 3)
    (row,) = tables.permutation(verdicts, 1, 100, 0.95)
    assert row["auc"] == areas[0]["auc"]


def test_the_interval_of_the_median_lies_between_two_of_the_values():
    # Of 20 values, 6 to 15 hold the median with 95.9 % (a table in any textbook of signs).
    assert median_interval(np.arange(1.0, 21.0), 0.95) == (10.5, 6.0, 15.0)
    few = median_interval(np.array([1.0, 2.0, 4.0]), 0.95)
    assert few[0] == 2.0 and np.isnan(few[1:]).all()


def test_a_verdict_that_is_not_known_enters_no_table():
    unknown = rows("one", [0, 1, 0, 1, 2])
    unknown[1]["predicted_mm"] = ""
    (verdicts,) = tables.collect(unknown)
    (row, _) = tables.summary([verdicts], 1.0, 0.95)
    assert row["recordings"] == 4
    assert row["specificity"] == 1.0


def test_places_are_compared_where_the_header_tells_them():
    known = rows("one", [0, 0, 1, 1, 2])
    for row, place in zip(known, (5, 5, 7, 9, 11), strict=True):
        row["location_mm"] = str(place)
    (verdicts,) = tables.collect(known)
    where = {"1mm/r2": 6.0, "1mm/r3": 6.0, "2mm/r4": float("nan")}
    found = {row["size_mm"]: row for row in tables.localisation(verdicts, where, 0.95)}
    assert set(found) == {tables.ANY, 1.0}
    assert found[1.0]["median_absolute_error_mm"] == 2.0
    assert found[1.0]["bias_mm"] == 2.0
