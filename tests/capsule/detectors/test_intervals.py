"""Intervals of sizes hold the promised share of new sizes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.detectors.intervals import conformal_reach, size_interval
from capsule.seeding import generator

KNOWN_MM = (1.0, 2.0, 5.0)


def test_an_interval_holds_as_many_further_values_as_promised():
    errors = generator(1, "reach").standard_cauchy((5000, 30))
    held = [abs(row[-1]) <= conformal_reach(row[:-1], 0.9) for row in errors]
    # Of 30 exchangeable errors the rank is 27 of 29.
    assert np.mean(held) == pytest.approx(0.9, abs=0.015)


def test_too_few_errors_promise_nothing():
    assert conformal_reach(np.array([1.0, -3.0]), 0.5) == 3.0
    assert conformal_reach(np.arange(9.0), 0.9) == 8.0
    for few in (np.arange(8.0), np.array([])):
        assert conformal_reach(few, 0.9) == np.inf


@given(st.lists(st.integers(-5, 5), min_size=1, max_size=30), st.floats(0.05, 0.95))
def test_leaving_out_each_of_some_errors_in_turn_holds_the_promised_share(errors, share):
    errors = np.array(errors, dtype=np.float64)
    held = [
        abs(error) <= conformal_reach(np.delete(errors, place), share)
        for place, error in enumerate(errors)
    ]
    assert np.mean(held) >= share - 1e-9


@given(st.floats(1, 5), st.one_of(st.floats(0, 10), st.just(float("inf"))))
def test_an_interval_holds_its_estimate_and_is_cut_at_the_archives_sizes(estimate, reach):
    low, high = size_interval(estimate, reach, KNOWN_MM)
    assert KNOWN_MM[0] <= low <= estimate <= high <= KNOWN_MM[-1]
    assert low == max(estimate - reach, 1.0) and high == min(estimate + reach, 5.0)


def test_without_a_size_there_is_no_interval():
    assert np.isnan(size_interval(float("nan"), 1.0, KNOWN_MM)).all()
