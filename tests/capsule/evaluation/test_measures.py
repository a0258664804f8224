"""The tables that rate the detectors, from verdicts that can be counted by hand."""

import math
from itertools import product

import numpy as np
import pandas as pd
import pytest
from sklearn.calibration import calibration_curve
from sklearn.metrics import brier_score_loss

from capsule.evaluation import measures, rates
from capsule.evaluation.columns import COLUMNS, RATES
from capsule.evaluation.files import read_table
from capsule.evaluation.intervals import Units, effective_count, rate, rate_of, ratio_interval
from capsule.evaluation.rates import ANY
from capsule.store.files import write_csv
from support.verdicts import index_of, verdicts

UNKNOWN, SIZES_MM = float("nan"), [0.0, 1.0, 2.0]
RULES = {"confidence": 0.95, "tolerance_mm": 1.0, "prevalence": 0.5, "specificity": 0.5}
RULES |= {"calibration_bins": 2, "passes": [1, 2], "sizes_mm": SIZES_MM}
SIZES = (0.0, 0.0, 1.0, 1.0, 2.0)


def of(predicted, sizes=SIZES, **columns):
    return verdicts(zip(sizes, predicted, strict=True), **columns)


def one(made, **columns):
    """Return the judged recordings of the only detector."""
    ((_, judged),) = rates.of_each(made, RULES["tolerance_mm"], index_of(made, **columns))
    return judged


def each_of(*made):
    together = pd.concat(made)
    return {key["detector"]: rows for key, rows in rates.of_each(together, 1.0)}


def summary(judged, rules=RULES):
    """Return the rows of one detector by size, without those of the baseline."""
    *made, _ = measures.summary("leave_one_out", {"one": judged}, rules)
    return {row["size_mm"]: row for row in made}


def sizing(judged, **rules):
    return {row["size_mm"]: row for row in rates.sizing(judged, RULES | rules)}


def ends_of(row, name):
    return [row[f"{name}{end}"] for end in ("", "_low", "_high")]


# All tables.


def test_every_table_is_made_of_each_detector_and_scheme_with_intervals_over_places():
    sizes, numbers = np.repeat(SIZES_MM, 12), np.random.default_rng(1)
    predicted = np.where(numbers.random(36) < 0.7, sizes, 0.0)
    columns = {"score": predicted + numbers.normal(size=36), "location_mm": sizes}
    columns["probability"] = np.where(predicted > 0, 0.9, 0.1)
    columns["estimate_mm"] = np.where(predicted > 0, columns["score"], UNKNOWN)
    each = product(["template", "diagonal"], ["leave_one_out", "held_out"])
    made = pd.concat(of(predicted, sizes, detector=d, scheme=s, **columns) for d, s in each)
    sites = range(36), [number // 3 for number in range(36)]
    indices = (index_of(made, nodule_at_mm=[0.5] * 36, site=each) for each in sites)
    single, found = (measures.measure_tables(made, SIZES_MM, RULES, each) for each in indices)
    assert list(found) == list(COLUMNS)
    for name, table in found.items():
        assert set(COLUMNS[name]) <= set(table.columns), name
        assert name not in RATES or list(table.columns) == RATES[name]
        # The gain of several passes is shown once.
        schemes = {"leave_one_out"} | ({"held_out"} if name != "retest" else set())
        assert set(table["scheme"]) == schemes, name
        for column in table.filter(like="clusters"):
            assert (table[column] < single[name][column]).all(), (name, column)
    assert set(found["retest"]["passes"]) == {1, 2}
    for made in (of([], []), of([UNKNOWN] * 5)):
        found = measures.measure_tables(made, SIZES_MM, RULES, index_of(made))
        assert all(table.empty for table in found.values())
        assert {name: list(table) for name, table in found.items()} == COLUMNS


@pytest.mark.parametrize("turn", [1, -1])
def test_tables_keep_the_order_of_detectors_schemes_and_names(turn):
    order = ["held_out", "leave_one_out", "leave_one_session_out", "resubstitution"]
    made = pd.concat(of([0], [0], detector=d, scheme=s) for d in "ba" for s in order[::turn])
    keys = [tuple(key.values()) for key, _ in rates.of_each(made, 1.0)]
    assert keys == [*product("ba", order)]
    # Verdicts stand by detector, then by name, then as they were made.
    names, schemes = ["0mm/b", "2mm/r9", "2mm/r10"], ["resubstitution", "leave_one_out"]
    columns = ["detector", "recording", "scheme"]
    made = measures.by_name(pd.DataFrame(product("ba", names[::turn], schemes), columns=columns))
    assert [tuple(row) for row in made.values] == [*product("ba", names, schemes)]


def test_no_verdict_is_a_failure_in_every_rate_but_the_precision():
    silent = of([0, UNKNOWN, 1, UNKNOWN, 2], estimate_mm=[0, 0, 1, 1, 2])
    both = each_of(silent, of([0, 0, 1, 1, 2], detector="other"))
    row = next(measures.summary("leave_one_out", both, RULES))
    # It is neither a positive nor a negative one: none of the given verdicts was wrong.
    names = ("recordings", "accuracy", "sensitivity", "specificity", "ppv", "npv")
    assert [row[name] for name in names] == [5, 3 / 5, 2 / 3, 1 / 2, 1, 1]
    of_any, of_none, *_ = measures.comparisons("leave_one_out", both, RULES)
    assert (of_any["recordings"], of_any["difference"]) == (3, 1 / 3)
    assert (of_none["recordings"], of_none["difference"]) == (2, 1 / 2)
    sized = sizing(both["one"])[ANY]
    names = ("exact_rate", "within_rate", "mean_absolute_error_mm", "recordings", "detected")
    assert [sized[name] for name in names] == pytest.approx([2 / 3, 2 / 3, 1 / 3, 3, 2])
    judged, rules = one(of([0, UNKNOWN, 1] * 2, [0] * 3 + [1] * 3)), RULES | {"sizes_mm": [0, 1]}
    names = ("tp", "fp", "fn", "recall", "precision")
    for row in rates.detection(judged, rules):
        assert [row[name] for name in names] == [1, 1, 2, 1 / 3, 1 / 2]
    counts = [(row["predicted_mm"], row["count"]) for row in rates.confusion(judged, rules)]
    np.testing.assert_equal(counts, [(0, 1), (1, 1), (UNKNOWN, 1)] * 2)
    assert judged["right"].tolist() == [True, False, False, False, False, True]


def test_clusters_are_set_ups_where_there_are_enough_and_the_scheme_may_leave_them_out():
    for scheme, setups, unit in (
        ("leave_one_session_out", "aabbcc", "setup"),
        ("leave_one_out", "aabbcc", "place"),
        ("resubstitution", "aabbcc", "place"),
        ("held_out", "aabbbb", "place"),
        ("held_out", ["a", "a", "b", "b", "c", ""], "place"),
    ):
        judged = one(of([0] * 6, [0] * 6, scheme=scheme), setup=setups)
        assert rates.cluster_unit(judged) == unit
        # Of two kinds of recordings, both need set-ups of their own.
        assert rates.cluster_unit(judged, judged[:2]) == "place"


def test_a_rate_is_that_over_the_places_and_near_copies_are_one_place():
    pairs = [(0.0, 0.0)] * 6 + [(0.0, 1.0)] * 2
    # Kills: a weight that grows with the passes over a place.
    judged = one(verdicts(pairs), site="aaabccdd")
    right, places = np.arange(8) < 6, Units.of_places(np.array([0, 0, 0, 1, 2, 2, 3, 3]))
    row, *_ = rates.detection(judged, RULES)
    expected = [*rate_of(right, places, 0.95)]
    assert ends_of(row, "recall") == ends_of(summary(judged)[ANY], "accuracy") == expected
    assert (row["recall_at_least"], row["clusters"]) == (rate_of(right, places, 0.9)[1], 4)
    copies = one(verdicts(pairs), near_copies=["0mm/r1", *[""] * 7])
    assert next(rates.detection(copies, RULES))["clusters"] == 7


def test_what_people_wrote_stays_as_they_wrote_it(tmp_path):
    path = tmp_path / "sites.csv"
    sites = [("01", 1.5), ("NA", None), ("nan", UNKNOWN), ("1e3", -1.0), (None, -1.0)]
    names, usual = ["site", "score", "recordings", "detected"], [2, True]
    write_csv(path, names, [dict(zip(names, [*each, *usual], strict=True)) for each in sites])
    read = read_table(path)
    assert read["site"].fillna("no site").tolist() == ["01", "NA", "nan", "1e3", "no site"]
    np.testing.assert_array_equal(read["score"], [1.5, np.nan, np.nan, -1.0, -1.0])
    assert [read[name].dtype.kind for name in names[2:]] == ["i", "b"]


# Summary.


def test_the_summary_compares_balanced_accuracies_by_zou_and_donner_with_always_nodule():
    both = of([0] * 7 + [1] * 11 + [0] * 4, [0.0] * 10 + [1.0] * 12), of([0, 2], [0.0, 2.0])
    judged = each_of(both[0], both[1].assign(detector="other"))
    one, _, other, _, always = measures.summary("leave_one_out", judged, RULES)
    shares = np.array([rate(7, 10, 0.95), rate(8, 12, 0.95)])
    reach = np.hypot(*(shares[:, :1] - shares[:, 1:])) / 2
    expected = shares[:, 0].mean() + np.array([0, -reach[0], reach[1]])
    assert ends_of(one, "balanced_accuracy") == pytest.approx(expected)
    assert other["balanced_accuracy"] == other["balanced_accuracy_high"] == 1.0
    names = ("detector", "sensitivity", "balanced_accuracy")
    assert [always[name] for name in names] == ["always_nodule", 1.0, 0.5]


@pytest.mark.parametrize("hits, quiet", [(90, 80), (100, 100), (0, 80), (60, 0)])
@pytest.mark.parametrize("passes", [1, 4])
def test_predictive_values_follow_bayes_with_the_interval_of_a_ratio(hits, quiet, passes):
    predicted = [0] * quiet + [1] * (100 - quiet) + [1] * hits + [0] * (100 - hits)
    made = of(predicted, [0.0] * 100 + [1.0] * 100)
    judged = one(made, site=[n // passes for n in range(200)])
    row = summary(judged, RULES | {"prevalence": 0.1})[ANY]
    turn, units = np.arange(100), Units.of_places(np.arange(100) // passes)
    of_both = ("ppv", hits, 100 - quiet, 1 / 9), ("npv", quiet, 100 - hits, 9)
    for name, right, wrong, odds in of_both:
        value, low, high = ends_of(row, name)
        if right + wrong == 0:
            assert math.isnan(value)
            continue
        # What the recordings of these places are worth.
        worth = [effective_count(turn < each, units, 0.95) for each in (right, wrong)]
        counts = right * worth[0] / 100, worth[0], wrong * worth[1] / 100, worth[1]
        least, most = (each * odds for each in ratio_interval(*counts, 0.95))
        expected = right * odds / (right * odds + wrong), least / (1 + least), 1 / (1 + 1 / most)
        assert (value, low, high) == pytest.approx(expected) and low <= value <= high


def test_only_recordings_with_a_verdict_and_a_score_are_ordered():
    # The healthy recording with 3 has no verdict, so the nodules lie above what is left.
    judged = one(of([0, UNKNOWN, 1, 1, 2], score=[0.0, 3.0, 1.0, UNKNOWN, 2.0]))
    assert [row["auc"] for row in summary(judged).values()] == [1.0] * 3
    judged = one(of([0, 1, 0, 1, 2], score=[0, UNKNOWN, 0, 1, 2]))
    assert summary(judged)[ANY]["auc"] == pytest.approx((0.5 + 1 + 1) / 3)
    curve = [row for row in measures.curves(judged, RULES) if row["size_mm"] is ANY]
    assert curve[0]["true_positive_rate"] == pytest.approx(2 / 3)
    assert [row["false_positive_rate"] for row in curve] == [n / 20 for n in range(21)]
    for size_mm in (0.0, 2.0):
        alone = one(of([0, 2], [size_mm] * 2))
        assert np.isnan(summary(alone)[ANY]["auc"])
        assert not list(measures.curves(alone, RULES))


# Sizes and locations.


def test_errors_are_signed_and_count_what_was_found_and_is_known():
    # A size is within the tolerance if a nodule is found.
    rows = [(1.0, 0.0, 1.0, 0), (1.0, 2.0, 1.0, 1), (2.5, 2.3, 0.2, 1), (2.0, 4.0, 1.0, 0)]
    for true, predicted, tolerance_mm, within in rows:
        made = sizing(one(verdicts([(true, predicted)])), tolerance_mm=tolerance_mm)[true]
        # A missed nodule counts as 0 mm.
        found = made["within"], made["exact"], made["mean_absolute_error_mm"]
        assert found == pytest.approx((within, 0, abs(true - predicted)))
    estimates, where = [UNKNOWN, UNKNOWN, 0.5, 2.5, UNKNOWN], [9.0, 5.0, 5.0, 8.0, 5.0]
    made = of([1, 0, 1, 1, 0], estimate_mm=estimates, location_mm=where)
    found = sizing(one(made, nodule_at_mm=["", "", "7", "7", "7"]))
    names = ["bias_mm", "absolute_error_mm", "location_error_mm", "location_bias_mm", "recordings"]
    names += ["detected", "detected_clusters", "located", "located_clusters"]
    expected = [0.5, 1.0, 1.5, -0.5, 3, 2, 2, 2, 2]
    assert [found[ANY][name] for name in names] == pytest.approx(expected)
    assert found[2.0]["located"] == 0 and np.isnan(found[2.0]["bias_mm"])
    # A nodule may lie where the capsule starts; no mean of absolute errors reaches below 0.
    far = made.assign(predicted_mm=[0, 0, 1, 1, 5])
    found = sizing(one(far, nodule_at_mm=["", "", "0", "", ""]))
    assert (found[ANY]["located"], found[ANY]["location_bias_mm"]) == (1, 5.0)
    assert ends_of(found[ANY], "mean_absolute_error_mm")[:2] == [pytest.approx(1.0), 0.0]


# Calibration.


def calibration(probability, nodule, **rules):
    """Return the row of all recordings, and those of the bins."""
    made = of(nodule, np.asarray(nodule, dtype=float), probability=probability)
    return list(measures.calibration(one(made), RULES | rules))


@pytest.mark.parametrize("seed", range(3))
def test_calibration_and_brier_score_are_those_of_scikit_learn(seed):
    numbers = np.random.default_rng(seed)
    nodule, chance = numbers.random(60) < 0.6, numbers.random(60)
    whole, *made = calibration(chance, nodule, prevalence=nodule.mean(), calibration_bins=5)
    rows = [(row["observed"], row["stated"]) for row in made if row["recordings"]]
    np.testing.assert_allclose(np.transpose(rows), calibration_curve(nodule, chance, n_bins=5))
    assert whole["brier"] == pytest.approx(brier_score_loss(nodule, chance))
    weights = measures.prevalence_weights(nodule, 0.1, np.ones(60))
    expected = brier_score_loss(nodule, chance, sample_weight=weights)
    assert calibration(chance, nodule, prevalence=0.1)[0]["brier"] == pytest.approx(expected)


def test_the_row_of_all_compares_with_the_prevalence_alone_and_a_few_nodules_prove_no_certainty():
    # The recording without a verdict has no probability that counts.
    made = of([0, UNKNOWN, 1, 1, 2], probability=[0.1, 0.5, 0.9, 0.6, 0.8])
    row, *bins = measures.calibration(one(made), RULES | {"prevalence": 0.2})
    stated, uninformed = 0.8 * 0.1 + 0.2 * (0.9 + 0.6 + 0.8) / 3, 0.8 * 0.2**2 + 0.2 * 0.8**2
    found = [row[name] for name in ("recordings", "observed", "stated", "brier_uninformed")]
    assert found == pytest.approx([4, 0.2, stated, uninformed])
    assert np.isnan(row["stated_low"]) and all("brier" not in each for each in bins)
    # A bin holds its lower edge.
    edges = np.arange(6) / 5
    made = pd.DataFrame(calibration(edges, edges > 0.4, prevalence=0.3, calibration_bins=5)[1:])
    np.testing.assert_allclose(made[["stated_low", "stated_high"]].T, [edges[:-1], edges[1:]])
    # One edge lies in each bin, and two in the last.
    assert made["recordings"].tolist() == made["clusters"].tolist() == [1] * 4 + [2]
    assert made["stated"].tolist()[:-1] == pytest.approx(edges[:-2])
    sure = np.array([0.1] * 20 + [0.9] * 5)
    _, low, empty, high = calibration(sure, sure > 0.5, prevalence=0.1, calibration_bins=3)
    found = [each[name] for each in (low, empty, high) for name in ("recordings", "observed")]
    assert found == pytest.approx([20, 0.0, 0, UNKNOWN, 5, 1.0], nan_ok=True)
    assert low["observed_high"] > 0.01 and high["observed_low"] < 0.7


# Comparison and retest.


def test_two_detectors_are_compared_on_the_same_recordings():
    # Of the nodules, the first finds three and the second two, of which one is new.
    sizes = [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    both = of([0, 1, 1, 1, 1, 0, 0], sizes), of([1, 0, 1, 0, 0, 1, 0], sizes, detector="other")
    rows = measures.comparisons("leave_one_out", each_of(*both), RULES)
    made = {(row["measure"], row["size_mm"]): (row["difference"], row["mcnemar_p"]) for row in rows}
    assert made["detection", ANY] == made["size_within_tolerance", 1.0] == pytest.approx((-0.2, 1))
    assert made["detection", 0.0] == (0.0, 1.0)
    assert ("size_within_tolerance", 0.0) not in made


def test_passes_of_one_site_with_different_labels_are_not_merged():
    # Site "p" was passed twice without a nodule, and twice after one was set in.
    sizes, predicted = [0.0, 2.0] * 2 + [0.0] * 6, [0.0, 2.0] * 2 + [1.0] * 2 + [0.0] * 4
    made = of(predicted, sizes, detector="diagonal")
    rows = measures.retests("leave_one_out", {"diagonal": one(made, site="ppppqqrrss")}, RULES)
    found = [[row[name] for name in ("passes", "size_mm", "sites", "detected")] for row in rows]
    # Of the four healthy sites, the passes over "q" have the score 1, the others 0.
    assert found == [[n, *each] for n in (1, 2) for each in ((0.0, 4, 0.25), (2.0, 1, 1.0))]
    assert not list(measures.retests("leave_one_out", each_of(made), RULES))
