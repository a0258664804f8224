"""The nearest template: distances by the literal formula, margins, lags, and what is unknown."""

import numpy as np
import pytest

from capsule.method.particle import Particle, render
from capsule.method.sliding import RepeatedParticle
from capsule.method.templates import (
    compare_templates,
    first_peak_sample,
    nearest_size,
    template_distances,
)
from capsule.seeding import generator
from support import literal


def test_distances_equal_the_literal_formula_and_a_gain_is_that_over_no_template():
    matrix, *templates = generator(1, "distances").random((4, 3, 24))
    sought = [RepeatedParticle(template) for template in templates]
    distances, gains, lags = compare_templates(matrix, sought)
    np.testing.assert_array_equal(template_distances(matrix, templates), distances)
    expected = [literal.sliding_rmse(matrix, template) for template in templates]
    np.testing.assert_allclose(distances, np.min(expected, axis=1), atol=1e-9)
    np.testing.assert_array_equal(lags, np.argmin(expected, axis=1) + 1)
    np.testing.assert_allclose(distances**2 * 3 * matrix.size, (matrix**2).sum() - gains)
    assert np.isnan(compare_templates(np.full((3, 24), np.nan), sought)).all()


def test_what_is_unknown_stays_unknown():
    known, unknown = np.ones((2, 10)), np.full((2, 10), np.nan)
    distances = template_distances(known, [0 * known, unknown])
    assert distances[0] == pytest.approx(np.sqrt(1 / 3))
    assert np.isnan(distances[1])
    assert nearest_size(distances, [0, 1]) == 0
    assert np.isnan(template_distances(unknown, [known])).all()
    assert np.isnan(nearest_size(np.array([np.nan, np.nan]), [0, 1]))
    assert np.isnan(nearest_size(np.array([]), []))
    # Of equal distances the smaller size wins.
    assert nearest_size(np.array([np.nan, 0.2, 0.1, 0.1]), [0, 2, 3, 4]) == 3


@pytest.mark.parametrize("shift", [0, 1, 33, -20])
def test_the_lag_tells_when_the_first_sensor_meets_the_nodule(shift):
    particle = Particle(np.ones(4), np.full(4, 0.2), np.full(3, 120.0), np.full(4, 20.0))
    template = render(particle, 150, 1000)
    rolled = np.roll(template, shift, axis=1)
    distances, _, lags = compare_templates(
        rolled, [RepeatedParticle(0 * rolled + 0.2), RepeatedParticle(template)]
    )
    assert nearest_size(distances, [0, 2.5]) == 2.5
    # Without a shift, the first peak of a template lies in column u, counted from 1.
    assert first_peak_sample(lags[1], 150, 1000) == 149 + shift
