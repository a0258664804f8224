"""The detector on simulated archives, and how it bears a bench that changes."""

import sys
from dataclasses import replace

import numpy as np
import pytest

import study_phantom
from capsule.phantom.parameters import value_of, with_values
from edges.files import read_csv
from edges.phantom import DEFAULT_TABLE, read_phantom
from phantom_study import draw_phantom, sensitivity, simulated_archive
from phantom_study.arguments import DEFAULT_CONFIG, detector_of

PHANTOM = read_phantom(DEFAULT_TABLE, [])
DETECTOR = simulated_archive.quick(detector_of(DEFAULT_CONFIG))


@pytest.fixture(scope="module")
def archive():
    return simulated_archive.simulate_archive(PHANTOM, 3, 4)


@pytest.fixture(scope="module")
def matrices(archive):
    return simulated_archive.archive_matrices(archive, DETECTOR)


def test_an_archive_has_every_size_thinned_by_the_stride(matrices):
    assert len(matrices) == 6 * 4
    assert {matrix.shape for matrix in matrices.values()} == {(4, 100)}


def test_a_run_that_is_stopped_by_hand_has_not_arrived(archive):
    sizes = [run.time_s.size for name, run in archive.items() if not name.startswith("0mm")]
    stopped = with_values(PHANTOM, {"advance.longest_samples": max(sizes)})
    share = simulated_archive.archive_motion(archive, stopped)["reaches the far side"]
    assert share == pytest.approx(100 * np.mean(np.array(sizes) < max(sizes)))
    assert share < 100


def test_passing_times_are_those_of_the_sensors(archive):
    """At a steady speed the sensors meet the nodule one after the other, a pitch apart."""
    run = archive["3mm/r01"]
    for speed, usual in ((0.4, 100), (1.0, 0), (0.2, 0)):
        steady = replace(run, time_s=np.arange(2000) / 10, head_mm=speed * np.arange(2000) / 10)
        assert (
            simulated_archive.archive_motion({"3mm/r01": steady}, PHANTOM)["Delta mu 100 to 250"]
            == usual
        )


def test_the_detector_tells_a_large_nodule_from_none(matrices):
    table = simulated_archive.resubstitution(matrices, DETECTOR)
    np.testing.assert_array_equal(table.sum(axis=1), 4)
    assert table[5, 2:].sum() > table[0, 2:].sum()
    np.testing.assert_array_equal(simulated_archive.resubstitution(matrices, DETECTOR), table)


def test_a_level_multiplies_what_it_is_about():
    doubled = sensitivity.varied(PHANTOM, "noise", 2.0)
    assert value_of(doubled, "sensor.noise") == 2 * value_of(PHANTOM, "sensor.noise")
    for variation in sensitivity.VARIATIONS:
        assert sensitivity.varied(PHANTOM, variation, 1.0) == PHANTOM


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
    with pytest.raises(ValueError, match="'wet' is none of none, dead, saturated"):
        sensitivity.with_fault(counts, "wet", 0, numbers)


def test_headline_rates_of_a_perfect_and_of_a_blind_detector():
    perfect = sensitivity.headline(20 * np.eye(6, dtype=int))
    assert set(perfect.values()) == {100.0}
    blind = np.zeros((6, 6), dtype=int)
    blind[:, 0] = 20
    assert sensitivity.headline(blind) == {
        "specificity": 100.0,
        "recall 1 mm": 0.0,
        "recall 2 mm": 0.0,
        "exact size": 0.0,
        "within 1 mm": 0.0,
    }


def test_the_figures_and_tables_of_the_documentation_can_be_made(tmp_path, monkeypatch, capsys):
    table = tmp_path / "cells.csv"
    command = ["study_phantom.py", "judge", "--archives", "2", "--runs", "2", "--quick"]
    command += ["--output", str(table)]
    monkeypatch.setattr(sys, "argv", command)
    study_phantom.main()
    assert len(read_csv(table)) == 22
    assert "mean absolute difference" in capsys.readouterr().out
    monkeypatch.setattr(draw_phantom, "LEVELS", {"noise": (1, 32)})
    command = ["study_phantom.py", "draw", "--archives", "1", "--runs", "2", "--table", str(table)]
    monkeypatch.setattr(sys, "argv", [*command, "--output", str(tmp_path)])
    study_phantom.main()
    rows = read_csv(tmp_path / "phantom-sensitivity.csv")
    assert [row["level"] for row in rows] == ["1", "32", "none", "dead", "saturated"]
    for name in ("signals", "table", "sensitivity"):
        assert "<svg" in (tmp_path / f"phantom-{name}.svg").read_text(encoding="utf-8")
