import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.particles import Particle, peak_positions, render
from capsule.seeding import generator
from support import literal
from support.paper_ranges import PAPER


@pytest.mark.parametrize(
    ("sensors", "length", "first_peak"), [(4, 200, 30), (3, 61, 9), (1, 20, 5)]
)
def test_rendering_equals_the_literal_formula(sensors, length, first_peak):
    numbers = generator(1, "render", str(sensors))
    amplitude = numbers.uniform(0.1, 1.5, sensors)
    vertical = numbers.uniform(0.2, 1.0, sensors)
    spacing = numbers.integers(5, 20, sensors - 1).astype(float) + 0.25  # averages may be fractions
    horizontal = numbers.uniform(1, 15, sensors)
    expected = literal.render(amplitude, vertical, spacing, horizontal, first_peak, length)
    particle = Particle(amplitude, vertical, spacing, horizontal)
    np.testing.assert_allclose(render(particle, first_peak, length), expected, atol=1e-14)


def test_peaks_lie_at_the_sums_of_the_spacings_and_are_as_high_as_the_amplitude():
    particle = Particle(
        np.array([1.5, 0.7, 1.0]),
        np.full(3, 0.1),
        np.array([40.0, 60.0]),
        np.array([5.0, 9.0, 2.0]),
    )
    np.testing.assert_array_equal(peak_positions(particle.peak_spacing, 10), [10, 50, 110])
    matrix = render(particle, first_peak=10, length=150)
    np.testing.assert_array_equal(matrix.argmax(axis=1) + 1, [10, 50, 110])
    np.testing.assert_allclose(matrix.max(axis=1), particle.amplitude)


@given(st.integers(1, 6), st.integers(0, 2**32))
def test_random_particles_lie_in_their_ranges(sensors, seed):
    drawn = PAPER.draw(50, sensors, generator(seed, "draw"))
    low, high = PAPER.bounds(sensors)
    assert drawn.shape == (50, 4 * sensors - 1)
    assert np.all((drawn >= low) & (drawn <= high))
    integers = drawn[:, 2 * sensors :]
    np.testing.assert_array_equal(integers, np.rint(integers))


def test_random_integers_reach_both_ends():
    drawn = PAPER.draw(20_000, 4, generator(1, "ends"))
    assert (drawn[:, 8:11].min(), drawn[:, 8:11].max()) == (100, 250)
    assert (drawn[:, 11:].min(), drawn[:, 11:].max()) == (1, 60)


def test_steps_have_the_papers_deviations_and_integers_stay_integers():
    steps = PAPER.draw_steps(40_000, 4, generator(1, "steps"))
    np.testing.assert_allclose(steps[:, :8].std(), 0.1, rtol=0.01)
    # A rounded standard normal has the variance 1 + 1/12.
    np.testing.assert_allclose(steps[:, 8:].std(), np.sqrt(13 / 12), rtol=0.01)
    np.testing.assert_array_equal(steps[:, 8:], np.rint(steps[:, 8:]))


def test_a_vector_gives_the_particle_back():
    vector = PAPER.draw(1, 4, generator(1, "vector"))[0]
    particle = Particle.from_vector(vector)
    assert particle.peak_spacing.shape == (3,)
    np.testing.assert_array_equal(particle.to_vector(), vector)
