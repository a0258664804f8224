"""Tests of the templates on the page: those of the fold that judged, at their lag."""

import numpy as np
import pytest

from capsule.detectors.template import first_peak_sample
from capsule.page.nearest_templates import FoldParticles, nearest_template, nearest_templates
from capsule.particle import Particle, render
from capsule.sliding import SlidingComparison
from capsule.templates import build_templates, total

U, LENGTH, RATE_HZ = 30, 120, 10
SETTINGS = {
    "fit": {"first_peak": U},
    "preprocessing": {"length": LENGTH},
    "recording": {"rate_hz": RATE_HZ},
}
SIZES_MM = [0.0, 1.0, 3.0, 5.0]


def particle(height, spacing=40.0):
    return Particle(np.full(2, height), np.full(2, 0.3), np.array([spacing]), np.full(2, 8.0))


BY_SIZE = {1.0: particle(0.2), 3.0: particle(1.0), 5.0: particle(2.0)}


def verdict(distances, lag=None, scheme="leave_one_out", detector="template"):
    at = None if lag is None else first_peak_sample(lag, U, LENGTH) / RATE_HZ
    return {"detector": detector, "scheme": scheme, "distances": distances, "location_s": at}


def found(verdicts, matrix=None, particles=BY_SIZE):
    by_scheme = nearest_templates(
        {"leave_one_out": particles}, verdicts, SIZES_MM, lambda: matrix, SETTINGS
    )
    return {scheme: (each.size_mm, each.lag) for scheme, each in by_scheme.items()}


def test_a_fold_has_the_templates_of_the_recordings_that_taught():
    by_size = {1.0: [particle(0.2)], 3.0: [particle(1.0), particle(0.8, 44.0)]}
    folds = FoldParticles({size: total(some, 2) for size, some in by_size.items()})
    everything = folds.without([])
    templates = build_templates(by_size, sensors=2, first_peak=U, length=LENGTH)
    for size, matrix in zip(templates.sizes_mm[1:], templates.matrices[1:], strict=True):
        assert np.allclose(render(everything[size], U, LENGTH), matrix)
    # Without its only recording a size has no template.
    fold = folds.without([(1.0, particle(0.2)), (3.0, particle(1.0))])
    assert list(fold) == [3.0]
    assert fold[3.0].to_vector() == pytest.approx(particle(0.8, 44.0).to_vector())
    assert folds.without([(3.0, particle(1.0)), (3.0, particle(0.8, 44.0))]).keys() == {1.0}


def test_the_nearest_template_is_the_one_that_leaves_the_least_over():
    particles = {1.0: particle(0.2), 3.0: particle(1.0), 5.0: particle(2.0)}
    matrix = render(particle(0.9), U, LENGTH)
    nearest = nearest_template(SlidingComparison(matrix), particles, U)
    assert nearest.size_mm == 3.0 and nearest.lag == LENGTH + 1


def test_without_a_template_none_is_nearest():
    assert nearest_template(SlidingComparison(np.ones((2, LENGTH))), {}, U) is None


@pytest.mark.parametrize("lag", [1, 77, LENGTH + 1, 2 * LENGTH])
def test_the_papers_verdict_tells_size_and_lag_without_a_comparison(lag):
    assert found([verdict([0.4, 0.3, 0.1, 0.2], lag)]) == {"leave_one_out": (3.0, lag)}


def test_of_equal_distances_the_first_counts_as_in_the_comparison():
    assert found([verdict([0.1, 0.3, 0.2, 0.2], 9)]) == {"leave_one_out": (3.0, 9)}


def test_a_size_without_a_template_is_not_the_nearest():
    assert found([verdict([0.4, None, 0.3, 0.2], 9)]) == {"leave_one_out": (5.0, 9)}


def test_without_a_nodule_found_only_the_nearest_template_is_compared():
    # The matrix is nearest to 3 mm, so a comparison with all sizes would not return 5 mm.
    matrix = render(particle(0.9), U, LENGTH)
    assert found([verdict([0.1, 0.4, 0.3, 0.2])], matrix) == {"leave_one_out": (5.0, LENGTH + 1)}


def test_without_a_verdict_of_the_papers_detector_all_templates_are_compared():
    matrix, wanted = render(particle(0.9), U, LENGTH), (3.0, LENGTH + 1)
    others = [
        verdict([], 9, detector="diagonal"),
        verdict([0.1, 0.2, 0.2, 0.1], 9, scheme="resubstitution"),
        verdict([None] * 4),
    ]
    for verdicts in ([], others[:1], others[1:2], others):
        assert found(verdicts, matrix) == {"leave_one_out": wanted}


def test_a_scheme_without_any_template_has_none():
    assert found([verdict([0.1, None, None, None])], particles={}) == {}
