"""The detectors on whole archives: what is left out teaches nothing."""

import numpy as np
import pytest

from capsule.detectors.diagonal import DiagonalDetector, fit_diagonal, size_features
from capsule.detectors.margin import first_peak_sample, template_margins
from capsule.detectors.matching import nearest_size, template_distances
from capsule.detectors.operating_point import threshold_at
from capsule.detectors.passage import UNKNOWN, Passage
from capsule.detectors.template import TemplateDetector
from capsule.evaluation.folds import Folds, group_scheme, header_groups
from capsule.particles import Particle, render
from capsule.seeding import generator
from capsule.sliding import rmse_at_lag
from capsule.templates import build_templates
from support.paper_ranges import PAPER

LEARNING = {"specificity": 0.9, "prevalence": 0.5, "size_ridge": 1.0}


def passage(score, size=0.0):
    return Passage(score, size, size, size, 10.0, 200.0, 130.0, *[np.exp(size)] * 3)


@pytest.fixture(scope="module")
def archive():
    """Matrices of 8 healthy recordings and of 4 a size, with particles as if fitted to them."""
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
    detector = TemplateDetector(templates, particles, sizes, matrices.__getitem__, 0.9)
    for name, size in sizes.items():
        left = templates.without(size, particles.get(name)) if size else templates.matrices
        expected = template_distances(matrices[name], left)
        distances, by_rule, _ = detector.judge(name, detector.without([name]))
        np.testing.assert_array_equal(distances, expected)
        assert by_rule.predicted_mm == nearest_size(expected, templates.sizes_mm)
        assert (by_rule.score > 0) == (by_rule.predicted_mm > 0)


def test_a_margin_is_the_gain_over_no_template(archive):
    _, _, matrices, templates = archive
    matrix = matrices["3mm/r0"]
    gains, lags = template_margins(matrix, templates.matrices[1:])
    for template, gain, lag in zip(templates.matrices[1:], gains, lags, strict=True):
        energy = (matrix**2).sum()
        rmse = rmse_at_lag(matrix, template, int(lag))
        assert rmse**2 * 4 * 3000 == pytest.approx(energy - gain)
    assert np.isnan(template_margins(np.full((4, 1000), np.nan), [matrix])).all()


def test_the_lag_tells_when_the_first_sensor_meets_the_nodule():
    particle = Particle(np.ones(4), np.full(4, 0.2), np.full(3, 120.0), np.full(4, 20.0))
    template = render(particle, 150, 1000)
    _, lags = template_margins(np.roll(template, 33, axis=1), [template])
    assert first_peak_sample(lags[0], 150, 1000) == 150 - 1 + 33


def test_the_folds_threshold_equals_that_of_all_margins_computed_anew(archive):
    sizes, particles, matrices, templates = archive
    detector = TemplateDetector(templates, particles, sizes, matrices.__getitem__, 0.8)
    healthy = [name for name, size in sizes.items() if size == 0]
    for left_out in (["1mm/r2"], ["0mm/r3"], ["1mm/r0", "3mm/r1", "0mm/r0"]):
        fold = templates.without_all([(sizes[n], particles.get(n)) for n in left_out])
        margins = [
            np.nanmax(template_margins(matrices[name], fold[1:])[0])
            for name in healthy
            if name not in left_out
        ]
        _, _, verdict = detector.judge(left_out[0], detector.without(left_out))
        assert verdict.threshold == threshold_at(np.array(margins), 0.8)


def test_a_recording_does_not_teach_its_own_verdict():
    sizes = {f"0mm/r{run}": 0.0 for run in range(10)} | {"1mm/r0": 1.0, "2mm/r0": 2.0}
    passages = {name: passage(0.1 * place, sizes[name]) for place, name in enumerate(sizes)}
    passages["0mm/r9"] = passage(9.0)
    detector = DiagonalDetector(passages, sizes, **LEARNING)
    alone = detector.judge("0mm/r9", ["0mm/r9"])
    assert alone.threshold == pytest.approx(0.8)
    assert alone.predicted_mm > 0
    assert detector.judge("0mm/r9", []).predicted_mm == 0
    without_a_size = detector.judge("2mm/r0", ["2mm/r0", "0mm/r9"])
    assert without_a_size.estimate_mm == 1.0


def test_an_unknown_passage_has_no_verdict_and_teaches_nothing():
    sizes = {"0mm/a": 0.0, "0mm/b": 0.0, "0mm/c": 0.0, "2mm/a": 2.0}
    passages = {"0mm/a": passage(0.1), "0mm/b": passage(0.2), "0mm/c": UNKNOWN}
    passages["2mm/a"] = passage(1.0, 2.0)
    detector = DiagonalDetector(passages, sizes, **LEARNING)
    assert np.isnan(detector.judge("0mm/c", ["0mm/c"]).predicted_mm)
    assert detector.judge("2mm/a", ["2mm/a"]).threshold == 0.2


def test_a_fold_teaches_the_diagonal_detector_what_learning_from_its_recordings_does():
    numbers = generator(1, "diagonal archive")
    sizes = {f"{place % 4}mm/r{place}": float(place % 4) for place in range(120)}
    passages = {
        name: passage(size / 2 + numbers.normal(), size + numbers.normal() / 4)
        for name, size in sizes.items()
    }
    passages["1mm/r5"] = UNKNOWN
    detector = DiagonalDetector(passages, sizes, **LEARNING)
    for left_out in ([], ["0mm/r0"], ["3mm/r7"], ["1mm/r5"], [n for n in sizes if n < "1mm/r4"]):
        taught = [name for name in sizes if name not in left_out]
        expected = fit_diagonal(
            np.array([passages[name].evidence for name in taught]),
            size_features([passages[name] for name in taught]),
            np.array([sizes[name] for name in taught]),
            known_mm=(1.0, 2.0, 3.0),
            **LEARNING,
        )
        for place in passages.values():
            said, wanted = (model.verdict(place) for model in (detector.model(left_out), expected))
            np.testing.assert_allclose(list(vars(said).values()), list(vars(wanted).values()))


def test_the_parts_of_the_folds_judge_everybody_once():
    for scheme, groups in (("leave_one_site_out", list("xyxz")), ("leave_one_out", list("abcd"))):
        folds = Folds(scheme, groups)
        for judged, left_out in folds.parts():
            for recording in judged:
                assert np.flatnonzero(~folds.training(recording)).tolist() == left_out.tolist()
        assert sorted(place for judged, _ in folds.parts() for place in judged) == [0, 1, 2, 3]
    ((judged, left_out),) = Folds("resubstitution", list("abcd")).parts()
    assert (judged.size, left_out.size) == (4, 0)


def test_groups_come_from_the_headers():
    names = ["a", "b", "c", "d"]
    headers = {"a": {"site": "x"}, "b": {"site": "x"}, "c": {"site": "y"}, "d": {}}
    folds = Folds(group_scheme("site"), header_groups("site", names, headers))
    assert folds.training(0).tolist() == [False, False, True, True]
    assert folds.training(3).tolist() == [True, True, True, False]
    assert header_groups("session", names, headers) is None
    assert header_groups("site", ["a", "b"], headers) is None
    assert Folds("resubstitution", names).training(1).all()
    assert Folds("leave_one_out", names).training(1).tolist() == [True, False, True, True]
