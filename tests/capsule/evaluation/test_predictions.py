"""The verdicts of the configured detectors on an archive, row by row."""

from dataclasses import replace

import numpy as np
import pytest

from capsule.detectors.passage import Passage
from capsule.detectors.training import TrainingArchive
from capsule.evaluation.folds import Folds
from capsule.evaluation.predictions import Detectors, by_folds, parts_of
from capsule.particles import Particle, render
from capsule.seeding import generator
from capsule.templates import build_templates

SIZES_MM = {"0mm/a": 0.0, "0mm/b": 0.0, "0mm/c": 0.0, "2mm/a": 2.0, "2mm/b": 2.0}
SETTINGS = {
    "detectors": ["diagonal", "template_threshold", "template"],
    "recording": {"rate_hz": 10},
    "diagonal": {"size_ridge": 1.0},
    "evaluation": {"specificity": 0.6, "prevalence": 0.5, "size_confidence": 0.9},
}


def passage(evidence):
    return Passage(evidence, *[evidence] * 3, 10.0, 200.0, 130.0, *[1.0] * 3)


@pytest.fixture(scope="module")
def archive():
    numbers = generator(1, "predictions")
    particles, matrices = {}, {}
    for name, size in SIZES_MM.items():
        matrices[name] = np.maximum(numbers.normal(0.0, 0.05, (2, 300)), 0.0)
        if size:
            spacing, height = numbers.integers(90, 110, 1).astype(float), numbers.uniform(0.8, 1.2)
            particle = Particle(np.full(2, height), np.full(2, 0.3), spacing, np.full(2, 9.0))
            particles[name] = particle
            matrices[name] += render(particle, 50, 300)
    by_size = {2.0: list(particles.values())}
    templates = build_templates(by_size, sensors=2, first_peak=50, length=300)
    passages = {name: passage(float(place)) for place, name in enumerate(SIZES_MM)}
    return TrainingArchive(SIZES_MM, templates, particles, passages, matrices.__getitem__, SETTINGS)


@pytest.fixture(scope="module")
def detectors(archive):
    return Detectors(archive)


def test_every_detector_has_a_row_in_the_order_of_the_configuration(detectors):
    rows = list(detectors.rows(["0mm/a", "2mm/b"], []))
    assert [row["detector"] for row in rows] == SETTINGS["detectors"] * 2
    assert [row["recording"] for row in rows] == ["0mm/a"] * 3 + ["2mm/b"] * 3
    assert all(row.keys() == {"recording", "detector", *detectors.columns} for row in rows)
    assert [row["predicted_mm"] for row in rows[3:]] == [2.0] * 3
    # 200 samples at 10 Hz.
    assert rows[3]["location_s"] == 20.0


def test_only_detectors_by_templates_have_distances_to_them(detectors):
    by_diagonal, by_threshold, by_rule = detectors.rows(["2mm/a"], [])
    assert (by_diagonal["rmse_0mm"], by_diagonal["rmse_2mm"]) == (None, None)
    assert by_rule["rmse_2mm"] < by_rule["rmse_0mm"]
    assert by_threshold["rmse_2mm"] == by_rule["rmse_2mm"]


def test_what_is_left_out_has_taught_nothing(detectors):
    with_all = list(detectors.rows(["2mm/a"], []))
    without = list(detectors.rows(["2mm/a"], ["2mm/a", "0mm/c"]))
    assert without[2]["rmse_2mm"] > with_all[2]["rmse_2mm"]
    assert without[0]["threshold"] < with_all[0]["threshold"]


def test_what_is_handed_on_is_what_all_recordings_teach(detectors):
    stored = detectors.stored()
    by_diagonal, by_threshold, _ = detectors.rows(["0mm/a"], [])
    assert stored["recordings"] == len(SIZES_MM)
    assert stored["diagonal"]["threshold"] == by_diagonal["threshold"]
    assert stored["margin_threshold"] == by_threshold["threshold"]


def test_each_fold_is_judged_by_the_others_and_listed_by_detector_recording_and_scheme(detectors):
    schemes = [Folds("leave_one_pair_out", list("xyxyz")), Folds("resubstitution", list(SIZES_MM))]
    rows = by_folds(detectors, SIZES_MM, schemes)
    assert [(row["detector"], row["recording"], row["scheme"]) for row in rows] == [
        (detector, name, folds.scheme)
        for detector in SETTINGS["detectors"]
        for name in SIZES_MM
        for folds in schemes
    ]
    assert all(row["size_mm"] == SIZES_MM[row["recording"]] for row in rows)
    (expected,) = list(detectors.rows(["2mm/a"], ["0mm/b", "2mm/a"]))[2:]
    (found,) = [
        row
        for row in rows
        if (row["recording"], row["detector"]) == ("2mm/a", "template") and "pair" in row["scheme"]
    ]
    assert found == expected | {"size_mm": 2.0, "scheme": "leave_one_pair_out"}


def test_the_parts_hold_every_fold_once_and_whole():
    names = [f"r{number}" for number in range(1200)]
    pairs = Folds("leave_one_pair_out", [str(number // 2) for number in range(1200)])
    schemes = [Folds("resubstitution", names), Folds("leave_one_out", names), pairs]
    parts = parts_of(schemes)
    assert len(parts) == 3
    for folds in schemes:
        found = [fold for part in parts for wanted, *fold in part if folds.scheme in wanted]
        assert sorted(place for judged, _ in found for place in judged) == list(range(1200))
        wanted = [(judged.tolist(), left.tolist()) for judged, left in folds.parts() if left.size]
        assert wanted == [(judged.tolist(), left.tolist()) for judged, left in found if left.size]
    # What both schemes compute of a recording is computed once.
    for part in parts:
        of_scheme = {}
        for (scheme,), judged, _ in part:
            of_scheme.setdefault(scheme, set()).update(judged.tolist())
        assert of_scheme["resubstitution"] == of_scheme["leave_one_out"]
    assert [len(part) for part in parts_of([Folds("resubstitution", names)])] == [1, 1, 1]
    assert parts_of([]) == []


def test_a_fold_of_several_schemes_is_judged_once():
    alone, sites = Folds("leave_one_out", list("abc")), Folds("leave_one_site_out", list("xyy"))
    ((first, *_), *others) = parts_of([alone, sites])[0]
    assert first == ["leave_one_out", "leave_one_site_out"]
    assert [schemes for schemes, *_ in others] == [["leave_one_out"]] * 2 + [["leave_one_site_out"]]


def test_the_order_in_which_the_parts_are_judged_changes_nothing(detectors):
    def backwards(judge, parts):
        return [judge(part) for part in reversed(list(parts))]

    schemes = [Folds("leave_one_out", list(SIZES_MM)), Folds("resubstitution", list(SIZES_MM))]
    rows, turned = (by_folds(detectors, SIZES_MM, schemes, way) for way in (map, backwards))
    assert str(turned) == str(rows)


def test_a_learning_curve_is_drawn_of_what_learns_a_threshold_without_templates(detectors):
    assert list(detectors.learners()) == ["diagonal"]


def test_what_cannot_be_judged_says_why_and_teaches_nothing(archive, detectors):
    reasons = {"0mm/c": "no wave on sensor_1"}
    without = Detectors(replace(archive, no_verdict=reasons, _made={}))
    for row in without.rows(["0mm/c"], []):
        assert row["no_verdict"] == "no wave on sensor_1"
        assert np.isnan([row["predicted_mm"], row["score"], row["threshold"]]).all()
        assert (row["rmse_0mm"], row["rmse_2mm"]) == (None, None)
    judged = zip(without.rows(["0mm/a"], []), detectors.rows(["0mm/a"], ["0mm/c"]), strict=True)
    for taught_without, left_out in judged:
        assert taught_without["threshold"] == left_out["threshold"]
