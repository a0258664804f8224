"""Disturbances and faults of a bench after its templates were made change the rates."""

import numpy as np
import pytest
from phantom_study import sensitivity, simulated_archive
from phantom_study.paper_table import read_paper_table
from phantom_study.simulated_archive import read_detector

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.parameters import value_of

PHANTOM = read_phantom(DEFAULT_TABLE, [])
DETECTOR = simulated_archive.quick(read_detector())
PAPER = read_paper_table()


def test_a_level_multiplies_what_it_is_about():
    doubled = sensitivity.varied(PHANTOM, ["sensor.noise"], 2.0)
    assert value_of(doubled, "sensor.noise") == 2 * value_of(PHANTOM, "sensor.noise")
    for parameters, _ in sensitivity.VARIATIONS.values():
        assert sensitivity.varied(PHANTOM, parameters, 1.0) == PHANTOM


def test_faults_spoil_one_sensor_only():
    counts = np.arange(4 * 101).reshape(4, 101)
    numbers = np.random.default_rng(1)
    dead = sensitivity.with_fault(counts, "dead", 1, numbers)
    assert set(dead[1]) == {151, 152}
    saturated = sensitivity.with_fault(counts, "saturated", 2, numbers)
    assert saturated[2].min() == np.median(counts[2])
    assert saturated[2].max() == counts[2].max()
    for spoilt, sensor in ((dead, 1), (saturated, 2)):
        np.testing.assert_array_equal(np.delete(spoilt, sensor, 0), np.delete(counts, sensor, 0))
    np.testing.assert_array_equal(sensitivity.with_fault(counts, "none", 0, numbers), counts)
    with pytest.raises(ValueError, match="'wet' is not one of none, dead, saturated"):
        sensitivity.with_fault(counts, "wet", 0, numbers)


def test_headline_rates_of_a_perfect_and_of_a_blind_detector():
    perfect = sensitivity.headline(20 * np.eye(6, dtype=int), PAPER)
    assert set(perfect.values()) == {100.0}
    blind = np.zeros((6, 6), dtype=int)
    blind[:, 0] = 20
    assert sensitivity.headline(blind, PAPER) == {
        "specificity": 100.0,
        "recall 1 mm": 0.0,
        "recall 2 mm": 0.0,
        "exact size": 0.0,
        "within 1 mm": 0.0,
    }


def test_exact_and_tolerable_sizes_are_averaged_over_the_papers_sizes():
    confusion = 20 * np.eye(6, dtype=int)
    confusion[1] = [0, 0, 0, 20, 0, 0]
    confusion[2] = [0, 0, 0, 20, 0, 0]
    confusion[5] = [0, 0, 20, 0, 0, 0]
    rates = sensitivity.headline(confusion, PAPER)
    assert (rates["exact size"], rates["within 1 mm"]) == (50.0, 75.0)


def test_a_sweep_uses_the_calibrated_templates_at_every_level_and_fault(monkeypatch):
    monkeypatch.setattr(sensitivity, "VARIATIONS", {"noise": (("sensor.noise",), (1, 32))})
    rows = list(sensitivity.sweep(PHANTOM, DETECTOR, PAPER, archives=1, runs=2))
    assert [(row.pop("variation"), row.pop("level")) for row in rows] == [
        ("noise", 1),
        ("noise", 32),
        ("one faulty sensor", "none"),
        ("one faulty sensor", "dead"),
        ("one faulty sensor", "saturated"),
    ]
    # The calibrated bench without a fault is met twice.
    assert rows[0] == rows[2]
    archive = simulated_archive.simulate_archive(PHANTOM, 1, 2)
    taught = simulated_archive.archive_matrices(archive, DETECTOR)
    fresh = simulated_archive.archive_matrices(
        simulated_archive.simulate_archive(PHANTOM, 1001, 2), DETECTOR
    )
    confusion = simulated_archive.classify(fresh, simulated_archive.learn(taught, DETECTOR))
    assert rows[0] == sensitivity.headline(confusion, PAPER)
