"""Every interval contains the value that it belongs to, for any counts."""

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from capsule.evaluation import intervals, measures
from capsule.evaluation.intervals import (
    Units,
    gain_interval,
    lower_bound,
    mean_interval,
    median_interval,
    rate,
    rate_of,
    ratio_interval,
)
from capsule.evaluation.rates import of_each, sizing
from capsule.seeding import generator

pytestmark = pytest.mark.takes(0.2)

LEVEL = st.sampled_from([0.5, 0.68, 0.9, 0.95, 0.999])
RULES = {"tolerance_mm": 1.0, "specificity": 0.95, "prevalence": 0.1, "sizes_mm": [0.0, 1.0]}
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


def judged(size_mm, predicted_mm, probability=np.nan):
    """Make the verdicts of one detector, each recording a place of its own."""
    verdicts = pd.DataFrame({"size_mm": size_mm, "predicted_mm": predicted_mm})
    verdicts = verdicts.assign(detector="template", scheme="leave_one_out")
    verdicts = verdicts.assign(score=verdicts["predicted_mm"].astype(float), threshold=0.0)
    ((_, rows),) = of_each(verdicts.assign(probability=probability), 1.0)
    return rows


def of_counts(detected, quiet):
    """Make verdicts with these counts of found nodules, and of quiet healthy recordings."""
    counts = [detected[0], detected[1] - detected[0], quiet[1] - quiet[0], quiet[0]]
    return judged(np.repeat([1.0, 1, 0, 0], counts), np.repeat([1.0, 0, 1, 0], counts))


@settings(deadline=None, max_examples=25)
@given(COUNTS, COUNTS, st.floats(0.001, 0.999), LEVEL)
def test_of_predictive_values(detected, quiet, prevalence, level):
    rules = RULES | {"prevalence": prevalence, "confidence": level}
    of_scheme = {"one": of_counts(detected, quiet)}
    values = next(measures.summary("leave_one_out", of_scheme, rules))
    for name in ("ppv", "npv"):
        ends = values[f"{name}_low"], values[f"{name}_high"]
        assert holds(values[name], *ends)
        assert math.isnan(ends[0]) or 0 <= ends[0] <= ends[1] <= 1


@settings(deadline=None, max_examples=25)
@given(st.lists(st.tuples(st.floats(0, 1), st.booleans()), min_size=1, max_size=40), LEVEL)
def test_of_a_bin_of_the_calibration(stated, level):
    probability, nodule = (np.array(each) for each in zip(*stated, strict=True))
    rows = judged(nodule.astype(float), nodule.astype(float), probability)
    rules = {"prevalence": 0.1, "calibration_bins": 5, "confidence": level}
    for row in measures.calibration(rows, rules):
        assert holds(row["observed"], row["observed_low"], row["observed_high"])


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=1, max_size=30), LEVEL)
def test_of_a_gain(shares, level):
    before, after = np.array(shares).T
    assert holds(*gain_interval(before, after, level))


CLUSTERED = st.lists(
    st.tuples(st.sampled_from([0.0, 0.25, 1.0]), st.integers(0, 6)), min_size=1, max_size=40
)


@settings(deadline=None)
@given(CLUSTERED, LEVEL)
def test_of_anything_over_clusters(values, level):
    shares, clusters = (np.array(each) for each in zip(*values, strict=True))
    units = Units.of_places(clusters.astype(int))
    for interval in (
        rate_of(shares, units, level),
        gain_interval(0 * shares, shares, level, units),
        mean_interval(shares, level, units),
        median_interval(shares, level, units),
    ):
        value, low, high = interval
        assert math.isnan(low) == math.isnan(high)
        assert math.isnan(low) or low <= value <= high
    bound = lower_bound(shares, units)
    assert math.isnan(bound) or 0 <= bound <= np.average(shares, weights=units.weights)


SCORES = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 4)), min_size=1, max_size=12)


@given(SCORES, SCORES, st.booleans(), LEVEL)
def test_of_the_area_under_a_curve(healthy, nodule, clustered, level):
    (healthy, one), (nodule, other) = (np.array(each).T for each in (healthy, nodule))
    units = [Units.of_places(each) for each in (one, other)] if clustered else []
    area, low, high = intervals.auc_interval(healthy, nodule, level, *units)
    weights = tuple(each.weights for each in units) if clustered else None
    assert area == intervals.auc(healthy, nodule, weights)
    assert math.isnan(low) == math.isnan(high)
    assert math.isnan(low) or 0 <= low <= area <= high <= 1
    if not clustered:
        assert low < high


@settings(deadline=None, max_examples=25)
@given(COUNTS, COUNTS, LEVEL)
def test_of_a_balanced_accuracy(first, second, level):
    rows, rules = of_counts(first, second), RULES | {"confidence": level}
    row = next(measures.summary("leave_one_out", {"one": rows}, rules)) | next(sizing(rows, rules))
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


def test_intervals_of_ratios_hold_the_truth_as_often_as_they_say():
    numbers, inside = generator(1, "predictive coverage"), 0
    for _ in range(2000):
        hits, alarms = numbers.binomial(100, 0.9), numbers.binomial(20, 0.1)
        low, high = ratio_interval(hits, 100, alarms, 20, 0.95)
        inside += low <= 9 <= high
    assert 0.93 <= inside / 2000 <= 0.98
