"""Tests of the evidence on the page: particles are drawn where the comparison found them."""

import numpy as np

from capsule.page import judged_by
from capsule.particles import Particle, render
from capsule.sliding import rmse_at_lag

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
