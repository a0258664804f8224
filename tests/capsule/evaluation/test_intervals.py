"""Intervals of single recordings are the textbook's; those of clusters count fewer recordings."""

import math
from itertools import count

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar
from scipy.stats import beta, binom, t

from capsule.evaluation.intervals import (
    Units,
    auc,
    effective_count,
    gain_interval,
    height_at,
    lower_bound,
    mean_interval,
    median_interval,
    new_specificity,
    normal_quantile,
    rate,
    rate_of,
    ratio_interval,
    recordings_needed,
)
from capsule.seeding import generator


def half_width(expected, recordings, confidence):
    _, low, high = rate(expected * recordings, recordings, confidence)
    return (high - low) / 2


@pytest.mark.parametrize("expected", [0.0, 0.05, 0.5, 0.77, 0.9, 1.0])
@pytest.mark.parametrize("wanted", [0.05, 0.1, 0.3])
@pytest.mark.parametrize("confidence", [0.8, 0.95])
def test_it_is_the_least_count_whose_interval_is_narrow_enough(expected, wanted, confidence):
    least = next(n for n in count(1) if half_width(expected, n, confidence) <= wanted)
    assert recordings_needed(expected, wanted, confidence) == least


@given(
    expected=st.floats(0, 1),
    wanted=st.floats(0.01, 0.5),
    confidence=st.floats(0.5, 0.999),
)
@pytest.mark.takes(2)
def test_one_recording_fewer_would_not_do(expected, wanted, confidence):
    needed = recordings_needed(expected, wanted, confidence)
    assert half_width(expected, needed, confidence) <= wanted + 1e-9
    assert needed == 1 or half_width(expected, needed - 1, confidence) > wanted - 1e-9


def test_clusters_of_one_recording_change_nothing():
    right = np.array([True] * 17 + [False] * 3)
    values = np.arange(20.0) % 7
    alone = Units.of_places(np.arange(20))
    assert rate_of(right, alone, 0.95) == rate_of(right, None, 0.95) == rate(17, 20, 0.95)
    for interval in (mean_interval, median_interval):
        assert interval(values, 0.95, alone) == interval(values, 0.95)
    assert gain_interval(right, ~right, 0.95, alone) == gain_interval(right, ~right, 0.95)


def test_the_effective_count_is_that_of_rao_and_scott():
    # Five places of four passes: 4, 4, 4, 1 and 0 of 4 found, so p = 13/20.
    right = np.repeat([1.0, 1.0, 1.0, 0.0, 0.0], 4)
    right[12] = 1.0
    p, sums = 13 / 20, np.array([4, 4, 4, 1, 0]) - 4 * 13 / 20
    variance = 5 / 4 * np.sum(sums**2) / 20**2
    effect = variance / (p * (1 - p) / 20)
    assert effect > 3
    shrunk = (normal_quantile(0.95) / t.ppf(0.975, 4)) ** 2
    expected = 20 / effect * shrunk
    clusters = Units.of_places(np.repeat(np.arange(5), 4))
    assert effective_count(right, clusters, 0.95) == pytest.approx(expected)
    assert rate_of(right, clusters, 0.95) == rate(13, 20, 0.95, effective=expected)
    plain = rate(13, 20, 0.95)
    clustered = rate_of(right, clusters, 0.95)
    assert clustered[0] == plain[0]
    assert clustered[1] < plain[1] - 0.1 and clustered[2] > plain[2] + 0.1


def test_a_perfect_rate_rests_on_as_many_recordings_as_there_are_clusters():
    right, clusters = np.ones(40, dtype=bool), Units.of_places(np.repeat(np.arange(5), 8))
    shrunk = (normal_quantile(0.95) / t.ppf(0.975, 4)) ** 2
    assert effective_count(right, clusters, 0.95) == pytest.approx(5 * shrunk)
    value, low, high = rate_of(right, clusters, 0.95)
    assert (value, high) == (1.0, 1.0) and low < rate(5, 5, 0.95)[1]


def test_passes_that_contradict_each_other_are_never_worth_more_than_single_ones():
    # One of two passes is right at every place, and the sums do not scatter at all; then both are
    # at one place, and the sums scatter less than those of single passes. Kills: no cap at n.
    right, clusters = np.tile([True, False], 10), Units.of_places(np.repeat(np.arange(10), 2))
    shrunk = (normal_quantile(0.95) / t.ppf(0.975, 9)) ** 2
    for last in (False, True):
        right[-1] = last
        assert effective_count(right, clusters, 0.95) == pytest.approx(20 * shrunk)


def test_the_clustered_median_lies_between_the_ranks_that_its_formula_names():
    # Kills: either rank off by one.
    values = generator(3, "clustered").normal(size=40) + np.repeat(np.arange(10.0), 4)
    clusters = Units.of_places(np.repeat(np.arange(10), 4))
    median, low, high = median_interval(values, 0.95, clusters)
    effective = effective_count(values < median, clusters, 0.95)
    _, least, most = rate(20, 40, 0.95, effective=effective)
    ordered = sorted(values)
    # The last value of a rank up to the lower end, and the one after the first beyond the upper.
    assert low == ordered[max(rank for rank in range(1, 41) if rank <= 40 * least) - 1]
    assert high == ordered[min(rank for rank in range(1, 41) if rank >= 40 * most) + 1 - 1]


def test_fewer_than_three_clusters_have_no_interval():
    right, clusters = np.array([True, True, False, True]), Units.of_places(np.array([0, 0, 1, 1]))
    value, low, high = rate_of(right, clusters, 0.95)
    assert value == 0.75 and math.isnan(low) and math.isnan(high)
    assert math.isnan(lower_bound(right, clusters))
    # Single recordings keep theirs, however few.
    assert rate_of(right[:2], Units.of_places(np.arange(2)), 0.95) == rate(2, 2, 0.95)


def test_the_lower_bound_is_one_sided():
    right = np.ones(20, dtype=bool)
    assert lower_bound(right) == rate(20, 20, 0.9)[1] == pytest.approx(0.8808, abs=1e-4)
    assert lower_bound(right[:10]) < 0.85 < right[:10].mean()


def test_a_ratio_of_effective_counts_is_that_of_counts():
    assert ratio_interval(15.0, 20.0, 9.0, 20.0, 0.95) == ratio_interval(15, 20, 9, 20, 0.95)
    low, high = ratio_interval(7.5, 10.0, 4.5, 10.0, 0.95)
    assert low < ratio_interval(15, 20, 9, 20, 0.95)[0] and high > 2.9
    assert all(map(math.isnan, ratio_interval(3.0, math.nan, 9.0, 20.0, 0.95)))


@settings(deadline=None)
@given(st.integers(1, 300), st.floats(0.5, 0.999))
def test_the_medians_interval_leaves_out_the_binomials_tails(count, confidence):
    median, low, high = median_interval(np.arange(count, dtype=float), confidence)
    skipped = binom.ppf((1 - confidence) / 2, count, 0.5)
    assert median == (count - 1) / 2
    np.testing.assert_equal(
        (low, high), (skipped - 1, count - skipped) if skipped else (np.nan,) * 2
    )


def test_the_interval_of_the_median_lies_between_two_of_the_values():
    # Of 20 values, 6 to 15 hold the median with 95.9 % (a table in any textbook of signs).
    assert median_interval(np.arange(1.0, 21.0), 0.95) == (10.5, 6.0, 15.0)
    few = median_interval(np.array([1.0, 2.0, 4.0]), 0.95)
    assert few[0] == 2.0 and np.isnan(few[1:]).all()


def test_repeated_values_tell_no_more_than_the_values_themselves():
    values = generator(1, "repeated").normal(size=12)
    repeated, clusters = np.repeat(values, 5), Units.of_places(np.repeat(np.arange(12), 5))
    mean, low, high = mean_interval(repeated, 0.95, clusters)
    expected = mean_interval(values, 0.95)
    assert mean == pytest.approx(expected[0])
    assert (low, high) == pytest.approx(expected[1:], rel=0.1)
    _, low, high = median_interval(repeated, 0.95, clusters)
    plain = median_interval(repeated, 0.95)
    assert low <= plain[1] and high >= plain[2] and high - low > plain[2] - plain[1]
    gains = np.repeat([1.0, 0.0, 0.0, 1.0, 0.0], 6)
    _, low, high = gain_interval(
        0 * gains, gains, 0.95, Units.of_places(np.repeat(np.arange(5), 6))
    )
    assert low < 0 < gain_interval(0 * gains, gains, 0.95)[1]


def test_a_recording_that_was_not_judged_both_times_has_no_gain():
    before, after = np.array([0.5, np.nan, 0.25]), np.array([1.0, 1.0, np.nan])
    assert gain_interval(before, after, 0.95)[0] == 0.5
    assert np.isnan(gain_interval(before[1:], after[1:], 0.95)).all()


def test_the_gain_of_whole_verdicts_is_bonetts_and_prices():
    before, after = np.array([1, 0, 0, 1, 0, 0, 1.0]), np.array([1, 1, 1, 0, 1, 0, 1.0])
    # One recording is lost and three are won; each count has one more, and the number two more.
    lost, won = 2 / 9, 4 / 9
    reach = normal_quantile(0.95) * math.sqrt((lost + won - (won - lost) ** 2) / 9)
    expected = (2 / 7, won - lost - reach, won - lost + reach)
    assert gain_interval(before, after, 0.95) == pytest.approx(expected)


def test_what_a_new_place_may_expect_of_a_threshold_at_a_rank():
    # Of 20 healthy recordings the threshold is the highest score: Beta(20, 1).
    low, high = new_specificity(20, 0.95)
    assert (low, high) == pytest.approx((0.05 ** (1 / 20), 0.95 ** (1 / 20)))
    assert (round(low, 2), round(high, 3)) == (0.86, 0.997)
    assert new_specificity(100, 0.95) == pytest.approx(beta.ppf([0.05, 0.95], 96, 5))
    assert new_specificity(19, 0.95) == pytest.approx(beta.ppf([0.05, 0.95], 19, 1))
    assert all(map(math.isnan, new_specificity(0, 0.95)))


def test_that_range_holds_the_specificity_of_any_scores_as_often_as_it_says():
    numbers = generator(1, "new place")
    low, high = new_specificity(20, 0.95)
    # The distribution function at the highest of 20 scores is the specificity.
    specificity = numbers.random((4000, 20)).max(axis=1)
    assert np.mean((low <= specificity) & (specificity <= high)) == pytest.approx(0.9, abs=0.02)


@pytest.mark.parametrize(("places", "passes", "share"), [(5, 4, 0.5), (12, 6, 0.8), (20, 3, 0.9)])
def test_the_interval_of_a_rate_over_places_holds_the_truth(places, passes, share):
    numbers, inside, plainly = generator(1, "places", str(places)), 0, 0
    clusters = Units.of_places(np.repeat(np.arange(places), passes))
    for _ in range(400):
        of_place = numbers.beta(share, 1 - share, places)  # intra-cluster correlation 0.5
        right = numbers.random(places * passes) < np.repeat(of_place, passes)
        _, low, high = rate_of(right, clusters, 0.95)
        inside += low <= share <= high
        _, low, high = rate_of(right, None, 0.95)
        plainly += low <= share <= high
    assert inside / 400 >= 0.9
    assert plainly / 400 < 0.87


def test_one_place_of_many_passes_weighs_as_any_other():
    # Of ten places one has 15 passes, so that passes say another rate than places.
    places = np.array([*range(9), *[9] * 15])
    numbers, inside, plainly = generator(1, "one place of many passes"), 0, 0
    for _ in range(1000):
        of_place = numbers.beta(0.8, 0.2, 10)  # intra-cluster correlation 0.5
        right = numbers.random(24) < of_place[places]
        value, low, high = rate_of(right, Units.of_places(places), 0.95)
        assert value == pytest.approx((right[:9].sum() + right[9:].mean()) / 10)
        inside += low <= 0.8 <= high
        _, low, high = rate_of(right, Units(np.ones(24), places), 0.95)
        plainly += low <= 0.8 <= high
    assert inside / 1000 >= 0.93
    assert plainly / 1000 < 0.93


def test_weights_of_places_count_in_every_measure():
    # Three passes over one place, and one over each of three: repeated ones must not count.
    places = np.array([0, 0, 0, 1, 2, 3])
    units, values = Units.of_places(places), np.array([5.0, 5.0, 5.0, 1.0, 2.0, 4.0])
    once = values[2:]
    assert mean_interval(values, 0.95, units)[0] == pytest.approx(once.mean())
    assert median_interval(values, 0.95, units)[0] == np.median(once)
    assert gain_interval(0 * values, values / 5, 0.95, units)[0] == pytest.approx(once.mean() / 5)
    weights = units.weights, np.ones(4)
    nodule = np.array([0.0, 3.0, 4.5, 6.0])
    assert auc(values, nodule, weights) == pytest.approx(auc(once, nodule))
    grid = np.linspace(0, 1, 21)
    expected = height_at(once, nodule, grid)
    np.testing.assert_allclose(height_at(values, nodule, grid, weights), expected)
    assert auc(nodule, values, weights[::-1]) == pytest.approx(auc(nodule, once))
    expected = height_at(nodule, once, grid)
    np.testing.assert_allclose(height_at(nodule, values, grid, weights[::-1]), expected)


def score_at(hits, count, other_hits, other_count, ratio):
    """Return the score of a ratio, with the most likely rates found by trying."""

    def likelihood(other_rate):
        rate_ = ratio * other_rate
        terms = [(hits, rate_), (count - hits, 1 - rate_)]
        terms += [(other_hits, other_rate), (other_count - other_hits, 1 - other_rate)]
        return sum(n * np.log(max(p, 1e-300)) for n, p in terms if n)

    most = min(1.0, 1.0 / ratio)
    bounds = (1e-12, most - 1e-12)
    found = minimize_scalar(
        lambda rate_: -likelihood(rate_), bounds=bounds, method="bounded", options={"xatol": 1e-13}
    )
    other_rate = found.x
    rate_ = ratio * other_rate
    variance = rate_ * (1 - rate_) / count
    variance += ratio**2 * other_rate * (1 - other_rate) / other_count
    return (hits / count - ratio * other_hits / other_count) / math.sqrt(variance)


@pytest.mark.parametrize(
    "counts", [(15, 20, 9, 20), (3, 40, 7, 12), (19, 20, 1, 30), (20, 20, 5, 20), (6, 9, 30, 30)]
)
def test_the_ends_of_a_ratio_are_where_the_score_test_begins_to_reject(counts):
    low, high = ratio_interval(*counts, 0.95)
    assert score_at(*counts, low) == pytest.approx(normal_quantile(0.95), rel=1e-3)
    assert score_at(*counts, high) == pytest.approx(-normal_quantile(0.95), rel=1e-3)


def test_a_ratio_of_rates_of_0_or_1_has_an_interval_on_both_sides():
    low, high = ratio_interval(20, 20, 20, 20, 0.95)
    assert low < 1 < high == pytest.approx(1 / low)
    low, high = ratio_interval(0, 20, 10, 20, 0.95)
    assert low == 0.0 and 0 < high < 1
    low, high = ratio_interval(10, 20, 0, 20, 0.95)
    assert 1 < low < math.inf and high == math.inf
    assert all(map(math.isnan, ratio_interval(0, 20, 0, 20, 0.95)))


@given(
    st.integers(1, 12), st.integers(1, 12), st.floats(1 / 3, 3), st.sampled_from([0.8, 0.95, 0.99])
)
@settings(deadline=None, max_examples=40)
def test_the_interval_of_a_ratio_turned_over_is_turned_over(hits, other, share, confidence):
    low, high = ratio_interval(hits, 12, other * share, 12 * max(share, 1), confidence)
    turned = ratio_interval(other * share, 12 * max(share, 1), hits, 12, confidence)
    assert (1 / high, 1 / low) == pytest.approx(turned, rel=1e-6)


@pytest.mark.parametrize(("hits", "count"), [(0, 7), (3, 7), (7, 7), (19, 20), (200, 500)])
@pytest.mark.parametrize("confidence", [0.8, 0.95])
def test_a_rate_has_the_interval_of_wilson_written_out(hits, count, confidence):
    z, share = normal_quantile(confidence), hits / count
    value, low, high = rate(hits, count, confidence)
    assert value == share
    # The ends are the rates from which the measured one is z standard errors away.
    for end in (low, high):
        assert (end - share) ** 2 * count == pytest.approx(z**2 * end * (1 - end), abs=1e-9)
    assert low <= share <= high and high > low
    assert all(map(math.isnan, rate(0, 0, confidence)))


@pytest.mark.parametrize("count", [2, 3, 12])
def test_a_mean_has_the_interval_of_student(count):
    values = generator(1, "student", str(count)).normal(size=count)
    mean, low, high = mean_interval(values, 0.9)
    reach = t.ppf(0.95, count - 1) * values.std(ddof=1) / math.sqrt(count)
    assert (mean, low, high) == pytest.approx(
        (values.mean(), values.mean() - reach, values.mean() + reach)
    )
    one, *ends = mean_interval(values[:1], 0.9)
    assert one == values[0] and np.isnan(ends).all()
    assert np.isnan(mean_interval(values[:0], 0.9)).all()


def test_the_gains_interval_stays_between_losing_all_and_winning_all():
    won, lost = np.ones(3), np.zeros(3)
    assert gain_interval(lost, won, 0.99)[::2] == (1.0, 1.0)
    assert gain_interval(won, lost, 0.99)[:2] == (-1.0, -1.0)
    assert gain_interval(lost, won, 0.99)[1] < 0.7


def test_recordings_with_clusters_weigh_in_a_gain_as_many_as_they_are_worth():
    gains = np.array([1, 1, 0, 0, 1, 1, 0, 0, -1, -1.0])
    clusters = Units.of_places(np.repeat(np.arange(5), 2))
    size = effective_count(gains, clusters, 0.95, gains.var())
    widened, weights = [*gains, 1, -1], [*[size / 10] * 10, 1, 1]
    centre = np.average(widened, weights=weights)
    variance = np.average((np.array(widened) - centre) ** 2, weights=weights)
    reach = normal_quantile(0.95) * math.sqrt(variance / (size + 2))
    expected = (gains.mean(), centre - reach, centre + reach)
    assert gain_interval(0 * gains, gains, 0.95, clusters) == pytest.approx(expected)
