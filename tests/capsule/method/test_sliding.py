from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.method.sliding import (
    RepeatedParticle,
    SlidingComparison,
    fast_length,
    rmse_at_lag,
)
from capsule.seeding import generator
from support import literal


@pytest.mark.parametrize(("sensors", "length"), [(4, 30), (3, 41), (1, 8), (2, 1)])
def test_every_lag_equals_the_literal_formula_and_the_paper_has_no_others(sensors, length):
    numbers, shape = generator(1, "pair"), (2, sensors, length)
    matrix, particle = numbers.random(shape) * numbers.choice(2, shape)
    expected = literal.sliding_rmse(matrix, particle)
    actual = [rmse_at_lag(matrix, particle, tau) for tau in range(1, 2 * length + 1)]
    np.testing.assert_allclose(actual, expected, atol=1e-14)
    for lag in (0, 2 * length + 1):
        with pytest.raises(ValueError, match=rf"outside 1\.\.{2 * length}"):
            rmse_at_lag(matrix, particle, lag)


@st.composite
def partly_filled_pairs(draw):
    """Draw a matrix and a particle, each 0 outside some columns of its own."""
    sensors, length = draw(st.integers(1, 5)), draw(st.integers(1, 1000))
    numbers = generator(draw(st.integers(0, 2**32)), "partly filled")
    pair = numbers.random((2, sensors, length))
    for array in pair:
        # Both ends are included: no column, one column, either edge and the whole width occur.
        ends = st.integers(0, length) | st.sampled_from([0, 1, length - 1, length])
        first, end = sorted([draw(ends), draw(ends)])
        array[:, :first] = array[:, end:] = 0.0
    return pair


@given(partly_filled_pairs(), st.sampled_from([1.0, -1.0]), st.integers(0, 2**32))
def test_of_all_lags_the_best_is_found_whatever_the_signs_and_the_columns(pair, sign, seed):
    matrix, particle = pair * generator(seed, "signs").choice([1.0, sign], pair.shape)
    repeated = RepeatedParticle(particle)
    gain, lag = SlidingComparison(matrix).gain_of(repeated)
    # Its spectra are kept by the widths of the recordings, which differ.
    for recording in (matrix, np.roll(matrix, 1, axis=1), matrix):
        comparison = SlidingComparison(recording, at_once=4)
        # Particles drawn earlier, which stay behind the compared ones, must not matter.
        comparison.particles[...] = 7.0
        comparison.particles[1] = particle
        gains, lags = comparison.gains(2)
        assert SlidingComparison(recording).gain_of(repeated) == (gains[1], lags[1])
    # The formula by correlation: |F' - P'|^2 at every shift, including the shift of -L.
    products = np.sum([*map(partial(np.correlate, mode="full"), matrix, particle)], axis=0)
    squares = np.sum(matrix**2) + np.sum(particle**2) - 2.0 * np.concatenate([[0.0], products])
    assert gain == pytest.approx(np.sum(matrix**2) - squares.min(), abs=1e-9)
    assert 1 <= lag <= 2 * matrix.shape[1]
    expected = np.sqrt(max(squares.min(), 0.0) / (3 * matrix.size))
    # The root doubles the digits that rounding takes from a distance of 0.
    rounding = 1e-9 if expected > 1e-6 else 1e-6
    assert rmse_at_lag(matrix, particle, lag) == pytest.approx(expected, abs=rounding)
    assert squares[lag - 1] == pytest.approx(squares.min(), abs=1e-9)


def test_a_fast_length_is_the_next_multiple_of_16_without_prime_factors_above_5():
    assert [*map(fast_length, (1, 16, 97, 240, 241, 321))] == [16, 16, 128, 240, 256, 384]
