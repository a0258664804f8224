"""The paper's detector on whole archives: recordings that are left out teach nothing."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.detectors.calibrate import rank_threshold
from capsule.detectors.matching import compare_templates, nearest_size, template_distances
from capsule.detectors.template import (
    NearestTemplate,
    NearestTemplateModel,
    TemplateMargin,
    TemplateMarginModel,
    margin_reach,
)
from capsule.particles import Particle, render
from capsule.seeding import generator
from capsule.sliding import RepeatedParticle, SlidingComparison, rmse_at_lag
from capsule.templates import build_templates
from support.paper_ranges import PAPER
from support.training import archive_of_matrices, verdict_values


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
    detector = NearestTemplate(taught)
    for name, size in sizes.items():
        left = templates.without(size, particles.get(name)) if size else templates.matrices
        expected = template_distances(matrices[name], left)
        by_rule = detector.without([name]).verdict(taught.recording(name))
        np.testing.assert_array_equal(by_rule.distances, expected)
        assert by_rule.predicted_mm == nearest_size(expected, templates.sizes_mm)
        assert (by_rule.score > 0) == (by_rule.predicted_mm > 0)


def test_a_fold_that_changes_every_template_judges_by_its_own_templates(archive):
    sizes, particles, matrices, templates = archive
    taught = archive_of_matrices(matrices, sizes, templates, particles, 0.9)
    left_out = ["1mm/r0", "3mm/r0", "0mm/r0"]
    fold = templates.without_all([(sizes[name], particles.get(name)) for name in left_out])
    model = NearestTemplate(taught).without(left_out)
    for name in left_out:
        expected = template_distances(matrices[name], fold)
        np.testing.assert_array_equal(model.verdict(taught.recording(name)).distances, expected)


def test_a_margin_is_the_gain_over_no_template(archive):
    _, _, matrices, templates = archive
    matrix = matrices["3mm/r0"]
    sought = [RepeatedParticle(template) for template in templates.matrices[1:]]
    compared = compare_templates(SlidingComparison(matrix), sought)
    for template, gain, lag in zip(
        templates.matrices[1:], compared.gains, compared.lags, strict=True
    ):
        energy = (matrix**2).sum()
        rmse = rmse_at_lag(matrix, template, int(lag))
        assert rmse**2 * 4 * 3000 == pytest.approx(energy - gain)
    unknown = compare_templates(SlidingComparison(np.full((4, 1000), np.nan)), sought)
    assert np.isnan([unknown.distances, unknown.gains, unknown.lags]).all()


@pytest.mark.parametrize("passes", [1, 3])
def test_the_folds_threshold_equals_that_of_all_margins_computed_anew(archive, passes):
    sizes, particles, matrices, templates = archive
    places = {name: f"{name[:3]}/{run // passes}" for run, name in enumerate(sizes)}
    taught = archive_of_matrices(matrices, sizes, templates, particles, 0.8)
    taught = replace(taught, places=places, _made={})
    detector = TemplateMargin(taught)
    healthy = [name for name, size in sizes.items() if size == 0]
    for left_out in (["1mm/r2"], ["0mm/r3"], ["1mm/r0", "3mm/r1", "0mm/r0"]):
        fold = templates.without_all([(sizes[n], particles.get(n)) for n in left_out])
        sought = [RepeatedParticle(template) for template in fold[1:]]
        margins = [
            np.nanmax(compare_templates(SlidingComparison(matrices[name]), sought).gains)
            for name in healthy
            if name not in left_out
        ]
        verdict = detector.without(left_out).verdict(taught.recording(left_out[0]))
        others = taught.place_numbers([name for name in healthy if name not in left_out])
        assert verdict.threshold == rank_threshold(np.array(margins), others, 0.8)


def test_both_detectors_judge_a_recording_of_no_archive_by_what_they_keep(archive):
    sizes, particles, matrices, templates = archive
    taught = archive_of_matrices(matrices, sizes, templates, particles, 0.9)
    for detector, model in (
        (NearestTemplate, NearestTemplateModel),
        (TemplateMargin, TemplateMarginModel),
    ):
        learned = detector(taught).without([])
        restored = model.restored(learned.stored(), templates)
        for name in ("0mm/r0", "3mm/r1"):
            recording = taught.recording(name)
            expected = verdict_values(learned.verdict(recording))
            np.testing.assert_equal(verdict_values(restored.verdict(recording)), expected)


def test_a_threshold_that_is_not_known_survives_the_file(archive):
    *_, templates = archive
    stored = {"margin_threshold": None}
    model = TemplateMarginModel.restored(stored, templates)
    assert np.isnan(model.threshold) and model.stored() == stored


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 9)), min_size=1, max_size=12))
def test_a_margin_changes_by_no_more_than_its_bound(drawn):
    """The bound holds for any recording, template and change of it."""
    numbers = generator(1, "reach", str(drawn))
    whole = np.maximum(numbers.normal(0.3, 0.2, (2, 60)), 0.0)
    fold = whole.copy()
    for sensor, column in drawn:
        fold[sensor % 2, 5 * column : 5 * column + 5] *= 1 + numbers.normal()
    matrix = np.maximum(numbers.normal(0.3, 0.3, (2, 60)), 0.0)
    gains = compare_templates(
        SlidingComparison(matrix), [RepeatedParticle(whole), RepeatedParticle(fold)]
    ).gains
    reach = margin_reach(np.array([np.linalg.norm(matrix)]), whole, fold)[0]
    assert abs(gains[1] - gains[0]) <= reach + 1e-9
