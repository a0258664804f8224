"""Held-out sessions judge and teach nothing; what does not depend on them is not made again."""

import json

import pytest

from capsule.store import files
from support.project import Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

HELD_OUT = ["0mm/r03", "3mm/r03"]
TEACHING = ["0mm/r01", "0mm/r02", "1mm/r01", "3mm/r01", "3mm/r02"]
TABLES = ["results/templates.npz", "results/recordings.csv"]


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """Return a project after a run in which a session was held out."""
    folder = tmp_path_factory.mktemp("held_out") / "project"
    made = Project.create(folder, [*TEACHING, *HELD_OUT], 400, particles=10, iterations=10)
    for name in HELD_OUT:
        path = made.raw / f"{name}.csv"
        path.write_bytes(b"# session: spring\n# setup: one\n" + path.read_bytes())
    made.configure(evaluation={"held_out": ["spring"]})
    run = made.snakemake(*TABLES)
    assert run.status == 0, run.output
    assert run.jobs["fit"] == 3
    assert "evaluation.held_out" not in run.output
    return made


@pytest.fixture
def copied(project, tmp_path):
    return project.copy(tmp_path / "project")


def test_a_held_out_recording_is_listed_and_described_but_has_no_fit(project):
    rows = {row["recording"]: row for row in files.read_csv(project.results / "recordings.csv")}
    assert {name: rows[name]["session"] for name in rows} == {
        **dict.fromkeys(TEACHING, ""),
        **dict.fromkeys(HELD_OUT, "spring"),
    }
    assert rows["3mm/r03"]["setup"] == "one"
    assert (project.results / "matrices/3mm/r03.npy").exists()
    fits = {path.relative_to(project.results / "fits") for path in project.results.glob("fits/*/*")}
    assert {path.as_posix() for path in fits} == {
        f"{name}.json" for name in TEACHING if not name.startswith("0mm")
    }


def test_the_templates_are_those_of_an_archive_without_the_held_out_recordings(project, copied):
    for name in HELD_OUT:
        (copied.raw / f"{name}.csv").unlink()
    copied.configure(evaluation={"held_out": []})
    assert copied.snakemake("results/templates.npz").jobs["templates"] == 1
    before, after = project.result_bytes(), copied.result_bytes()
    for name in ("templates.npz", "templates.json"):
        assert after[name] == before[name]
    told = json.loads(before["templates.json"])["templates"]
    assert {entry["size_mm"]: entry["recordings"] for entry in told} == {0.0: 0, 1.0: 1, 3.0: 2}


def test_of_a_batch_only_the_recordings_that_teach_are_fitted(project, copied):
    copied.configure(recordings_per_job=100)
    assert copied.snakemake(*TABLES).jobs["fit"] == 2
    fits = json.loads((copied.results / "fits/3mm/batch.json").read_text(encoding="utf-8"))
    assert list(fits) == ["3mm/r01", "3mm/r02"]
    assert copied.result_bytes()["templates.npz"] == project.result_bytes()["templates.npz"]
    copied.configure(evaluation={"held_out": []})
    assert copied.snakemake("--dry-run", "results/templates.npz").jobs == {"fit": 1, "templates": 1}
