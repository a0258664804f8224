"""What the documentation says of the simulated signals is what the simulator gives."""

from pathlib import Path

import numpy as np
import pytest

from capsule.phantom import trial
from capsule.phantom.description import COLUMNS, describe
from capsule.phantom.geometry import sensor_offsets
from files import read_csv
from phantom_edges import DEFAULT_CONFIG, DEFAULT_TABLE, detector_of, read_phantom

ROOT = Path(__file__).resolve().parents[1]
PHANTOM = read_phantom(DEFAULT_TABLE, [])


@pytest.fixture(scope="module")
def described():
    detector = trial.quick(detector_of(DEFAULT_CONFIG))
    archive = trial.simulate_archive(PHANTOM, 3, 4)
    matrices = trial.archive_matrices(archive, detector)
    templates = trial.learn(matrices, detector)
    return archive, matrices, describe(archive, matrices, templates, PHANTOM)


def test_every_size_has_a_row_and_only_nodules_a_template(described):
    _, _, rows = described
    assert [row["size_mm"] for row in rows] == ["0", "1", "2", "3", "4", "5"]
    assert all(tuple(row) == COLUMNS for row in rows)
    assert rows[0]["template_peak_spacing_samples"] == ""
    assert all("-" in row["template_peak_spacing_samples"] for row in rows[1:])


def test_a_row_tells_lengths_heights_and_passing_times(described):
    archive, matrices, rows = described
    names = [f"3mm/r{number:02d}" for number in range(1, 5)]
    lengths = [archive[name].time_s.size for name in names]
    behind_mm = sensor_offsets(PHANTOM.origami, 4)
    passing = []
    for name in names:
        run = archive[name]
        moments = [np.argmax(run.head_mm >= run.nodule_at_mm + way) for way in behind_mm]
        passing += list(np.diff(moments))
    row = rows[3]
    assert (row["shortest_samples"], row["longest_samples"]) == (min(lengths), max(lengths))
    assert row["stopped_by_hand"] == 0
    assert row["highest"] == round(max(float(matrices[name].max()) for name in names), 2)
    assert row["passing_high_samples"] == round(np.percentile(passing, 95))


def test_the_documentation_shows_the_signals_that_were_described():
    text = (ROOT / "docs/phantom.md").read_text(encoding="utf-8")
    for row in read_csv(ROOT / "docs/phantom-signals.csv"):
        assert "| " + " | ".join(row.values()) + " |" in text
