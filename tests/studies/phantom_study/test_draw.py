"""The documentation describes the simulated signals correctly."""

from pathlib import Path

import numpy as np
import pytest
from phantom_study import simulated_archive
from phantom_study.draw import describe, examples
from phantom_study.simulated_archive import read_detector

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.origami import sensor_offsets
from capsule.store.files import read_csv

ROOT = Path(__file__).resolve().parents[3]
PHANTOM = read_phantom(DEFAULT_TABLE, [])


@pytest.fixture(scope="module")
def described():
    detector = simulated_archive.quick(read_detector())
    archive = simulated_archive.simulate_archive(PHANTOM, 3, 4)
    matrices = simulated_archive.archive_matrices(archive, detector)
    templates = simulated_archive.learn(matrices, detector)
    return archive, matrices, describe(archive, matrices, templates, PHANTOM)


def test_each_size_has_a_row_with_lengths_heights_passing_times_and_a_nodules_template(described):
    archive, matrices, rows = described
    assert [row["size_mm"] for row in rows] == ["0", "1", "2", "3", "4", "5"]
    spacings = [row["template_peak_spacing_samples"] for row in rows]
    assert spacings[0] == "" and all("-" in each for each in spacings[1:])
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


def test_an_example_is_the_run_with_the_middling_matrix(described):
    archive, matrices, _ = described
    (healthy, example) = examples(archive, matrices, (0, 3), window=84)
    assert healthy.title.startswith("0mm/")
    assert healthy.title.endswith("(no nodule)")
    sums = {name: matrices[name].sum() for name in matrices if name.startswith("3mm/")}
    assert sorted(sums.values())[2] == sums[example.title]
    assert example.run is archive[example.title]
    assert example.matrix is matrices[example.title]
    # The matrix is the envelope above the threshold, here of every tenth sample.
    high = example.envelope[:, ::10] > 1.0
    columns = high.shape[1]
    np.testing.assert_array_equal(example.matrix[:, :columns] > 0, high)


def test_the_documentation_shows_the_signals_that_were_described(described):
    _, _, rows = described
    text = (ROOT / "workflow/studies/phantom.md").read_text(encoding="utf-8")
    for row in read_csv(ROOT / "workflow/studies/results/phantom-signals.csv"):
        assert list(row) == list(rows[0])
        assert "| " + " | ".join(row.values()) + " |" in text
