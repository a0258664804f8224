"""The measures that rate the detectors, from verdicts that can be counted by hand."""

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from capsule.evaluation import measures, rates
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.intervals import Units, rate_of, ratio_interval
from capsule.seeding import generator

UNKNOWN = float("nan")
NUMBERS = ("score", "threshold", "probability", "estimate_mm", "location_mm")
ENDS = ("estimate_low_mm", "estimate_high_mm")
SIZES = (0.0, 0.0, 1.0, 1.0, 2.0)


def rows(detector, predicted, sizes=SIZES, scheme="leave_one_out", **columns):
    """Make predictions of one detector; the score is the predicted size."""
    verdicts = pd.DataFrame({"size_mm": sizes, "predicted_mm": np.array(predicted, dtype=float)})
    names = [f"{size:g}mm/r{number}" for number, size in enumerate(sizes)]
    verdicts = verdicts.assign(recording=names, detector=detector, scheme=scheme)
    verdicts = verdicts.assign(**dict.fromkeys([*NUMBERS, *ENDS], np.nan))
    return verdicts.assign(**{"score": verdicts["predicted_mm"], **columns})


def index_of(verdicts, **columns):
    names = list(dict.fromkeys(verdicts["recording"]))
    blank = {"site": "", "session": "", "setup": "", "near_copies": "", "nodule_at_mm": ""}
    made = {name: dict(blank) for name in names}
    for column, values in columns.items():
        for name, value in zip(names, values, strict=True):
            made[name][column] = str(value)
    return made


def of_each(verdicts, index=None):
    """Return the verdicts of each detector, all of one scheme."""
    each = rates.of_each(verdicts, RULES["tolerance_mm"], index)
    return {key["detector"]: judged for key, judged in each}


def one(verdicts, **columns):
    (judged,) = of_each(verdicts, index_of(verdicts, **columns)).values()
    return judged


RULES = {
    "confidence": 0.95,
    "tolerance_mm": 1.0,
    "prevalence": 0.5,
    "specificity": 0.5,
    "calibration_bins": 2,
    "passes": [1, 2],
    "sizes_mm": [0.0, 1.0, 2.0],
}


def summary(judged, rules=RULES):
    """Return the rows of one detector by size, without those of the baseline."""
    *made, _ = measures.summary("leave_one_out", {"one": judged}, rules)
    return {row["size_mm"]: row for row in made}


def sizing(judged, rules=RULES):
    return {row["size_mm"]: row for row in rates.sizing(judged, rules)}


def test_tables_compare_detectors_with_each_other_and_with_always_nodule():
    both = pd.concat([rows("one", [0, 1, 0, 1, 2]), rows("other", [0, 0, 1, 1, 2])])
    of_scheme = of_each(both)
    whole = rates.of_any(
        measures.measure_tables(both, RULES["sizes_mm"], RULES, names=["summary"])["summary"]
    )
    whole = whole.set_index("detector").to_dict("index")
    assert whole["one"]["balanced_accuracy"] == pytest.approx((2 / 3 + 1 / 2) / 2)
    assert whole["always_nodule"]["sensitivity"] == 1.0
    assert whole["always_nodule"]["balanced_accuracy"] == 0.5
    assert np.isnan(whole["always_nodule"]["ppv"]) and np.isnan(whole["always_nodule"]["auc"])
    low, high = (whole["one"][f"balanced_accuracy_{end}"] for end in ("low", "high"))
    assert low < whole["one"]["balanced_accuracy"] < high
    # "one" misses a nodule of 1 mm, which then has no size; "other" has all three sizes right.
    one, other = (sizing(of_scheme[name])[measures.ANY] for name in ("one", "other"))
    assert one["exact_rate"] == one["within_rate"] == pytest.approx(2 / 3)
    assert other["exact_rate"] == 1.0
    # The missed nodule counts as 0 mm.
    errors = [each["mean_absolute_error_mm"] for each in (one, other)]
    assert errors == [pytest.approx(1 / 3), 0.0]
    compared = {
        (row["measure"], row["size_mm"]): row["difference"]
        for row in measures.comparisons("leave_one_out", of_scheme, RULES)
    }
    assert compared["detection", 0.0] == 0.5
    assert compared["detection", 1.0] == 0.5
    assert compared["detection", measures.ANY] == pytest.approx(1 / 3)
    assert compared["size_within_tolerance", 2.0] == 0.0


def test_every_table_is_made_of_each_detector_and_scheme():
    verdicts = pd.concat(
        [
            rows(name, predicted, scheme=scheme, probability=0.5, location_mm=7.0)
            for name, predicted in (("template", [0, 1, 0, 1, 2]), ("diagonal", [0, 0, 1, 1, 2]))
            for scheme in ("leave_one_out", "held_out")
        ]
    )
    index = index_of(verdicts, site=["a", "a", "b", "b", ""], nodule_at_mm=[6.0] * 5)
    found = measures.measure_tables(verdicts, [0.0, 1.0, 2.0], RULES, index)
    assert list(found) == list(COLUMNS)
    for name, made in found.items():
        assert set(COLUMNS[name]) <= set(made.columns), name
        # The gain of several passes is shown once.
        schemes = {"leave_one_out"} | ({"held_out"} if name != "retest" else set())
        assert set(made["scheme"]) == schemes, name
    assert set(found["retest"]["passes"]) == {1, 2}


def test_without_a_verdict_every_table_is_empty():
    for verdicts in (rows("one", [], []), rows("one", [UNKNOWN] * 5)):
        found = measures.measure_tables(verdicts, [0.0, 1.0, 2.0], RULES, index_of(verdicts))
        assert list(found) == list(COLUMNS) and all(made.empty for made in found.values())


def test_a_recording_without_a_verdict_is_a_failure_in_every_table():
    verdicts = rows("one", [0, UNKNOWN, 1, UNKNOWN, 2])
    both = of_each(pd.concat([verdicts, rows("other", [0, 0, 1, 1, 2])]))
    row = next(measures.summary("leave_one_out", both, RULES))
    assert (row["recordings"], row["accuracy"]) == (5, 3 / 5)
    assert (row["sensitivity"], row["specificity"]) == (2 / 3, 1 / 2)
    # No verdict is neither a positive nor a negative one: none of the given verdicts was wrong.
    assert (row["ppv"], row["npv"]) == (1.0, 1.0)
    compared = {
        (row["measure"], row["size_mm"]): (row["recordings"], row["only_second"])
        for row in measures.comparisons("leave_one_out", both, RULES)
    }
    assert compared["detection", measures.ANY] == (3, 1)
    assert compared["detection", 0.0] == (2, 1)
    judged = one(verdicts)
    judged["estimate_mm"] = [0, 0, 1, 1, 2]
    sized = sizing(judged)[measures.ANY]
    assert (sized["exact_rate"], sized["within_rate"]) == (2 / 3, 2 / 3)
    assert sized["mean_absolute_error_mm"] == pytest.approx(1 / 3)
    assert (sized["recordings"], sized["detected"]) == (3, 2)


def test_predictive_values_follow_bayes():
    def predictive(hits, nodules, quiet, healthy, prevalence):
        predicted = [0] * quiet + [1] * (healthy - quiet) + [1] * hits + [0] * (nodules - hits)
        judged = one(rows("one", predicted, [0.0] * healthy + [1.0] * nodules))
        return summary(judged, RULES | {"prevalence": prevalence})[measures.ANY]

    values = predictive(90, 100, 80, 100, 0.1)
    assert values["ppv"] == pytest.approx(0.09 / (0.09 + 0.18))
    assert values["npv"] == pytest.approx(0.72 / (0.72 + 0.01))
    for name in ("ppv", "npv"):
        assert values[f"{name}_low"] < values[name] < values[f"{name}_high"]
    low, _ = ratio_interval(90, 100, 20, 100, 0.95)
    assert values["ppv_low"] == pytest.approx(low / 9 / (1 + low / 9))
    assert np.isnan(predictive(0, 0, 4, 5, 0.1)["ppv"])
    perfect = predictive(20, 20, 20, 20, 0.1)
    assert perfect["ppv"] == 1.0
    assert 0.2 < perfect["ppv_low"] < 0.9


def test_the_interval_of_a_predictive_value_is_over_places():
    rare = RULES | {"prevalence": 0.1}
    sizes, predicted = [0.0] * 20 + [1.0] * 20, [0] * 16 + [1] * 4 + [0] * 4 + [1] * 16
    verdicts = rows("one", predicted, sizes)
    plain = summary(one(verdicts), rare)[measures.ANY]
    sites = [number // 4 for number in range(40)]
    places = summary(one(verdicts, site=sites), rare)[measures.ANY]
    assert (places["clusters"], plain["clusters"]) == (10, 40)
    for name in ("sensitivity", "ppv", "npv"):
        assert places[name] == pytest.approx(plain[name])
        assert places[f"{name}_low"] < plain[f"{name}_low"]
        assert places[f"{name}_high"] > plain[f"{name}_high"]
    two = summary(one(verdicts, site=[n // 10 for n in range(40)]), rare)[measures.ANY]
    assert two["ppv"] == pytest.approx(plain["ppv"]) and np.isnan(two["ppv_low"])


def calibration(probability, nodule, prevalence, bins):
    """Return the rows of the bins."""
    judged = one(rows("one", nodule, np.asarray(nodule, dtype=float), probability=probability))
    rules = RULES | {"prevalence": prevalence, "calibration_bins": bins}
    return list(measures.calibration(judged, rules))[1:]


def test_a_true_probability_is_calibrated_and_a_false_one_is_not():
    numbers = generator(1, "calibration")
    truth = numbers.random(20000)
    nodule = numbers.random(20000) < truth
    share = nodule.mean()
    for row in calibration(truth, nodule, share, 5):
        assert row["observed"] == pytest.approx(row["stated"], abs=0.03)
        assert row["observed_low"] <= row["observed"] <= row["observed_high"]
    equal = np.full(nodule.size, 1 / nodule.size)
    score = measures.brier_score
    assert score(truth, nodule, equal) < score(1 - truth, nodule, equal)


def test_a_few_nodules_in_a_bin_do_not_prove_certainty():
    probability = np.array([0.1] * 20 + [0.9] * 5)
    low, empty, high = calibration(probability, probability > 0.5, 0.1, 3)
    assert (low["observed"], high["observed"]) == (0.0, 1.0)
    assert low["observed_high"] > 0.01 and high["observed_low"] < 0.7
    assert empty["recordings"] == 0 and np.isnan(empty["observed"])


def test_a_bin_with_one_nodule_and_no_healthy_recording():
    probability = np.array([0.3, *[0.05] * 20, *[0.99] * 99])
    nodule = np.array([True, *[False] * 20, *[True] * 99])
    row = calibration(probability, nodule, 0.1, 5)[1]
    assert (row["recordings"], row["observed"], row["observed_high"]) == (1, 1.0, 1.0)
    assert row["observed_low"] < 0.01


def test_the_comparison_of_two_detectors_is_mcnemars():
    first = np.array([True] * 2 + [False] * 10 + [True] * 28)
    second = np.array([False] * 2 + [True] * 10 + [True] * 28)
    # Twice the binomial tail of 2 of 12: (1 + 12 + 66) / 4096.
    assert measures.sign_test(first, second, Units.of_places(np.arange(40))) == pytest.approx(
        2 * 79 / 4096
    )
    assert measures.sign_test(first, first, Units.of_places(np.arange(40))) == 1.0
    assert math.isnan(measures.sign_test(first[:0], first[:0], Units.of_places(np.arange(0))))
    # Ten passes over one place are won once.
    places = np.array([0] * 2 + [1] * 10 + list(range(2, 30)))
    assert measures.sign_test(first, second, Units.of_places(places)) == 1.0


@given(st.integers(0, 200), st.integers(1, 200))
def test_its_probability_is_that_of_the_binomial_test(first, second):
    right = np.repeat([[True, False], [False, True]], [first, second], axis=0).T
    expected = binomtest(first, first + second).pvalue
    found = measures.sign_test(*right, Units.of_places(np.arange(first + second)))
    assert found == pytest.approx(expected, rel=1e-9)


def test_a_recording_without_a_score_enters_no_curve():
    judged = one(rows("one", [0, 1, 0, 1, 2], score=[0, UNKNOWN, 0, 1, 2]))
    assert summary(judged)[measures.ANY]["auc"] == pytest.approx((0.5 + 1 + 1) / 3)
    curve = [row for row in measures.curves(judged, RULES) if row["size_mm"] is measures.ANY]
    assert curve[0]["true_positive_rate"] == pytest.approx(2 / 3)
    assert [row["false_positive_rate"] for row in curve] == [
        twentieth / 20 for twentieth in range(21)
    ]


@pytest.mark.parametrize("size_mm", [0.0, 2.0])
def test_of_one_kind_alone_there_is_no_curve_and_no_area(size_mm):
    judged = one(rows("one", [0, 2], [size_mm] * 2))
    assert np.isnan(summary(judged)[measures.ANY]["auc"])
    assert not list(measures.curves(judged, RULES))


def test_a_nodule_may_lie_where_the_capsule_starts():
    verdicts = rows("one", [0, 0, 1, 1, 2], location_mm=3.0)
    index = index_of(verdicts)
    index["1mm/r2"]["nodule_at_mm"] = 0.0
    (judged,) = of_each(verdicts, index).values()
    first = sizing(judged)[measures.ANY]
    assert (first["located"], first["location_bias_mm"]) == (1, 3.0)


def test_passes_of_one_site_with_different_labels_are_not_merged():
    # Site "p" was passed twice without a nodule, and twice after one was set in.
    sizes, predicted = [0.0, 2.0] * 2 + [0.0] * 6, [0.0, 2.0] * 2 + [1.0] * 2 + [0.0] * 4
    verdicts = rows("diagonal", predicted, sizes)
    sites = ["p"] * 4 + ["q"] * 2 + ["r"] * 2 + ["s"] * 2
    judged = one(verdicts, site=sites)
    found = {
        (row["passes"], row["size_mm"]): (row["sites"], row["detected"])
        for row in measures.retests("leave_one_out", {"diagonal": judged}, RULES)
    }
    # Of the four healthy sites, the passes over "q" have the score 1, the others 0.
    assert found == {
        (1, 0.0): (4, 0.25), (1, 2.0): (1, 1.0), (2, 0.0): (4, 0.25), (2, 2.0): (1, 1.0),
    }  # fmt: skip
    assert not list(measures.retests("leave_one_out", of_each(verdicts), RULES))


def test_the_intervals_of_every_table_are_over_places():
    numbers = generator(1, "all tables")
    sizes = np.repeat([0.0, 1.0, 2.0], 12)
    once = np.where(numbers.random(36) < 0.7, sizes, 0.0)
    both = [
        rows(
            name, predicted, sizes, score=predicted + numbers.normal(size=36),
            probability=np.where(predicted > 0, 0.9, 0.1), location_mm=sizes,
            estimate_mm=np.where(predicted > 0, predicted + numbers.normal(size=36), UNKNOWN),
        )
        for name, predicted in (("template", once), ("diagonal", np.where(sizes > 0, once, once)))
    ]  # fmt: skip
    verdicts = pd.concat(both)
    where = [0.5] * 36
    single = measures.measure_tables(
        verdicts, [0.0, 1.0, 2.0], RULES, index_of(verdicts, nodule_at_mm=where)
    )
    sites = [number // 3 for number in range(36)]
    index = index_of(verdicts, nodule_at_mm=where, site=sites)
    for name, made in measures.measure_tables(verdicts, [0.0, 1.0, 2.0], RULES, index).items():
        if name not in ("roc", "retest", "confusion"):
            for column in made.filter(like="clusters"):
                assert (made[column] < single[name][column]).all(), (name, column)


def test_a_rate_of_the_summary_is_the_rate_over_its_clusters():
    verdicts = rows("one", [0, 1, 0, 1, 2])
    of_scheme = of_each(verdicts, index_of(verdicts, site=["a", "a", "b", "c", "d"]))
    row = next(iter(measures.summary("leave_one_out", of_scheme, RULES)))
    right, places = np.array([True, False, False, True, True]), np.array([0, 0, 1, 2, 3])
    expected = rate_of(right, Units.of_places(places), 0.95)
    assert [row[f"accuracy{end}"] for end in ("", "_low", "_high")] == list(expected)


@pytest.mark.parametrize("bins", [1, 4, 5])
def test_a_bin_holds_its_lower_edge_and_the_last_one_holds_certainty(bins):
    edges = np.arange(bins + 1) / bins
    made = calibration(edges, edges > 0.4, 0.3, bins)
    assert [row["stated_low"] for row in made] == pytest.approx(edges[:-1])
    assert [row["stated_high"] for row in made] == pytest.approx(edges[1:])
    # One edge lies in each bin, and two in the last.
    assert [row["recordings"] for row in made] == [1] * (bins - 1) + [2]
    assert [row["clusters"] for row in made] == [1] * (bins - 1) + [2]
    for row, edge in zip(made[:-1], edges, strict=False):
        assert row["stated"] == pytest.approx(edge)


def test_the_stated_probability_of_a_bin_is_weighted_to_the_prevalence():
    probability, nodule = np.array([0.1, 0.3, 0.3, 0.4]), np.array([False, False, False, True])
    # Of three healthy recordings and one nodule, each counts 0.8 / 3 and 0.2.
    (row,) = calibration(probability, nodule, 0.2, 1)
    assert row["stated"] == pytest.approx(0.8 / 3 * (0.1 + 0.3 + 0.3) + 0.2 * 0.4)
    assert row["observed"] == pytest.approx(0.2)


def test_the_interval_of_a_balanced_accuracy_is_that_of_zou_and_donner():
    predicted = [0] * 7 + [1] * 3 + [1] * 8 + [0] * 4
    verdicts = rows("one", predicted, [0.0] * 10 + [1.0] * 12)
    row = next(iter(measures.summary("leave_one_out", of_each(verdicts), RULES)))
    value = (7 / 10 + 8 / 12) / 2
    _, *healthy = rate_of(np.arange(10) < 7, None, 0.95)
    _, *nodules = rate_of(np.arange(12) < 8, None, 0.95)
    reach = [
        math.sqrt((7 / 10 - healthy[end]) ** 2 + (8 / 12 - nodules[end]) ** 2) / 2 for end in (0, 1)
    ]
    assert row["balanced_accuracy"] == pytest.approx(value)
    assert row["balanced_accuracy_low"] == pytest.approx(value - reach[0])
    assert row["balanced_accuracy_high"] == pytest.approx(value + reach[1])


def test_an_error_and_a_rate_do_not_reach_below_0_or_above_1():
    verdicts = rows("one", [0, 0, 1, 1, 5])
    row = next(iter(measures.summary("leave_one_out", of_each(verdicts), RULES)))
    assert row["balanced_accuracy"] == row["balanced_accuracy_high"] == 1.0
    row = sizing(one(verdicts))[measures.ANY]
    assert row["mean_absolute_error_mm"] == pytest.approx(1.0)
    assert row["mean_absolute_error_mm_low"] == 0.0
    assert (row["exact_rate"], row["within_rate"]) == (2 / 3, 2 / 3)


def test_only_recordings_with_a_verdict_and_a_score_are_ordered():
    scores = [0.0, 3.0, 1.0, UNKNOWN, 2.0]
    verdicts = rows("one", [0, UNKNOWN, 1, 1, 2], score=scores)
    area = {size_mm: row["auc"] for size_mm, row in summary(one(verdicts)).items()}
    # The healthy recording with 3 has no verdict, so both nodules lie above what is left.
    assert area == {measures.ANY: 1.0, 1.0: 1.0, 2.0: 1.0}


def test_an_error_of_size_is_signed_and_counts_what_was_found():
    estimates = [UNKNOWN, UNKNOWN, 0.5, 2.5, UNKNOWN]
    made = sizing(one(rows("one", [0, 0, 1, 1, 0], estimate_mm=estimates)))
    assert made[1.0]["bias_mm"] == pytest.approx(0.5)
    assert made[1.0]["absolute_error_mm"] == pytest.approx(1.0)
    whole = made[measures.ANY]
    assert (whole["recordings"], whole["detected"], whole["detected_clusters"]) == (3, 2, 2)
    assert whole["bias_mm"] == made[1.0]["bias_mm"] and np.isnan(made[2.0]["bias_mm"])


def test_a_location_counts_where_it_and_the_truth_are_known_and_a_nodule_was_found():
    verdicts = rows("one", [1, 0, 1, 1, 2], location_mm=[9.0, 5.0, 5.0, 8.0, UNKNOWN])
    judged = one(verdicts, nodule_at_mm=["", "", "7", "7", "7"])
    made = sizing(judged)
    assert [made[size]["located"] for size in (measures.ANY, 1.0, 2.0)] == [2, 2, 0]
    assert made[1.0]["location_error_mm"] == pytest.approx(1.5)
    assert made[1.0]["location_bias_mm"] == pytest.approx(-0.5)


def test_what_only_one_of_two_detectors_judges_rightly_is_counted():
    # Of the nodules, the first finds three and the second two, of which one is new.
    sizes = [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    both = [rows("one", [0, 1, 1, 1, 1, 0, 0], sizes), rows("other", [1, 0, 1, 0, 0, 1, 0], sizes)]
    made = {
        (row["measure"], row["size_mm"]): (row["only_first"], row["only_second"])
        for row in measures.comparisons("leave_one_out", of_each(pd.concat(both)), RULES)
    }
    assert made["detection", measures.ANY] == (2, 1)
    assert made["detection", 0.0] == (1, 1)
    assert made["size_within_tolerance", 1.0] == (2, 1)


def test_the_row_of_all_probabilities_compares_the_detector_with_the_prevalence_alone():
    # The recording without a verdict has no probability that counts.
    stated = [0.1, 0.5, 0.9, 0.6, 0.8]
    verdicts = rows("one", [0, UNKNOWN, 1, 1, 2], probability=stated)
    row, *bins = measures.calibration(one(verdicts), RULES | {"prevalence": 0.2})
    expected = 0.8 * 0.1**2 + 0.2 * (0.1**2 + 0.4**2 + 0.2**2) / 3
    assert row["recordings"] == 4
    assert row["brier"] == pytest.approx(expected)
    assert row["brier_uninformed"] == pytest.approx(0.8 * 0.2**2 + 0.2 * 0.8**2)
    assert row["stated"] == pytest.approx(0.8 * 0.1 + 0.2 * (0.9 + 0.6 + 0.8) / 3)
    assert row["observed"] == pytest.approx(0.2) and np.isnan(row["stated_low"])
    assert all("brier" not in each for each in bins)


def test_verdicts_stand_by_detector_then_by_name_then_as_they_were_made():
    keys = [
        (detector, name, scheme)
        for detector in ("template", "diagonal")
        for name in ("2mm/r10", "0mm/b", "2mm/r9")
        for scheme in ("resubstitution", "leave_one_out")
    ]
    made = measures.by_name(pd.DataFrame(keys, columns=["detector", "recording", "scheme"]))
    assert [tuple(row) for row in made.values] == [
        (detector, name, scheme)
        for detector in ("template", "diagonal")
        for name in ("0mm/b", "2mm/r9", "2mm/r10")
        for scheme in ("resubstitution", "leave_one_out")
    ]
