"""The number of recordings that an interval needs, compared with the interval itself."""

from itertools import count

import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.evaluation.precision import recordings_needed, recordings_needed_within
from capsule.evaluation.rates import rate


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
def test_one_recording_fewer_would_not_do(expected, wanted, confidence):
    needed = recordings_needed(expected, wanted, confidence)
    assert half_width(expected, needed, confidence) <= wanted + 1e-9
    assert needed == 1 or half_width(expected, needed - 1, confidence) > wanted - 1e-9


def test_of_several_possible_rates_the_one_nearest_to_a_half_counts():
    assert recordings_needed_within(0.7, 0.97, 0.1, 0.95) == recordings_needed(0.7, 0.1, 0.95)
    assert recordings_needed_within(0.01, 0.2, 0.1, 0.95) == recordings_needed(0.2, 0.1, 0.95)
    assert recordings_needed_within(0.2, 0.9, 0.1, 0.95) == recordings_needed(0.5, 0.1, 0.95) == 93
