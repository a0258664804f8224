"""Templates are averages of particles, and the nearest one tells the size."""

import operator

import numpy as np
import pytest

from capsule.method import templates as method
from capsule.method.particle import Particle, peak_positions, render
from capsule.method.sliding import RepeatedParticle
from capsule.seeding import generator
from support import literal
from support.paper import PAPER


def particles(count, name="templates"):
    return [Particle.from_vector(v) for v in PAPER.draw(count, 4, generator(1, name))]


def test_amplitudes_and_spacings_are_averaged_and_spreads_by_their_variances():
    three = particles(3)
    by_name = dict(zip(["2mm/r01", "2mm/r00", "2mm/r02"], three, strict=True))
    assert method.by_size(by_name | {"unlabelled/r01": three[0]}) == {2.0: three}
    mean = method.total(three, sensors=4).mean()
    # Sigma of eq. barTheta holds variances: the mean of the sigmas themselves is smaller.
    for name, values in vars(mean).items():
        power = 2 if name.endswith("spread") else 1
        slowly = sum(getattr(particle, name) ** power for particle in three) / 3
        np.testing.assert_allclose(values, slowly ** (1 / power), rtol=1e-14)
    # Averaging the spacings averages the peaks' columns too, since these are their sums.
    columns = np.mean([peak_positions(p.peak_spacing, 150) for p in three], axis=0)
    np.testing.assert_allclose(peak_positions(mean.peak_spacing, 150), columns)


def test_templates_are_rendered_per_size_and_the_first_is_zero():
    sizes = {2.5: particles(3, "a"), 1.0: particles(3, "b"), 4.0: []}
    templates = method.build_templates(sizes, sensors=4, first_peak=150, length=1000)
    assert templates.sizes_mm == (0.0, 1.0, 2.5, 4.0)
    np.testing.assert_array_equal(templates.matrices[3], np.full((4, 1000), np.nan))
    assert templates.matrices[0].shape == (4, 1000) and not templates.matrices[0].any()
    expected = render(method.total(sizes[2.5], 4).mean(), 150, 1000)
    np.testing.assert_array_equal(templates.matrices[2], expected)
    # Without a recording, only its own size changes.
    *others, left_out, _ = templates.without([(2.5, sizes[2.5][0])])
    assert all(map(operator.is_, others, templates.matrices))
    expected = render(method.total(sizes[2.5][1:], 4).mean(), 150, 1000)
    np.testing.assert_allclose(left_out, expected, atol=1e-12)
    kept = templates.without([(0.0, sizes[2.5][0]), (1.0, None)])
    assert all(map(operator.is_, kept, templates.matrices))
    assert np.isnan(templates.without((2.5, each) for each in sizes[2.5])[2]).all()


def test_distances_equal_the_literal_formula_and_a_gain_is_that_over_no_template():
    matrix, *templates = generator(1, "distances").random((4, 3, 24))
    sought = [RepeatedParticle(template) for template in templates]
    distances, gains, lags = method.compare_templates(matrix, sought)
    np.testing.assert_array_equal(method.template_distances(matrix, templates), distances)
    expected = [literal.sliding_rmse(matrix, template) for template in templates]
    np.testing.assert_allclose(distances, np.min(expected, axis=1), atol=1e-9)
    np.testing.assert_array_equal(lags, np.argmin(expected, axis=1) + 1)
    np.testing.assert_allclose(distances**2 * 3 * matrix.size, (matrix**2).sum() - gains)
    assert np.isnan(method.compare_templates(np.full((3, 24), np.nan), sought)).all()


def test_what_is_unknown_stays_unknown():
    known, unknown = np.ones((2, 10)), np.full((2, 10), np.nan)
    distances = method.template_distances(known, [0 * known, unknown])
    assert distances == pytest.approx([np.sqrt(1 / 3), np.nan], nan_ok=True)
    assert np.isnan(method.template_distances(unknown, [known])).all()
    assert np.isnan(method.nearest_size(distances[1:], [0]))
    assert np.isnan(method.nearest_size(distances[:0], []))
    # Of equal distances the smaller size wins.
    assert method.nearest_size(np.array([np.nan, 0.2, 0.1, 0.1]), [0, 2, 3, 4]) == 3


@pytest.mark.parametrize("shift", [0, 1, 33, -20])
def test_the_lag_tells_when_the_first_sensor_meets_the_nodule(shift):
    particle = Particle(np.ones(4), np.full(4, 0.2), np.full(3, 120.0), np.full(4, 20.0))
    template = render(particle, 150, 1000)
    rolled = np.roll(template, shift, axis=1)
    sought = [RepeatedParticle(each) for each in (0 * rolled + 0.2, template)]
    distances, _, lags = method.compare_templates(rolled, sought)
    assert method.nearest_size(distances, [0, 2.5]) == 2.5
    # Without a shift, the first peak of a template lies in column u, counted from 1.
    assert method.first_peak_sample(lags[1], 150, 1000) == 149 + shift
