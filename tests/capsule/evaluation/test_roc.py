"""The ROC curve, and the area under it with an interval that does not collapse."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from capsule.evaluation import roc
from capsule.seeding import generator

SCORES = st.lists(st.integers(0, 9), min_size=1, max_size=12).map(np.array)


@given(SCORES, SCORES)
def test_the_area_counts_the_pairs_in_the_right_order(healthy, nodule):
    pairs = [(n > h) + 0.5 * (n == h) for n in nodule for h in healthy]
    assert roc.auc(healthy, nodule) == pytest.approx(np.mean(pairs))


@given(SCORES, SCORES)
def test_the_area_is_the_area_under_the_curve(healthy, nodule):
    # With single scores on each side, the curve is a staircase of whole steps.
    healthy, nodule = np.unique(healthy) + 0.5, np.unique(nodule)
    steps = np.arange(healthy.size) / healthy.size
    heights = roc.height_at(healthy, nodule, steps)
    assert heights.mean() == pytest.approx(roc.auc(healthy, nodule))


def test_the_curves_height_is_what_a_threshold_reaches():
    healthy, nodule = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.5, 3.5, 5.0, 6.0])
    heights = roc.height_at(healthy, nodule, np.array([0.0, 0.25, 1.0]))
    assert heights.tolist() == [0.5, 0.75, 1.0]


def newcombes_variance(area, healthy, nodule):
    """Return the variance of method 5, with the formula as Newcombe prints it."""
    both = (healthy + nodule) / 2 - 1
    inner = 1 + both * (1 - area) / (2 - area) + both * area / (1 + area)
    return area * (1 - area) * inner / (healthy * nodule)


def test_the_interval_ends_where_newcombes_score_turns():
    numbers = generator(1, "newcombe")
    healthy, nodule = numbers.normal(0, 1, 20), numbers.normal(1.5, 1, 30)
    area, low, high = roc.auc_interval(healthy, nodule, 0.95)
    for end in (low, high):
        reach = 1.959963984540054 * math.sqrt(newcombes_variance(end, 20, 30))
        assert abs(end - area) == pytest.approx(reach)


def test_a_perfect_area_has_an_interval():
    area, low, high = roc.auc_interval(np.arange(20.0), np.arange(20.0) + 100, 0.95)
    assert (area, high) == (1.0, 1.0)
    assert 0.85 < low < 0.92
    mirrored = roc.auc_interval(np.arange(20.0) + 100, np.arange(20.0), 0.95)
    assert mirrored == pytest.approx((0.0, 0.0, 1 - low))
    assert all(map(math.isnan, roc.auc_interval(np.array([]), np.array([1.0]), 0.95)))


@pytest.mark.parametrize("area", [0.6, 0.76, 0.9, 0.98])
def test_the_interval_holds_the_truth_at_20_against_20(area):
    numbers, inside = generator(1, "coverage", str(area)), 0
    apart = norm.ppf(area) * math.sqrt(2)
    for _ in range(300):
        _, low, high = roc.auc_interval(
            numbers.normal(size=20), numbers.normal(apart, size=20), 0.95
        )
        inside += low <= area <= high
    assert inside / 300 >= 0.92


def test_passes_over_a_place_widen_the_interval_as_obuchowski_says():
    numbers = generator(1, "obuchowski")
    healthy, nodule = numbers.normal(0, 1, 12), numbers.normal(1, 1, 12)
    clusters = np.arange(12), np.arange(12, 24)
    plain = roc.auc_interval(healthy, nodule, 0.95, *clusters)
    assert plain == roc.auc_interval(healthy, nodule, 0.95)
    # The same score of each place five times tells no more than once.
    repeated = [np.repeat(each, 5) for each in (healthy, nodule, *clusters)]
    area, low, high = roc.auc_interval(*repeated[:2], 0.95, *repeated[2:])
    assert area == pytest.approx(plain[0])
    assert (low, high) == pytest.approx(plain[1:], abs=0.05)
    careless = roc.auc_interval(*repeated[:2], 0.95)
    assert high - low > 1.8 * (careless[2] - careless[1])
    two = roc.auc_interval(*repeated[:2], 0.95, repeated[2] // 6, repeated[3])
    assert two[0] == area and math.isnan(two[1])


def test_a_perfect_area_of_few_places_rests_on_their_number():
    healthy, nodule = np.arange(20.0), np.arange(20.0) + 100
    clusters = np.repeat(np.arange(4), 5), np.repeat(np.arange(4, 8), 5)
    _, low, high = roc.auc_interval(healthy, nodule, 0.95, *clusters)
    assert high == 1.0 and low < roc.auc_interval(healthy[:4], nodule[:4], 0.95)[1]
