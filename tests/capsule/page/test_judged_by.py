"""Tests of the templates on the page: those of the fold that judged, at their lag."""

import numpy as np
import pytest

from capsule.page import judged_by
from capsule.particles import Particle, render
from capsule.sliding import SlidingComparison, rmse_at_lag
from capsule.templates import build_templates, total

U, LENGTH = 30, 120


def particle(height, spacing=40.0):
    return Particle(np.full(2, height), np.full(2, 0.3), np.array([spacing]), np.full(2, 8.0))


def drawn(surface, sensors, samples):
    """Draw a surface as the page does."""
    column, row = np.arange(samples), np.arange(sensors)
    heights = [
        np.exp(-0.5 * ((row[:, np.newaxis] - s) / vertical) ** 2)
        * amplitude
        * np.exp(-0.5 * ((column - peak) / horizontal) ** 2)
        for s, (amplitude, vertical, peak, horizontal) in enumerate(
            zip(*(surface[k] for k in ("amplitude", "vertical", "peak", "horizontal")), strict=True)
        )
    ]
    inside = (column >= surface["from"]) & (column < surface["to"])
    return np.max(heights, axis=0) * inside


def test_a_particle_is_drawn_where_the_comparison_found_it():
    rendered = render(particle(1.0), U, LENGTH)
    matrix = np.zeros_like(rendered)
    matrix[:, 25:] = rendered[:, :-25]
    lag = min(range(1, 2 * LENGTH + 1), key=lambda tau: rmse_at_lag(matrix, rendered, tau))
    surface = judged_by.surface(particle(1.0), U, lag, LENGTH)
    assert np.allclose(drawn(surface, 2, 100), matrix[:, :100], atol=1e-4)


def test_a_fold_has_the_templates_of_the_recordings_that_taught():
    by_size = {1.0: [particle(0.2)], 3.0: [particle(1.0), particle(0.8, 44.0)]}
    totals = {size: total(some, 2) for size, some in by_size.items()}
    everything = judged_by.fold_particles(totals, [])
    templates = build_templates(by_size, sensors=2, first_peak=U, length=LENGTH)
    for size, matrix in zip(templates.sizes_mm[1:], templates.matrices[1:], strict=True):
        assert np.allclose(render(everything[size], U, LENGTH), matrix)
    # Without its only recording a size has no template.
    fold = judged_by.fold_particles(totals, [(1.0, particle(0.2)), (3.0, particle(1.0))])
    assert list(fold) == [3.0]
    assert fold[3.0].to_vector() == pytest.approx(particle(0.8, 44.0).to_vector())


def test_the_nearest_template_is_the_one_that_leaves_the_least_over():
    particles = {1.0: particle(0.2), 3.0: particle(1.0), 5.0: particle(2.0)}
    matrix = render(particle(0.9), U, LENGTH)
    nearest = judged_by.nearest_template(SlidingComparison(matrix), particles, U)
    assert nearest.size_mm == 3.0 and nearest.lag == LENGTH + 1
    left_over = np.sum((matrix - render(particle(1.0), U, LENGTH)) ** 2)
    assert nearest.gain == pytest.approx(np.sum(matrix**2) - left_over)


def test_without_a_template_none_is_nearest():
    assert judged_by.nearest_template(SlidingComparison(np.ones((2, LENGTH))), {}, U) is None
