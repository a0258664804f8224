"""Disturbances and faults of a bench after its templates were made change the rates."""

import numpy as np
from phantom_study import draw, simulated_archive
from phantom_study.paper_table import read_paper_table
from phantom_study.simulated_archive import read_detector

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.parameters import value_of

PHANTOM = read_phantom(DEFAULT_TABLE, [])
DETECTOR = simulated_archive.quick(read_detector())
PAPER = read_paper_table()


def test_a_level_multiplies_what_it_is_about():
    doubled = draw.varied(PHANTOM, ["sensor.noise"], 2.0)
    assert value_of(doubled, "sensor.noise") == 2 * value_of(PHANTOM, "sensor.noise")
    for parameters, _ in draw.VARIATIONS.values():
        assert draw.varied(PHANTOM, parameters, 1.0) == PHANTOM


def test_a_fault_spoils_one_sensor_of_each_run():
    archive = simulated_archive.simulate_archive(PHANTOM, 3, 2)
    assert draw.with_faults(archive, "none", 1).keys() == archive.keys()
    for fault in draw.FAULTS:
        for name, run in draw.with_faults(archive, fault, 1).items():
            sound = archive[name].counts
            changed = np.flatnonzero((run.counts != sound).any(axis=1))
            assert len(changed) == (fault != "none")
            for sensor in changed:
                middle = int(np.median(sound[sensor]))
                if fault == "dead":
                    assert set(run.counts[sensor]) == {middle, middle + 1}
                else:
                    assert run.counts[sensor].min() == middle
                    assert run.counts[sensor].max() == sound[sensor].max()


def test_the_headline_has_the_specificity_the_recalls_and_the_means_over_the_papers_sizes():
    confusion = 20 * np.eye(6, dtype=int)
    confusion[0] = [8, 12, 0, 0, 0, 0]
    confusion[1] = [5, 0, 0, 15, 0, 0]
    confusion[2] = [2, 0, 0, 18, 0, 0]
    confusion[5] = [0, 0, 20, 0, 0, 0]
    assert draw.headline(confusion, PAPER) == {
        "specificity": 40.0, "recall 1 mm": 75.0, "recall 2 mm": 90.0,
        "exact size": 50.0, "within 1 mm": 72.5,
    }  # fmt: skip


def test_a_sweep_uses_the_calibrated_templates_at_every_level_and_fault(monkeypatch):
    monkeypatch.setattr(draw, "VARIATIONS", {"noise": (("sensor.noise",), (1, 32))})
    rows = list(draw.sweep(PHANTOM, DETECTOR, PAPER, archives=1, runs=2))
    levels = [(row.pop("variation"), row.pop("level")) for row in rows]
    faults = [("one faulty sensor", fault) for fault in ("none", "dead", "saturated")]
    assert levels == [("noise", 1), ("noise", 32), *faults]
    # The calibrated bench without a fault is met twice.
    assert rows[0] == rows[2]
    archive = simulated_archive.simulate_archive(PHANTOM, 1, 2)
    taught = simulated_archive.archive_matrices(archive, DETECTOR)
    fresh = simulated_archive.archive_matrices(
        simulated_archive.simulate_archive(PHANTOM, 1001, 2), DETECTOR
    )
    confusion = simulated_archive.classify(fresh, simulated_archive.learn(taught, DETECTOR))
    assert rows[0] == draw.headline(confusion, PAPER)
