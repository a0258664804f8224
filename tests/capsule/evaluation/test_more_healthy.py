"""What more healthy places bring, against thresholds that are drawn and set one by one."""

import numpy as np
import pytest

from capsule.detectors.calibrate import rank_threshold
from capsule.evaluation.more_healthy import MoreHealthy, with_more_healthy

SPECIFICITY = 0.95
DRAWS = 1500


def scores_of(healthy, nodules=40, seed=1, distance=1.5):
    """Draw scores of healthy places and of nodules that overlap with them."""
    numbers = np.random.default_rng(seed)
    return numbers.normal(size=healthy), numbers.normal(distance, 1.2, nodules)


def foreseen(healthy, nodules, more=20, places=None):
    places = np.arange(healthy.size) if places is None else places
    margins = nodules - rank_threshold(healthy, places, SPECIFICITY)
    return with_more_healthy(healthy, places, margins, more, SPECIFICITY)


def drawn_shares(healthy, nodules, more, places):
    """Draw mean and deviation, then further healthy scores, set the threshold and count nodules."""
    numbers = np.random.default_rng(2)
    _, place_of, passes = np.unique(places, return_inverse=True, return_counts=True)
    weights, count = 1 / passes[place_of], passes.size
    mean = np.average(healthy, weights=weights)
    deviation = np.sqrt(np.sum(weights * (healthy - mean) ** 2) / (count - 1))
    shares = []
    for _ in range(DRAWS):
        spread = deviation * np.sqrt((count - 1) / numbers.chisquare(count - 1))
        centre = numbers.normal(mean, spread / np.sqrt(count))
        scores = np.append(healthy, numbers.normal(centre, spread, more))
        every = np.append(places, places.max() + 1 + np.arange(more))
        shares.append(np.mean(nodules > rank_threshold(scores, every, SPECIFICITY)))
    return np.array(shares)


@pytest.mark.parametrize(
    "places",
    [
        np.arange(19),
        np.arange(20),
        np.arange(40),
        np.repeat(np.arange(20), 2),
        np.append(np.arange(21), [20, 20]),
    ],
    ids=["19", "20", "40", "two passes", "three passes over the last place"],
)
def test_it_is_the_mean_and_the_range_over_thresholds_that_are_drawn(places):
    healthy, nodules = scores_of(places.size)
    told = foreseen(healthy, nodules, 20, places)
    shares = drawn_shares(healthy, nodules, 20, places)
    assert told.expected == pytest.approx(shares.mean(), abs=0.006)
    one = 1 / nodules.size
    low, high = np.quantile(shares, [0.05, 0.95])
    assert told.low + one == pytest.approx(low, abs=one + 1e-9)
    assert told.high - one == pytest.approx(high, abs=one + 1e-9)


@pytest.mark.parametrize("places", [np.arange(20), np.append(np.arange(30), [29, 29])])
def test_no_further_place_changes_nothing(places):
    healthy, nodules = scores_of(places.size)
    told = foreseen(healthy, nodules, 0, places)
    assert told.now == np.mean(nodules > rank_threshold(healthy, places, SPECIFICITY))
    assert told.expected == pytest.approx(told.now)
    assert 0 < told.now < 1


def test_nodules_far_above_all_healthy_places_leave_nothing_to_gain():
    healthy, nodules = scores_of(20, distance=60.0)
    told = foreseen(healthy, nodules)
    assert told.now == 1.0
    assert told.expected == pytest.approx(1.0, abs=1e-6)
    assert told.high == 1.0


def test_a_threshold_that_one_odd_recording_sets_is_expected_to_fall():
    healthy, nodules = scores_of(20, nodules=400)
    usual = foreseen(healthy, nodules)
    healthy[np.argmax(healthy)] = 4.0
    odd = foreseen(healthy, nodules)
    assert odd.now < 0.05
    assert odd.expected > odd.now + 0.15
    assert usual.expected - usual.now < 0.05


def test_the_more_places_set_the_threshold_the_less_one_expects_of_twenty_more():
    ranges = []
    for healthy in (20, 80, 320):
        told = [foreseen(*scores_of(healthy, 400, seed)) for seed in range(12)]
        ranges.append(np.mean([each.high - each.low for each in told]))
    assert ranges[0] > 1.5 * ranges[1] > 2 * ranges[2]


def test_neither_the_unit_of_the_scores_nor_their_order_matters():
    healthy, nodules = scores_of(25)
    told = foreseen(healthy, nodules)
    other = foreseen(1000 * healthy[::-1] - 7, 1000 * nodules[::-1] - 7)
    assert [*vars(other).values()] == pytest.approx([*vars(told).values()])


def test_a_nodule_with_a_higher_score_is_never_less_likely_found():
    healthy, nodules = scores_of(20)
    expected = [foreseen(healthy, nodules + shift).expected for shift in np.linspace(-2, 2, 9)]
    assert np.all(np.diff(expected) > 0)


def test_a_nodule_without_a_verdict_is_never_found():
    healthy, nodules = scores_of(20, distance=60.0)
    nodules[:10] = np.nan
    told = foreseen(healthy, nodules)
    assert told.now == told.expected == 0.75
    assert told.high == 0.75 + 1 / nodules.size


def test_too_little_foresees_nothing():
    healthy, nodules = scores_of(18)
    assert foreseen(healthy, nodules) is None
    places = np.repeat(np.arange(18), 2)
    assert foreseen(np.repeat(healthy, 2), nodules, places=places) is None
    healthy, nodules = scores_of(20)
    assert foreseen(healthy, nodules[:0]) is None
    assert foreseen(np.zeros(20), nodules) is None
    none = np.empty(0)
    assert with_more_healthy(none, none.astype(int), nodules, 20, SPECIFICITY) is None
    assert isinstance(foreseen(*scores_of(19)), MoreHealthy)


def test_what_is_certain_has_a_range_of_one_nodule_on_each_side():
    healthy, _ = scores_of(20)
    # Nodules far above all healthy places and far below them, in which nothing can change.
    for found, of in ((10, 20), (1, 4), (4, 4), (0, 4)):
        told = foreseen(healthy, np.repeat([60.0, -60.0], [found, of - found]))
        assert told.now == pytest.approx(found / of)
        assert told.expected == pytest.approx(found / of, abs=1e-6)
        assert told.low == pytest.approx(max((found - 1) / of, 0.0))
        assert told.high == pytest.approx(min((found + 1) / of, 1.0))


def test_a_nodule_just_above_all_present_places_is_the_less_certain_the_more_places_follow():
    healthy, _ = scores_of(20)
    expected = [
        foreseen(healthy, np.array([healthy.max() + 1e-9]), more).expected for more in (0, 1, 8, 18)
    ]
    # Of up to 38 places the highest score sets the threshold: one higher place loses the nodule.
    assert expected[0] == 1.0
    assert np.all(np.diff(expected) < 0)
    # Of 39 places it is the second highest, so one of them may lie above.
    assert foreseen(healthy, np.array([healthy.max() + 1e-9]), 19).expected > expected[-1]
