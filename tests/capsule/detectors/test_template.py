"""The paper's detector: its verdict is the paper's rule with the templates of its fold."""

import numpy as np
import pytest

from capsule.detectors.base import TrainingArchive
from capsule.detectors.template import NearestTemplate
from capsule.method.nearest_template import (
    compare_templates,
    first_peak_sample,
    nearest_size,
    template_distances,
)
from capsule.method.particle import Particle, render
from capsule.method.templates import build_templates
from capsule.seeding import generator
from support.paper_ranges import PAPER
from support.training import recordings_of


@pytest.fixture(scope="module")
def archive():
    """Return an archive of 8 healthy recordings, 6 of 1 mm and 2 of 3 mm, with particles."""
    numbers = generator(1, "archive")
    sizes = {f"{size}mm/r{run}": float(size) for size in (0, 1, 3) for run in range(8 - 2 * size)}
    particles, matrices = {}, {}
    for name, vector in zip(sizes, PAPER.draw(len(sizes), 4, numbers), strict=True):
        matrices[name] = np.maximum(numbers.normal(0.0, 0.05, (4, 1000)), 0.0)
        if sizes[name] > 0:
            particles[name] = Particle.from_vector(vector)
            matrices[name] += sizes[name] / 3 * render(particles[name], 150, 1000)
    by_size = {b: [p for n, p in particles.items() if sizes[n] == b] for b in (1.0, 3.0)}
    templates = build_templates(by_size, sensors=4, first_peak=150, length=1000)
    return TrainingArchive(sizes, recordings_of(matrices=matrices), templates, particles, {})


@pytest.mark.parametrize("left_out", [[], ["3mm/r1"], ["1mm/r0", "3mm/r0", "0mm/r0"]])
def test_the_verdict_is_the_papers_with_the_templates_of_the_fold(archive, left_out):
    templates = archive.templates
    fold = templates.without((archive.sizes_mm[n], archive.particles.get(n)) for n in left_out)
    model, found = NearestTemplate.taught(archive, left_out), 0
    for recording in archive.recordings.values():
        verdict, expected = model.verdict(recording), template_distances(recording.matrix, fold)
        np.testing.assert_array_equal(verdict.distances, expected)
        assert verdict.predicted_mm == nearest_size(expected, templates.sizes_mm)
        _, gains, lags = compare_templates(recording.matrix, model.templates)
        assert (verdict.score, verdict.threshold) == (max(gains[1:]), 0.0)
        if verdict.predicted_mm > 0:
            found += 1
            best = int(np.argmax(gains[1:])) + 1
            assert verdict.estimate_mm == verdict.predicted_mm
            assert verdict.location_samples == first_peak_sample(lags[best], 150, 1000)
    assert 0 < found < len(archive.sizes_mm)


def test_without_a_nodule_there_is_no_margin(archive):
    nothing = build_templates({}, sensors=4, first_peak=150, length=1000)
    taught = TrainingArchive({"0mm/r0": 0.0}, archive.recordings, nothing, {}, {})
    verdict = NearestTemplate.taught(taught).verdict(archive.recordings["0mm/r0"])
    assert np.isnan(verdict.score) and verdict.predicted_mm == 0
