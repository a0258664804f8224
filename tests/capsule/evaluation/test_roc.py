"""The ROC curve, and the area under it with an interval that does not collapse."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from capsule.evaluation import intervals
from capsule.evaluation.intervals import Units, normal_quantile, student_factor
from capsule.seeding import generator

SCORES = st.lists(st.integers(0, 9), min_size=1, max_size=12).map(np.array)


@given(SCORES, SCORES)
def test_the_area_counts_the_pairs_in_the_right_order(healthy, nodule):
    pairs = [(n > h) + 0.5 * (n == h) for n in nodule for h in healthy]
    assert intervals.auc(healthy, nodule) == pytest.approx(np.mean(pairs))


@given(SCORES, SCORES)
def test_the_area_is_the_area_under_the_curve(healthy, nodule):
    # With single scores on each side, the curve is a staircase of whole steps.
    healthy, nodule = np.unique(healthy) + 0.5, np.unique(nodule)
    steps = np.arange(healthy.size) / healthy.size
    heights = intervals.height_at(healthy, nodule, steps)
    assert heights.mean() == pytest.approx(intervals.auc(healthy, nodule))


def test_the_curves_height_is_what_a_threshold_reaches():
    healthy, nodule = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.5, 3.5, 5.0, 6.0])
    heights = intervals.height_at(healthy, nodule, np.array([0.0, 0.25, 1.0]))
    assert heights.tolist() == [0.5, 0.75, 1.0]


def newcombes_variance(area, healthy, nodule):
    """Return the variance of method 5, with the formula as Newcombe prints it."""
    both = (healthy + nodule) / 2 - 1
    inner = 1 + both * (1 - area) / (2 - area) + both * area / (1 + area)
    return area * (1 - area) * inner / (healthy * nodule)


def test_the_interval_ends_where_newcombes_score_turns():
    numbers = generator(1, "newcombe")
    healthy, nodule = numbers.normal(0, 1, 20), numbers.normal(1.5, 1, 30)
    area, low, high = intervals.auc_interval(healthy, nodule, 0.95)
    for end in (low, high):
        reach = 1.959963984540054 * math.sqrt(newcombes_variance(end, 20, 30))
        assert abs(end - area) == pytest.approx(reach)


def test_a_perfect_area_has_an_interval():
    area, low, high = intervals.auc_interval(np.arange(20.0), np.arange(20.0) + 100, 0.95)
    assert (area, high) == (1.0, 1.0)
    assert 0.85 < low < 0.92
    mirrored = intervals.auc_interval(np.arange(20.0) + 100, np.arange(20.0), 0.95)
    assert mirrored == pytest.approx((0.0, 0.0, 1 - low))
    assert all(map(math.isnan, intervals.auc_interval(np.array([]), np.array([1.0]), 0.95)))


@pytest.mark.parametrize("area", [0.6, 0.76, 0.9, 0.98])
def test_the_interval_holds_the_truth_at_20_against_20(area):
    numbers, inside = generator(1, "coverage", str(area)), 0
    apart = norm.ppf(area) * math.sqrt(2)
    for _ in range(300):
        _, low, high = intervals.auc_interval(
            numbers.normal(size=20), numbers.normal(apart, size=20), 0.95
        )
        inside += low <= area <= high
    assert inside / 300 >= 0.92


def test_passes_over_a_place_widen_the_interval_as_obuchowski_says():
    numbers = generator(1, "obuchowski")
    healthy, nodule = numbers.normal(0, 1, 12), numbers.normal(1, 1, 12)
    clusters = np.arange(12), np.arange(12, 24)
    plain = intervals.auc_interval(healthy, nodule, 0.95, *map(Units.of_places, clusters))
    assert plain == intervals.auc_interval(healthy, nodule, 0.95)
    # The same score of each place five times tells no more than once.
    repeated = [np.repeat(each, 5) for each in (healthy, nodule, *clusters)]
    area, low, high = intervals.auc_interval(
        *repeated[:2], 0.95, *map(Units.of_places, repeated[2:])
    )
    assert area == pytest.approx(plain[0])
    assert (low, high) == pytest.approx(plain[1:], abs=0.05)
    careless = intervals.auc_interval(*repeated[:2], 0.95)
    assert high - low > 1.8 * (careless[2] - careless[1])
    few = Units.of_places(repeated[2] // 6), Units.of_places(repeated[3])
    two = intervals.auc_interval(*repeated[:2], 0.95, *few)
    assert two[0] == pytest.approx(area) and math.isnan(two[1])


def test_a_perfect_area_of_few_places_rests_on_their_number():
    healthy, nodule = np.arange(20.0), np.arange(20.0) + 100
    clusters = np.repeat(np.arange(4), 5), np.repeat(np.arange(4, 8), 5)
    _, low, high = intervals.auc_interval(healthy, nodule, 0.95, *map(Units.of_places, clusters))
    assert high == 1.0 and low < intervals.auc_interval(healthy[:4], nodule[:4], 0.95)[1]


@pytest.mark.parametrize("confidence", [0.8, 0.95])
@pytest.mark.parametrize(
    ("healthy", "nodules", "shift"), [(7, 12, 0.5), (20, 5, 1.5), (4, 4, 9.0), (1, 2, 9.0)]
)
def test_the_ends_of_an_area_are_z_standard_errors_away_from_it(
    confidence, healthy, nodules, shift
):
    numbers = generator(1, "ends", str(healthy))
    scores = numbers.normal(size=healthy), numbers.normal(shift, 1, nodules)
    area, low, high = intervals.auc_interval(*scores, confidence)
    z, more = normal_quantile(confidence), (healthy + nodules) / 2 - 1
    for end in (low, high):
        spread = 1 + more * (1 - end) / (2 - end) + more * end / (1 + end)
        variance = end * (1 - end) / (healthy * nodules) * spread
        assert (end - area) ** 2 == pytest.approx(z**2 * variance, abs=1e-9)
    assert low < area <= high
    assert (high == 1.0) == (area == 1.0)


@pytest.mark.parametrize("first", [6, 3, 0], ids=["apart", "some of both kinds", "most"])
def test_over_clusters_the_numbers_are_divided_by_the_design_effect_written_out(first):
    numbers = generator(1, "effect")
    of_healthy, of_nodule = np.repeat(np.arange(6), 3), np.repeat(np.arange(first, first + 5), 2)
    level = numbers.normal(size=11)
    healthy = level[of_healthy] + 0.3 * numbers.normal(size=18)
    nodule = 1 + level[of_nodule] + 0.3 * numbers.normal(size=10)
    below = np.array([np.mean(nodule > score) for score in healthy])
    above = np.array([np.mean(healthy < score) for score in nodule])
    area = below.mean()
    # DeLong (1988) without clusters, and Obuchowski (1997) with them.
    alone = below.var(ddof=1) / 18 + above.var(ddof=1) / 10
    clustered = 0.0
    for cluster in range(11):
        of_mean = math.sqrt(6 / 5) * (below[of_healthy == cluster] - area).sum() / 18
        of_mean += math.sqrt(5 / 4) * (above[of_nodule == cluster] - area).sum() / 10
        clustered += of_mean**2
    factor = student_factor(5, 0.95) / max(clustered / alone, 1.0)
    units = [Units(np.ones(each.size), each) for each in (of_healthy, of_nodule)]
    found = intervals.auc_interval(healthy, nodule, 0.95, *units)
    assert found[0] == pytest.approx(area)
    m, n, z = 18 * factor, 10 * factor, normal_quantile(0.95)
    more = max((m + n) / 2 - 1, 0)
    for end in found[1:]:
        spread = 1 + more * (1 - end) / (2 - end) + more * end / (1 + end)
        assert (end - area) ** 2 == pytest.approx(z**2 * end * (1 - end) / (m * n) * spread)


def test_the_height_of_the_curve_is_counted():
    healthy, nodule = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.5, 2.5, 3.0, 3.5, 5.0])
    grid = np.array([0.0, 0.2, 0.25, 0.5, 0.75, 0.99, 1.0])
    # None above 4, then above 3, above 2, above 1, and all.
    expected = [1 / 5, 1 / 5, 2 / 5, 4 / 5, 4 / 5, 4 / 5, 1.0]
    np.testing.assert_allclose(intervals.height_at(healthy, nodule, grid), expected)
