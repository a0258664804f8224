"""Every interval contains the value that it belongs to, for any counts."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from capsule.evaluation import learning, roc, tables
from capsule.evaluation.agreement import paired_difference
from capsule.evaluation.prevalence import predictive_values
from capsule.evaluation.rates import rate
from capsule.evaluation.ratio import ratio_interval
from capsule.evaluation.reliability import calibration_table
from capsule.evaluation.size_error import mean_interval, median_interval
from capsule.seeding import generator

pytestmark = pytest.mark.slow(0.2)

LEVEL = st.sampled_from([0.5, 0.68, 0.9, 0.95, 0.999])
COUNTS = st.integers(1, 60).flatmap(lambda of: st.tuples(st.integers(0, of), st.just(of)))


def holds(value, low, high):
    """Return whether an interval holds its value; an unknown value has unknown ends."""
    if math.isnan(value):
        return math.isnan(low) and math.isnan(high)
    return low <= value <= high


@given(COUNTS, LEVEL)
def test_of_a_rate(counts, level):
    assert holds(*rate(*counts, level))


@given(st.floats(0, 20), LEVEL)
def test_of_a_rate_of_means(hits, level):
    assert holds(*rate(hits, 20, level))


@given(COUNTS, COUNTS, st.floats(0.001, 0.999), LEVEL)
def test_of_predictive_values(detected, quiet, prevalence, level):
    values = predictive_values(*detected, *quiet, prevalence, level)
    for name in ("ppv", "npv"):
        ends = values[f"{name}_low"], values[f"{name}_high"]
        assert holds(values[name], *ends)
        assert math.isnan(ends[0]) or 0 <= ends[0] <= ends[1] <= 1


@given(st.lists(st.tuples(st.floats(0, 1), st.booleans()), min_size=1, max_size=40), LEVEL)
def test_of_a_bin_of_the_calibration(stated, level):
    probability, nodule = (np.array(each) for each in zip(*stated, strict=True))
    for row in calibration_table(probability, nodule, 0.1, 5, level):
        assert holds(row["observed"], row["observed_low"], row["observed_high"])


def test_of_a_bin_with_one_nodule_and_no_healthy_recording():
    probability = np.array([0.3, *[0.05] * 20, *[0.99] * 99])
    nodule = np.array([True, *[False] * 20, *[True] * 99])
    row = calibration_table(probability, nodule, 0.1, 5, 0.95)[1]
    assert (row["recordings"], row["observed"], row["observed_high"]) == (1, 1.0, 1.0)
    assert row["observed_low"] < 0.01


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=60), LEVEL)
def test_of_a_difference_of_two_detectors(right, level):
    row = paired_difference(*np.array(right).T, level)
    assert holds(row["difference"], row["difference_low"], row["difference_high"])


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=1, max_size=30), LEVEL)
def test_of_a_gain(shares, level):
    before, after = np.array(shares).T
    assert holds(*learning.mean_gain(before, after, level))


@given(
    st.lists(st.integers(0, 5), min_size=1, max_size=12).map(np.array),
    st.lists(st.integers(0, 9), min_size=1, max_size=12).map(np.array),
    LEVEL,
)
def test_of_a_curve_and_the_area_under_it(healthy, nodule, level):
    grid = np.linspace(0, 1, 5)
    area, low, high = roc.bootstrap(healthy, nodule, grid, generator(1, "hold"), 20, level)
    assert holds(roc.auc(healthy, nodule), *area)
    height = roc.height_at(healthy, nodule, grid)
    assert np.all((low <= height) & (height <= high))


@given(COUNTS, COUNTS, LEVEL)
def test_of_a_balanced_accuracy(first, second, level):
    verdicts = np.repeat([1.0, 0.0, 1.0, 0.0], [first[0], first[1] - first[0], second[1] - second[0], second[0]])  # fmt: skip  # noqa: E501
    truth = np.repeat([1.0, 0.0], [first[1], second[1]])
    unknown = np.full(truth.size, np.nan)
    names = tuple(map(str, range(truth.size)))
    key = {"detector": "template", "scheme": "leave_one_out"}
    each = tables.Verdicts(key, names, truth, verdicts, *[unknown] * 4)
    row = tables.summary([each], 1.0, level)[0]
    for name in ("accuracy", "sensitivity", "specificity", "balanced_accuracy", "within_rate"):
        assert holds(row[name], row[f"{name}_low"], row[f"{name}_high"])


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=40).map(np.array), LEVEL)
def test_of_a_mean_and_a_median(values, level):
    assert holds(*mean_interval(values, level))
    median, low, high = median_interval(values, level)
    assert math.isnan(low) or low <= median <= high


@pytest.mark.parametrize("counts", [(3, 20, 7, 15), (20, 20, 1, 20), (0, 9, 3, 8), (5, 6, 0, 7)])
def test_the_ends_of_a_ratio_are_where_a_literal_score_test_turns(counts):
    hits, count, other_hits, other_count = counts

    def statistic(ratio):
        """Return the test of the ratio by the literal formula, with the likelihood searched."""

        def unlikelihood(other):
            terms = [(hits, ratio * other), (count - hits, 1 - ratio * other)]
            terms += [(other_hits, other), (other_count - other_hits, 1 - other)]
            return -sum(number * math.log(share) for number, share in terms if number)

        bounds = (1e-12, min(1.0, 1 / ratio) - 1e-12)
        options = {"xatol": 1e-13}
        other = minimize_scalar(unlikelihood, bounds=bounds, method="bounded", options=options).x
        first = ratio * other
        spread = first * (1 - first) / count + ratio**2 * other * (1 - other) / other_count
        return (hits / count - ratio * other_hits / other_count) / math.sqrt(spread)

    low, high = ratio_interval(*counts, 0.95)
    if low > 0:
        assert statistic(low) == pytest.approx(1.959964, abs=2e-3)
    if high < math.inf:
        assert statistic(high) == pytest.approx(-1.959964, abs=2e-3)
    assert (low == 0, high == math.inf) == (hits == 0, other_hits == 0)


def test_predictive_intervals_hold_the_truth_as_often_as_they_say():
    numbers, inside = generator(1, "predictive coverage"), 0
    for _ in range(2000):
        hits, alarms = numbers.binomial(100, 0.9), numbers.binomial(20, 0.1)
        values = predictive_values(hits, 100, 20 - alarms, 20, 0.1, 0.95)
        inside += values["ppv_low"] <= 0.5 <= values["ppv_high"]
    assert 0.93 <= inside / 2000 <= 0.98
