"""Statistics of single recordings are those of the libraries; clusters count fewer recordings.

How often the intervals hold the truth is counted by tests/benchmarks/compare_intervals.py.
"""

import math
from itertools import count

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import beta, binom, t
from sklearn.metrics import roc_auc_score, roc_curve
from statsmodels.stats.contingency_tables import mcnemar
from statsmodels.stats.proportion import confint_proportions_2indep, proportion_confint

from capsule.evaluation import intervals
from capsule.evaluation.intervals import Units, auc, effective_count, height_at, rate, rate_of
from capsule.evaluation.measures import sign_test
from capsule.seeding import generator

LEVEL = st.sampled_from([0.5, 0.68, 0.9, 0.95, 0.999])
COUNTS = st.integers(1, 60).flatmap(lambda of: st.tuples(st.integers(0, of), st.just(of)))


def places_of(number, passes=1):
    """Return the units of so many places, each of as many passes."""
    return Units.of_places(np.repeat(np.arange(number), passes))


# Of single recordings, against the libraries.


@given(COUNTS, LEVEL)
def test_a_rate_has_wilsons_interval(counts, level):
    value, low, high = rate(*counts, level)
    assert value == counts[0] / counts[1] and low <= value <= high
    expected = proportion_confint(*counts, alpha=1 - level, method="wilson")
    assert (low, high) == pytest.approx(expected, abs=1e-12)
    assert all(map(math.isnan, rate(0, 0, level)))


@given(st.integers(1, 300), st.floats(0.5, 0.999), st.integers(1, 9))
def test_a_mean_has_students_interval_and_a_median_the_binomials_ranks(values, level, passes):
    every = np.arange(values, dtype=float)
    # One of several passes over each place; kills an effective number that rounding moves.
    units = Units(np.full(values, 1 / passes), np.arange(values))
    median, *ends = intervals.median_interval(every, units, level)
    skipped = binom.ppf((1 - level) / 2, values, 0.5)
    assert median == (values - 1) / 2
    np.testing.assert_equal(ends, (skipped - 1, values - skipped) if skipped else (np.nan,) * 2)
    mean, *ends = intervals.mean_interval(every**2, units, level)
    assert mean == pytest.approx((every**2).mean())
    if values > 1:
        expected = t.interval(level, values - 1, mean, (every**2).std(ddof=1) / values**0.5)
        assert ends == pytest.approx(expected)
    assert np.isnan(ends).all() == (values == 1)
    for interval in (intervals.mean_interval, intervals.median_interval):
        assert np.isnan(interval(every[:0], places_of(0), level)).all()


@pytest.mark.parametrize(
    "counts", [(15, 20, 9, 20), (3, 40, 7, 12), (20, 20, 1, 20), (0, 9, 3, 8), (5, 6, 0, 7)]
)
# With no other hit, statsmodels divides by 0.
@pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning")
def test_the_interval_of_a_ratio_is_koopmans(counts):
    options = {"compare": "ratio", "method": "score", "alpha": 0.05, "correction": False}
    expected = confint_proportions_2indep(*counts, **options)
    low, high = intervals.ratio_interval(*counts, 0.95)
    assert (low, high) == pytest.approx(expected, rel=1e-6)
    assert (low == 0) == (counts[0] == 0)
    # Effective counts need not be whole numbers.
    wider = intervals.ratio_interval(*np.array(counts) / 3, 0.95)
    assert wider[0] <= low and wider[1] >= high
    # It is unknown if both rates are 0, or a count is unknown.
    for unknown in ((0, 9, 0, 8), (5, math.nan, 9, 20), (5, 6, 9, math.nan)):
        assert all(map(math.isnan, intervals.ratio_interval(*unknown, 0.95)))
    low, high = intervals.ratio_interval(20, 20, 20, 20, 0.95)
    assert low < 1 < high == pytest.approx(1 / low)


@pytest.mark.parametrize("seed", range(5))
def test_the_curve_its_area_and_the_sign_test(seed):
    numbers = np.random.default_rng(seed)
    nodule = numbers.random(60) < 0.6
    scores = np.round(numbers.normal(nodule * 1.5, 1.0), 1)
    kinds = scores[~nodule], scores[nodule]
    weights = (*map(np.ones_like, kinds),)
    assert auc(*kinds, weights) == pytest.approx(roc_auc_score(nodule, scores))
    allowed = np.arange(kinds[0].size + 1) / kinds[0].size
    false_positive, true_positive, _ = roc_curve(nodule, scores, drop_intermediate=False)
    expected = [true_positive[false_positive <= each + 1e-9].max() for each in allowed]
    np.testing.assert_allclose(height_at(*kinds, allowed, weights), expected)
    # Between two shares of false alarms, the curve keeps its height.
    between = allowed[:-1] + 0.4 / kinds[0].size
    np.testing.assert_allclose(height_at(*kinds, between, weights), expected[:-1])
    first, second = numbers.random(50) < 0.6, numbers.random(50) < 0.8
    table = [[np.sum(a & b) for b in (second, ~second)] for a in (first, ~first)]
    expected = mcnemar(table, exact=True).pvalue
    assert sign_test(first, second, places_of(50)) == pytest.approx(expected)
    assert sign_test(first, first, places_of(50)) == 1.0
    assert math.isnan(sign_test(first[:0], first[:0], places_of(0)))


def assert_newcombe(area, ends, m, n, confidence=0.95):
    """Assert that the ends are z standard errors away, by the formula as Newcombe prints it."""
    more = max((m + n) / 2 - 1, 0)
    for end in ends:
        spread = 1 + more * (1 - end) / (2 - end) + more * end / (1 + end)
        variance = end * (1 - end) * spread / (m * n)
        reach = intervals.normal_quantile(confidence) ** 2 * variance
        assert (end - area) ** 2 == pytest.approx(reach, abs=1e-9)


@pytest.mark.parametrize("confidence", [0.8, 0.95])
@pytest.mark.parametrize(("m", "n", "shift"), [(7, 12, 0.5), (20, 5, 1.5), (4, 4, 9), (1, 2, 9)])
def test_the_interval_of_an_area_is_newcombes_method_5(confidence, m, n, shift):
    numbers = generator(1, "ends", str(m))
    units = places_of(m), Units(np.ones(n), m + np.arange(n))
    healthy, nodule = numbers.normal(size=m), numbers.normal(shift, 1, n)
    area, low, high = intervals.auc_interval(healthy, nodule, units, confidence)
    assert_newcombe(area, (low, high), m, n, confidence)
    assert low < area <= high and (high == 1.0) == (area == 1.0)
    mirrored = intervals.auc_interval(-healthy, -nodule, units, confidence)
    assert mirrored == pytest.approx((1 - area, 1 - high, 1 - low))
    nothing = healthy[:0], nodule, (places_of(0), units[1])
    assert np.isnan(intervals.auc_interval(*nothing, confidence)).all()


@pytest.mark.parametrize("expected", [0.0, 0.05, 0.5, 0.77, 1.0])
@pytest.mark.parametrize(("wanted", "level"), [(0.05, 0.8), (0.3, 0.95), (0.6, 0.95)])
def test_the_fewest_recordings_whose_interval_is_narrow_enough_are_needed(expected, wanted, level):
    widths = ((n, np.ptp(rate(expected * n, n, level)[1:]) / 2) for n in count(1))
    least, exactly = next((n, width) for n, width in widths if width <= wanted)
    for width in (wanted, exactly):
        assert intervals.recordings_needed(expected, width, level) == least


def test_what_a_new_place_may_expect_of_a_threshold_at_a_rank():
    # Of 20 healthy recordings the threshold is the highest score; no rank is below the lowest.
    for healthy, wanted, rank in ((20, 0.95, 20), (39, 0.95, 38), (1, 0.95, 1), (9, 0.0, 1)):
        expected = beta.ppf([0.05, 0.95], rank, healthy + 1 - rank)
        assert intervals.new_specificity(healthy, wanted) == pytest.approx(expected)
    assert all(map(math.isnan, intervals.new_specificity(0, 0.95)))


# Over clusters.


@pytest.mark.parametrize(
    "found", [[4, 4, 4, 1, 0], [3, 2, 2, 2, 2], [4, 4, 4, 4, 4], [2, 2, 2, 2, 2], [0, 1, 0, 0, 0]]
)
def test_the_effective_count_is_that_of_rao_and_scott_and_never_above_n(found):
    """Of five places of four passes, so many are found. Kills: no cap at n."""
    right = np.concatenate([np.arange(4) < hits for hits in found])
    p, sums = right.mean(), np.array(found) - 4 * right.mean()
    single, of_mean = p * (1 - p) / 20, 5 / 4 * np.sum(sums**2) / 20**2
    # Of a rate of 0 or 1, the places count. Sums that scatter less than those of single recordings
    # make no recording worth more than one.
    effective = 5 if single == 0 else 20 / max(of_mean / single, 1)
    expected = effective * (intervals.normal_quantile(0.95) / t.ppf(0.975, 4)) ** 2
    assert intervals.student_factor(5, 0.95) == pytest.approx(expected / effective)
    places = places_of(5, 4)
    assert effective_count(right, places, 0.95) == pytest.approx(expected)
    ends = rate(right.sum(), 20, 0.95, effective=expected)
    assert rate_of(right, places, 0.95) == pytest.approx(ends)
    assert intervals.lower_bound(right, places) == rate_of(right, places, 0.9)[1]
    # The same recordings as values of another variance.
    size = effective_count(right * 2.0, places, 0.95, variance=4 * p * (1 - p))
    assert size == pytest.approx(expected)
    # Two single recordings have an interval, and two clusters of several have none.
    assert rate_of(np.ones(2), places_of(2), 0.95) == rate(2, 2, 0.95)
    pair = np.ones(4), places_of(2, 2)
    assert np.isnan([*rate_of(*pair, 0.95)[1:], intervals.lower_bound(*pair)]).all()


def test_the_clustered_median_lies_between_the_ranks_that_its_formula_names():
    # Kills: either rank off by one; for an odd number of values, the median among those below it.
    for places, passes in ((11, 3), (10, 4)):
        noise = generator(3, "clustered").normal(size=places * passes)
        values = noise + np.repeat(np.arange(float(places)), passes)
        clusters, count = places_of(places, passes), places * passes
        median, low, high = intervals.median_interval(values, clusters, 0.95)
        effective = effective_count(values < median, clusters, 0.95)
        _, least, most = rate(count / 2, count, 0.95, effective=effective)
        ordered = sorted(values)
        # The last value of a rank up to the lower end, the one after the first beyond the upper.
        assert low == ordered[math.floor(count * least) - 1]
        assert high == ordered[math.ceil(count * most)]
    # Between all values of 5 places, the median lies with a probability of 15 / 16: below 95 %.
    # Kills: the last value for both ends, where two places have no effective number.
    for places, level in ((2, 0.5), (3, 0.95), (5, 0.95), (6, 0.95)):
        some = values[: 4 * places], places_of(places, 4)
        assert np.isfinite(intervals.median_interval(*some, level)[1:]).all() == (places > 5)


@pytest.mark.parametrize(
    ("gains", "passes"),
    [([-1, 1, 1, 0, 1, 0], 1), ([1, 1, 0, 0, 1, 1, -1, -1], 2), ([1] * 3, 1), ([-1] * 3, 1)],
)
def test_a_gain_has_bonett_and_prices_interval_of_as_many_as_recordings_are_worth(gains, passes):
    gains, units = np.array(gains, dtype=float), places_of(len(gains) // passes, passes)
    size = effective_count(gains, units, 0.95, gains.var())
    # Added are one that gains everything and one that loses everything.
    widened, weights = [*gains, 1, -1], [*[size / gains.size] * gains.size, 1, 1]
    centre = np.average(widened, weights=weights)
    variance = np.average((np.array(widened) - centre) ** 2, weights=weights)
    reach = intervals.normal_quantile(0.95) * math.sqrt(variance / (size + 2))
    value = gains.mean()
    ends = max(min(centre - reach, value), -1), min(max(centre + reach, value), 1)
    before, after = 0 * gains, gains.copy()
    assert intervals.gain_interval(before, after, units, 0.95) == pytest.approx((value, *ends))
    # A recording that was not judged both times has no gain.
    before[0] = after[-1] = np.nan
    known = intervals.gain_interval(before, after, units, 0.95)
    assert known[0] == pytest.approx(gains[1:-1].mean())
    assert np.isnan(intervals.gain_interval(before[:1], after[:1], places_of(1), 0.95)).all()


def test_each_place_weighs_the_same_in_every_measure():
    # Three passes over one place, and one over each of three: repeated ones must not count.
    units, values = Units.of_places(np.array([0, 0, 0, 1, 2, 3])), np.array([5.0, 5, 5, 1, 2, 4])
    once, nodule, grid = values[2:], np.array([0.0, 3.0, 4.5, 6.0]), np.linspace(0, 1, 21)
    assert units.weights.tolist() == [1 / 3] * 3 + [1] * 3
    assert intervals.mean_interval(values, units, 0.95)[0] == pytest.approx(once.mean())
    assert intervals.median_interval(values, units, 0.95)[0] == np.median(once)
    gain, *_ = intervals.gain_interval(0 * values, values / 5, units, 0.95)
    assert gain == pytest.approx(once.mean() / 5)
    assert rate_of(values > 3, units, 0.95)[0] == pytest.approx(0.5)
    for turn in (1, -1):
        weights, equal = (units.weights, np.ones(4))[::turn], (np.ones(4), np.ones(4))
        passes, single = (values, nodule)[::turn], (once, nodule)[::turn]
        assert auc(*passes, weights) == pytest.approx(auc(*single, equal))
        expected = height_at(*single, grid, equal)
        np.testing.assert_allclose(height_at(*passes, grid, weights), expected)
    # Ten passes over one place are won once.
    first = np.arange(12) < 2
    assert sign_test(first, ~first, Units.of_places(~first * 1)) == 1.0
    # Kills: ends of a median that follow from the order of equal values, whose weights differ.
    values, places = np.array([1, 1, 1, 1, 0, 1, 1, 1.0]), np.array([0, 1, 2, 2, 2, 2, 3, 4])
    turned, places_turned = (each[[3, 5, 6, 0, 1, 4, 7, 2]] for each in (values, places))
    there = intervals.median_interval(values, Units.of_places(places), 0.95)
    assert there == intervals.median_interval(turned, Units.of_places(places_turned), 0.95)
    # Kills: the normal quantile for a mean of few places, some of whose passes have no value.
    weights, values = np.array([1, 0.5, 1, 0.5]), np.array([2.0, 3.0, 5.0, 1.0])
    mean, worth = (2.0 + 0.5 * 3.0 + 5.0 + 0.5 * 1.0) / 3, 3**2 / 2.5
    scatter = sum(weights * (values - mean) ** 2) / (3 - 2.5 / 3)
    expected = mean, *t.interval(0.95, worth - 1, mean, (scatter / worth) ** 0.5)
    found = intervals.mean_interval(values, Units(weights, np.arange(4)), 0.95)
    assert found == pytest.approx(expected)


@pytest.mark.parametrize("first", [6, 3, 0], ids=["apart", "some of both kinds", "most"])
def test_over_clusters_an_area_counts_fewer_recordings_by_obuchowskis_design_effect(first):
    numbers = generator(1, "effect")
    of_healthy, of_nodule = np.repeat(np.arange(6), 3), np.repeat(np.arange(first, first + 5), 2)
    level = numbers.normal(size=11)
    healthy = level[of_healthy] + 0.3 * numbers.normal(size=18)
    nodule = 1 + level[of_nodule] + 0.3 * numbers.normal(size=10)
    below = np.array([np.mean(nodule > score) for score in healthy])
    above = np.array([np.mean(healthy < score) for score in nodule])
    # DeLong (1988) without clusters, and Obuchowski (1997) with them.
    alone = below.var(ddof=1) / 18 + above.var(ddof=1) / 10
    sums = math.sqrt(6 / 5) * np.bincount(of_healthy, below - below.mean(), 11) / 18
    sums += math.sqrt(5 / 4) * np.bincount(of_nodule, above - below.mean(), 11) / 10
    student = intervals.student_factor(5, 0.95)
    factor = student / max(sums @ sums / alone, 1.0)
    units = [Units(np.ones(each.size), each) for each in (of_healthy, of_nodule)]
    area, *ends = intervals.auc_interval(healthy, nodule, units, 0.95)
    assert area == pytest.approx(below.mean())
    assert_newcombe(area, ends, 18 * factor, 10 * factor)
    # Weights count relative to each other.
    shared = [Units(each.weights / 3, each.clusters) for each in units]
    assert intervals.auc_interval(healthy, nodule, shared, 0.95) == pytest.approx((area, *ends))
    # An area of 1 rests on the numbers of clusters, and two clusters of a kind tell nothing.
    area, *ends = intervals.auc_interval(healthy, nodule + 99, units, 0.95)
    assert area == 1.0
    assert_newcombe(1.0, ends, 6 * student, 5 * student)
    few = Units(np.ones(18), of_healthy // 3)
    assert np.isnan(intervals.auc_interval(healthy, nodule, (few, units[1]), 0.95)[1:]).all()
    # Kills: sums of weights whose rounding makes an area of 1 differ from 1, or its parts from each
    # other.
    passes = np.repeat(np.arange(6), [3, 7, 1, 6, 5, 3]), 7 + np.repeat(range(5), [7, 3, 6, 7, 1])
    drawn = numbers.normal(size=25), 99 + numbers.normal(size=24)
    assert intervals.auc_interval(*drawn, [*map(Units.of_places, passes)], 0.95) == (1.0, *ends)


@given(st.lists(st.tuples(st.sampled_from([0.0, 0.25, 1.0]), st.integers(0, 6)), min_size=1), LEVEL)
def test_every_interval_holds_its_value(drawn, level):
    shares, clusters = np.array(drawn).T
    of_one = rate_of, intervals.mean_interval, intervals.median_interval
    for units in (Units.of_places(clusters.astype(int)), places_of(shares.size)):
        made = [interval(shares, units, level) for interval in of_one]
        made += [intervals.gain_interval(0 * shares, to, units, level) for to in (shares, -shares)]
        for value, low, high in made:
            assert math.isnan(low) == math.isnan(high)
            assert math.isnan(low) or low <= value <= high
