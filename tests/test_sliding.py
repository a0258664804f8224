import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import literal
from capsule.particles import Particle, render
from capsule.seeding import generator
from capsule.sliding import SlidingComparison, rmse_at_lag
from test_particles import PAPER


def random_pair(sensors, length, seed):
    numbers = generator(seed, "pair")
    return numbers.random((2, sensors, length)) * (numbers.random((2, sensors, length)) > 0.5)


@pytest.mark.parametrize(("sensors", "length"), [(4, 30), (3, 41), (1, 8), (2, 1)])
def test_every_lag_equals_the_literal_formula(sensors, length):
    matrix, particle = random_pair(sensors, length, 1)
    expected = literal.sliding_rmse(matrix, particle)
    actual = [rmse_at_lag(matrix, particle, tau) for tau in range(1, 2 * length + 1)]
    np.testing.assert_allclose(actual, expected, atol=1e-14)


@given(st.integers(1, 5), st.integers(1, 40), st.integers(0, 2**32))
@settings(max_examples=60)
def test_the_minimum_equals_the_literal_formula(sensors, length, seed):
    matrix, particle = random_pair(sensors, length, seed)
    expected = literal.sliding_rmse(matrix, particle)
    rmse, lag = SlidingComparison(matrix).compare(particle)
    assert rmse == pytest.approx(min(expected), abs=1e-9)
    assert expected[lag - 1] == pytest.approx(min(expected), abs=1e-9)


def test_the_minimum_holds_at_the_papers_size():
    particle = render(Particle.from_vector(PAPER.draw(1, 4, generator(1, "a"))[0]), 150, 1000)
    matrix = np.roll(particle, 31, axis=1) + 0.1 * random_pair(4, 1000, 2)[0]
    values = [rmse_at_lag(matrix, particle, tau) for tau in range(1, 2001)]
    rmse, lag = SlidingComparison(matrix).compare(particle)
    assert lag == int(np.argmin(values)) + 1 == 1000 + 1 + 31
    assert rmse == pytest.approx(min(values), abs=1e-9)


def test_the_gain_is_what_a_particle_takes_off_the_energy():
    matrix, particle = random_pair(4, 25, 3)
    comparison = SlidingComparison(matrix)
    comparison.particle[...] = particle
    gain, lag = comparison.gain()
    mean_square = (np.sum(matrix**2) - gain) / (3 * matrix.size)
    assert np.sqrt(mean_square) == pytest.approx(rmse_at_lag(matrix, particle, lag), abs=1e-12)


@given(st.integers(1, 4), st.integers(1, 30), st.integers(0, 2**32))
@settings(max_examples=40)
def test_a_matrix_is_at_distance_0_from_itself(sensors, length, seed):
    matrix, _ = random_pair(sensors, length, seed)
    rmse, _ = SlidingComparison(matrix).compare(matrix)
    assert rmse == pytest.approx(0.0, abs=1e-9)


@given(st.integers(-10, 10), st.integers(0, 2**32))
@settings(max_examples=40)
def test_a_shift_that_stays_in_the_frame_changes_the_lag_only(shift, seed):
    matrix, particle = random_pair(3, 40, seed)
    for array in (matrix, particle):
        array[:, :12] = array[:, -12:] = 0.0
    rmse, _ = SlidingComparison(matrix).compare(particle)
    moved, moved_lag = SlidingComparison(matrix).compare(np.roll(particle, shift, axis=1))
    assert moved == pytest.approx(rmse, abs=1e-9)
    assert rmse_at_lag(matrix, particle, moved_lag + shift) == pytest.approx(rmse, abs=1e-9)
    assert rmse >= 0.0


def test_a_zero_particle_leaves_the_energy_of_the_recording():
    matrix, _ = random_pair(4, 20, 1)
    rmse, _ = SlidingComparison(matrix).compare(np.zeros_like(matrix))
    assert rmse == pytest.approx(np.linalg.norm(matrix) / np.sqrt(3 * matrix.size))


@pytest.mark.parametrize("lag", [0, 41])
def test_a_lag_outside_the_papers_range_is_refused(lag):
    with pytest.raises(ValueError, match=r"outside 1\.\.40"):
        rmse_at_lag(np.zeros((2, 20)), np.zeros((2, 20)), lag)
