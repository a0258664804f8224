"""A session that is held out judges, and teaches nothing."""

import numpy as np
import pytest

from capsule import load
from capsule.store import files
from support.project import Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

HELD_OUT = "3mm/r03"
TEACHING = ["0mm/r01", "1mm/r01", "3mm/r01", "3mm/r02"]


def test_a_held_out_recording_is_listed_and_described_and_teaches_no_template(tmp_path):
    project = Project.create(tmp_path / "project", [*TEACHING, HELD_OUT], particles=9, iterations=9)
    path = project.raw / f"{HELD_OUT}.csv"
    path.write_bytes(b"# session: spring\n# setup: one\n" + path.read_bytes())
    project.configure(evaluation={"held_out": ["spring"]})
    run = project.snakemake("results/templates.npz", "results/recordings.csv")
    assert run.status == 0, run.output
    assert run.jobs["fit"] == 3
    assert "evaluation.held_out" not in run.output
    rows = {row["recording"]: row for row in files.read_csv(project.results / "recordings.csv")}
    assert (rows[HELD_OUT]["session"], rows[HELD_OUT]["setup"]) == ("spring", "one")
    assert (project.results / f"matrices/{HELD_OUT}.npy").exists()
    path.unlink()
    project.configure(evaluation={"held_out": []})
    alone = load(project.raw).templates
    with np.load(project.results / "templates.npz") as made:
        assert list(made) == ["0mm", "1mm", "3mm"]
        for name, expected in zip(made, alone.matrices, strict=True):
            np.testing.assert_array_equal(made[name], expected)
