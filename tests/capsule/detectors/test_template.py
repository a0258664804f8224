"""The paper's detector on whole archives: recordings that are left out teach nothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from capsule.detectors.base import TrainingArchive
from capsule.detectors.template import NearestTemplate
from capsule.method.nearest_template import (
    compare_templates,
    first_peak_sample,
    index_of_largest,
    nearest_size,
    template_distances,
)
from capsule.method.particle import Particle, render
from capsule.method.sliding import RepeatedParticle, rmse_at_lag
from capsule.method.templates import build_templates
from capsule.seeding import generator
from support import literal
from support.paper_ranges import PAPER
from support.training import recordings_of, verdict_values


def archive_of_matrices(matrices, sizes_mm, templates, particles, specificity):
    """Return an archive with matrices only."""
    settings = {"evaluation": {"specificity": specificity}}
    recordings = recordings_of(matrices=matrices)
    return TrainingArchive(sizes_mm, recordings, templates, particles, settings)


@pytest.fixture(scope="module")
def archive():
    """Return an archive of 8 healthy recordings, 6 of 1 mm and 2 of 3 mm, with particles."""
    numbers = generator(1, "archive")
    sizes = {f"{size}mm/r{run}": float(size) for size in (0, 1, 3) for run in range(8 - 2 * size)}
    drawn = PAPER.draw(len(sizes), 4, numbers)
    particles, matrices = {}, {}
    for name, vector in zip(sizes, drawn, strict=True):
        noise = np.maximum(numbers.normal(0.0, 0.05, (4, 1000)), 0.0)
        matrices[name] = noise
        if sizes[name] > 0:
            particles[name] = Particle.from_vector(vector)
            matrices[name] = noise + sizes[name] / 3 * render(particles[name], 150, 1000)
    by_size = {b: [p for n, p in particles.items() if sizes[n] == b] for b in (1.0, 3.0)}
    templates = build_templates(by_size, sensors=4, first_peak=150, length=1000)
    return sizes, particles, matrices, templates


def test_the_papers_verdict_is_the_papers(archive):
    sizes, particles, matrices, templates = archive
    taught = archive_of_matrices(matrices, sizes, templates, particles, 0.9)
    for name, size in sizes.items():
        left = templates.without([(size, particles.get(name))])
        expected = template_distances(matrices[name], left)
        by_rule = NearestTemplate.taught(taught, [name]).verdict(taught.recordings[name])
        np.testing.assert_array_equal(by_rule.distances, expected)
        assert by_rule.predicted_mm == nearest_size(expected, templates.sizes_mm)
        assert (by_rule.score > 0) == (by_rule.predicted_mm > 0)


def test_a_fold_that_changes_every_template_judges_by_its_own_templates(archive):
    sizes, particles, matrices, templates = archive
    taught = archive_of_matrices(matrices, sizes, templates, particles, 0.9)
    left_out = ["1mm/r0", "3mm/r0", "0mm/r0"]
    fold = templates.without([(sizes[name], particles.get(name)) for name in left_out])
    model = NearestTemplate.taught(taught, left_out)
    for name in left_out:
        expected = template_distances(matrices[name], fold)
        np.testing.assert_array_equal(model.verdict(taught.recordings[name]).distances, expected)


def test_a_margin_is_the_gain_over_no_template(archive):
    _, _, matrices, templates = archive
    matrix = matrices["3mm/r0"]
    sought = [RepeatedParticle(template) for template in templates.matrices[1:]]
    _, gains, lags = compare_templates(matrix, sought)
    for template, gain, lag in zip(templates.matrices[1:], gains, lags, strict=True):
        energy = (matrix**2).sum()
        rmse = rmse_at_lag(matrix, template, int(lag))
        assert rmse**2 * 4 * 3000 == pytest.approx(energy - gain)
    assert np.isnan(compare_templates(np.full((4, 1000), np.nan), sought)).all()


def test_without_a_nodule_there_is_no_margin(archive):
    sizes, _, matrices, _ = archive
    healthy = {name: size for name, size in sizes.items() if size == 0}
    nothing = build_templates({}, sensors=4, first_peak=150, length=1000)
    taught = archive_of_matrices(matrices, healthy, nothing, {}, 0.9)
    verdict = NearestTemplate.taught(taught).verdict(taught.recordings["0mm/r0"])
    assert np.isnan(verdict.score) and verdict.predicted_mm == 0


def test_it_judges_a_recording_of_no_archive_by_what_they_keep(archive):
    sizes, particles, matrices, templates = archive
    taught = archive_of_matrices(matrices, sizes, templates, particles, 0.9)
    learned = NearestTemplate.taught(taught)
    restored = NearestTemplate.restored(learned.stored(), templates)
    for name in ("0mm/r0", "3mm/r1"):
        recording = taught.recordings[name]
        expected = verdict_values(learned.verdict(recording))
        np.testing.assert_equal(verdict_values(restored.verdict(recording)), expected)


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
    assert index_of_largest(values) == expected


def test_the_lag_tells_when_the_first_sensor_meets_the_nodule():
    particle = Particle(np.ones(4), np.full(4, 0.2), np.full(3, 120.0), np.full(4, 20.0))
    template = render(particle, 150, 1000)
    rolled = np.roll(template, 33, axis=1)
    _, _, lags = compare_templates(rolled, [RepeatedParticle(template)])
    assert first_peak_sample(lags[0], 150, 1000) == 150 - 1 + 33


def test_a_found_nodule_has_the_nearest_size_and_the_place_of_its_template(archive):
    sizes, particles, matrices, templates = archive
    taught = archive_of_matrices(matrices, sizes, templates, particles, 0.9)
    found, model = 0, NearestTemplate.taught(taught)
    for name in sizes:
        verdict = model.verdict(taught.recordings[name])
        _, gains, lags = compare_templates(matrices[name], model.templates)
        assert verdict.score == max(gains[1:])
        assert (verdict.predicted_mm > 0) == (verdict.score > verdict.threshold)
        if verdict.predicted_mm > 0:
            found += 1
            best = int(np.argmax(gains[1:])) + 1
            assert verdict.estimate_mm == verdict.predicted_mm
            assert verdict.location_samples == first_peak_sample(lags[best], 150, 1000)
        else:
            assert np.isnan(verdict.estimate_mm) and np.isnan(verdict.location_samples)
    assert 0 < found < len(sizes)


def test_the_first_peak_comes_as_many_samples_later_as_the_template_is_shifted():
    for lag in (1, 7, 1001, 2000):
        assert first_peak_sample(lag, 150, 1000) == 149 + (lag - 1001)
    # Without a shift, the first peak of a template lies in column u, counted from 1.
    assert first_peak_sample(1001, 150, 1000) == 149
