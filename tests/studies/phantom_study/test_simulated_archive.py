"""Simulated archives: motion, verdicts, signals as they are described, and faults of a bench."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import study_phantom
import yaml
from phantom_study import draw, simulated_archive
from phantom_study.paper_table import read_paper_table

from capsule.engine.configuration import read_config_file
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.origami import sensor_offsets
from capsule.phantom.parameters import value_of
from capsule.store.files import read_csv
from support.documents import text_of
from support.project import ROOT

pytestmark = pytest.mark.takes(0.2)

PHANTOM = read_phantom(DEFAULT_TABLE, [])
SEARCHED = simulated_archive.quick(simulated_archive.read_detector())
DETECTOR = replace(SEARCHED, fit=SEARCHED.fit | {"particles": 50, "iterations": 50})
PAPER = read_paper_table()


@pytest.fixture(scope="module")
def made():
    """Return the runs of an archive, their matrices and their templates."""
    archive = simulated_archive.simulate_archive(PHANTOM, 3, 4)
    matrices = simulated_archive.archive_matrices(archive, DETECTOR)
    return archive, matrices, simulated_archive.learn(matrices, DETECTOR)


def test_an_archive_is_judged_with_templates_from_its_own_runs(made):
    archive, matrices, templates = made
    # Every size, thinned by the stride.
    assert [matrix.shape for matrix in matrices.values()] == [(4, 100)] * 6 * 4
    confusion, motion = simulated_archive.simulate_and_judge(PHANTOM, DETECTOR, PAPER, 4, 3)
    np.testing.assert_array_equal(confusion.sum(axis=1), 4)
    assert confusion[5, 2:].sum() > confusion[0, 2:].sum()
    np.testing.assert_array_equal(confusion, simulated_archive.classify(matrices, templates))
    assert motion == simulated_archive.archive_motion(archive, PHANTOM, PAPER)


def test_each_size_is_described_and_the_documentation_shows_what_was(made):
    archive, matrices, _ = made
    rows = draw.describe(*made, PHANTOM)
    assert [row["size_mm"] for row in rows] == ["0", "1", "2", "3", "4", "5"]
    spacings = [row["template_peak_spacing_samples"] for row in rows]
    assert spacings[0] == "" and all("-" in each for each in spacings[1:])
    row, names = rows[3], [f"3mm/r{number:02d}" for number in range(1, 5)]
    runs = [archive[name] for name in names]
    lengths = [run.time_s.size for run in runs]
    told = (row["shortest_samples"], row["longest_samples"], row["stopped_by_hand"])
    assert told == (min(lengths), max(lengths), 0)
    assert row["highest"] == round(max(float(matrices[name].max()) for name in names), 2)
    offsets_mm = sensor_offsets(PHANTOM.origami, 4)[:, np.newaxis]
    passed = [np.argmax(run.head_mm >= run.nodule_at_mm + offsets_mm, axis=1) for run in runs]
    assert row["passing_high_samples"] == round(np.percentile(np.diff(passed), 95))
    text = text_of("workflow/studies/phantom.md")
    for kept in read_csv(ROOT / "workflow/studies/results/phantom-signals.csv"):
        assert list(kept) == list(row)
        assert "| " + " | ".join(kept.values()) + " |" in text


def test_a_level_multiplies_what_it_is_about_and_a_fault_spoils_one_sensor_of_each_run(made):
    archive, *_ = made
    doubled = draw.varied(PHANTOM, ["sensor.noise"], 2.0)
    assert value_of(doubled, "sensor.noise") == 2 * value_of(PHANTOM, "sensor.noise")
    for parameters, _ in draw.VARIATIONS.values():
        assert draw.varied(PHANTOM, parameters, 1.0) == PHANTOM
    for fault in draw.FAULTS:
        faulty = draw.with_faults(archive, fault, 1)
        assert faulty.keys() == archive.keys()
        for name, run in faulty.items():
            changed = (run.counts != archive[name].counts).any(axis=1)
            assert np.count_nonzero(changed) == (fault != "none")
            for made, sound in zip(run.counts[changed], archive[name].counts[changed], strict=True):
                middle = int(np.median(sound))
                highest = middle + 1 if fault == "dead" else sound.max()
                assert (made.min(), made.max()) == (middle, highest)


def test_the_headline_has_the_specificity_the_recalls_and_the_means_over_the_papers_sizes():
    confusion = np.diag([8, 0, 0, 20, 20, 0])
    confusion[0, 1], confusion[5, 2] = 12, 20
    confusion[[1, 2], 0], confusion[[1, 2], 3] = [5, 2], [15, 18]
    assert draw.headline(confusion, PAPER) == {
        "specificity": 40.0, "recall 1 mm": 75.0, "recall 2 mm": 90.0,
        "exact size": 50.0, "within 1 mm": 72.5,
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.takes
def test_the_figures_and_tables_of_the_documentation_can_be_made(tmp_path, monkeypatch):
    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["study_phantom.py", *map(str, arguments)])
        study_phantom.main()

    table = tmp_path / "cells.csv"
    run("judge", "--archives", 2, "--runs", 2, "--quick", "--output", table)
    assert len(read_csv(table)) == 22
    monkeypatch.setattr(draw, "VARIATIONS", {"noise": (("sensor.noise",), (1, 32))})
    # How many signals are shown, and how good the templates are, does not matter here.
    monkeypatch.setattr(draw, "SHOWN_MM", (0, 5))
    monkeypatch.setattr(draw, "read_paper_table", lambda: replace(PAPER, runs=2))
    settings, config = read_config_file(simulated_archive.DEFAULT_CONFIG), tmp_path / "config.yaml"
    settings["fit"] |= {"particles": 20, "iterations": 20}
    config.write_text(yaml.safe_dump(settings), encoding="utf-8")
    paths = "--table", table, "--output", tmp_path, "--config", config
    run("draw", "--archives", 1, "--runs", 2, *paths)
    rows = read_csv(tmp_path / "phantom-sensitivity.csv")
    assert [row.pop("level") for row in rows] == ["1", "32", "none", "dead", "saturated"]
    assert [row.pop("variation") for row in rows] == 2 * ["noise"] + 3 * ["one faulty sensor"]
    # The calibrated bench without a fault is met twice, each time with the same templates.
    assert rows[0] == rows[2]
    assert len(read_csv(tmp_path / "phantom-signals.csv")) == 6
    for name in ("signals", "table", "sensitivity"):
        assert "<svg" in (tmp_path / f"phantom-{name}.svg").read_text(encoding="utf-8")
