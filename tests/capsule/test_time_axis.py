"""Each sample gets the column of its time, for any fault of the clock."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.errors import RecordingError
from capsule.time_axis import columns_by_time

RULES = {"rate_hz": 10, "rate_tolerance": 0.05, "stretch": 84, "length": 1000}
SAMPLES = 520
EVEN = np.arange(SAMPLES) * 0.1


def jittered(time_s, seed, spread_s=0.025):
    """Return times moved by random jitter; two that would change places keep theirs."""
    moved = time_s + np.random.default_rng(seed).normal(0.0, spread_s, time_s.size)
    moved[[0, -1]] = time_s[[0, -1]]
    while np.any(wrong := np.diff(moved) <= 0.001):
        swapped = np.flatnonzero(wrong)
        moved[swapped], moved[swapped + 1] = time_s[swapped], time_s[swapped + 1]
    return np.round(moved, 3)


@pytest.mark.parametrize("seed", range(40))
def test_jitter_invents_no_samples(seed):
    columns = columns_by_time(jittered(EVEN, seed), **RULES)
    np.testing.assert_array_equal(columns, np.arange(SAMPLES))


@pytest.mark.parametrize("seed", range(40))
def test_jitter_hides_no_gap_and_moves_it_by_its_own_extent_only(seed):
    kept = np.delete(np.arange(SAMPLES), [*range(60, 75), *range(200, 210), 400, 401])
    columns = columns_by_time(jittered(EVEN[kept], seed), **RULES)
    assert columns[-1] == SAMPLES - 1
    clear = np.min(np.abs(kept[:, None] - [60, 74, 200, 209, 400]), axis=1) > 5
    np.testing.assert_array_equal(columns[clear], kept[clear])
    assert np.max(np.abs(columns - kept)) <= 2


@given(st.sets(st.integers(1, 298), max_size=60), st.floats(-0.04, 0.04), st.floats(-1e6, 1e6))
def test_samples_that_never_came_shift_nothing_whatever_the_clock(lost, slow, start):
    kept = np.delete(np.arange(300), sorted(lost))
    columns = columns_by_time(start + kept * 0.1 * (1.0 + slow), **RULES)
    np.testing.assert_array_equal(columns, kept)


@pytest.mark.parametrize("rate_hz", [36, 100, 300])
def test_time_that_is_rounded_to_the_millisecond_does_not_drift(rate_hz):
    time_s = np.round(np.arange(5000) / rate_hz, 3)
    columns = columns_by_time(time_s, **RULES | {"rate_hz": rate_hz, "length": 5000})
    np.testing.assert_array_equal(columns, np.arange(5000))


def test_a_pause_of_half_an_interval_opens_no_more_than_one_column():
    columns = columns_by_time(EVEN + 0.05 * (np.arange(SAMPLES) >= 200), **RULES)
    np.testing.assert_array_equal(columns[:200], np.arange(200))
    assert set(np.diff(columns)) <= {1, 2}
    assert columns[-1] <= SAMPLES


def two_rates(second_hz, first=0.6):
    steps = np.where(np.arange(SAMPLES - 1) < first * SAMPLES, 0.1, 1.0 / second_hz)
    return np.concatenate([[0.0], np.cumsum(steps)])


@pytest.mark.parametrize("second_hz", [4, 5, 8, 9, 11, 12.5, 20, 100])
def test_a_rate_that_changes_within_is_told(second_hz):
    with pytest.raises(RecordingError, match=r"the sampling rate changes: .*cut the file there"):
        columns_by_time(two_rates(second_hz), **RULES)


@pytest.mark.parametrize("second_hz", [20, 100])
def test_a_change_too_short_for_a_rate_of_its_own_is_told_by_count_and_duration(second_hz):
    time_s = two_rates(second_hz, first=0.95)
    with pytest.raises(RecordingError, match=r"too many samples for their time: .*correct time_s"):
        columns_by_time(time_s, **RULES)


def test_more_samples_than_the_time_has_room_for_are_told():
    time_s = np.sort(np.concatenate([EVEN, EVEN[200:215] + 0.05]))
    with pytest.raises(RecordingError, match=r": 204 samples up to 20\.15 s, but 10 Hz give"):
        columns_by_time(time_s, **RULES)
