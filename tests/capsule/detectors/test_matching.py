import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from capsule.detectors.matching import (
    compare_templates,
    first_peak_sample,
    nearest_size,
    place_of_largest,
    template_distances,
)
from capsule.particles import Particle, render
from capsule.seeding import generator
from capsule.sliding import RepeatedParticle, SlidingComparison
from support import literal
from support.paper_ranges import PAPER


def test_distances_equal_the_literal_formula():
    numbers = generator(1, "distances")
    matrix, *templates = numbers.random((4, 3, 24))
    distances = template_distances(matrix, templates)
    expected = [literal.smallest_rmse(matrix, template) for template in templates]
    np.testing.assert_allclose(distances, expected, atol=1e-9)


def test_a_shifted_template_is_recognised_as_its_own_size():
    drawn = PAPER.draw(3, 4, generator(1, "sizes"))
    templates = [np.zeros((4, 1000))]
    templates += [render(Particle.from_vector(vector), 150, 1000) for vector in drawn]
    matrix = np.roll(templates[2], 40, axis=1)
    distances = template_distances(matrix, templates)
    assert nearest_size(distances, [0, 1, 2.5, 4]) == 2.5
    assert nearest_size(template_distances(0 * matrix, templates), [0, 1, 2.5, 4]) == 0


def test_what_is_unknown_stays_unknown():
    known, unknown = np.ones((2, 10)), np.full((2, 10), np.nan)
    distances = template_distances(known, [0 * known, unknown])
    assert distances[0] == pytest.approx(np.sqrt(1 / 3))
    assert np.isnan(distances[1])
    assert nearest_size(distances, [0, 1]) == 0
    assert np.isnan(template_distances(unknown, [known])).all()
    assert np.isnan(nearest_size(np.array([np.nan, np.nan]), [0, 1]))


def test_of_equal_distances_the_smaller_size_wins():
    assert nearest_size(np.array([0.2, 0.1, 0.1]), [0, 3, 4]) == 3


@given(arrays(np.float64, st.integers(0, 6), elements=st.floats(-3, 3) | st.just(np.nan)))
def test_the_largest_value_is_found_among_those_that_are_known(values):
    known = ~np.isnan(values)
    expected = int(np.nanargmax(values)) if known.any() else None
    assert place_of_largest(values) == expected


def test_the_lag_tells_when_the_first_sensor_meets_the_nodule():
    particle = Particle(np.ones(4), np.full(4, 0.2), np.full(3, 120.0), np.full(4, 20.0))
    template = render(particle, 150, 1000)
    rolled = SlidingComparison(np.roll(template, 33, axis=1))
    lags = compare_templates(rolled, [RepeatedParticle(template)]).lags
    assert first_peak_sample(lags[0], 150, 1000) == 150 - 1 + 33
