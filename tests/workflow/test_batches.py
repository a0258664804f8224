"""Jobs of several recordings give the same results as jobs of one."""

import numpy as np
import pytest

from capsule.store.results import Results
from support.project import Project
from support.same_recordings import assert_same_recordings, results_of_all
from support.synthetic import write_archive

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
NAMES = ["0mm/r01", "1mm/r01", "2.5mm/r02"]
LIMITS = "_EACH_ALONE, _IN_TENS = 500, 5000"


def make(project, *targets):
    """Make some results, and return the run."""
    run = project.snakemake(*targets, cores=1)
    assert run.status == 0, run.output
    return run


def test_batches_give_the_same_bytes_and_a_bad_recording_costs_the_others_nothing(
    finished, new, tmp_path
):
    project = new.copy(tmp_path / "project")
    project.configure(recordings_per_job=2)
    (project.raw / "1mm/bad.csv").write_bytes(b"")
    run = make(project, *TABLES)
    assert "rejected: raw/1mm/bad: the file is empty" in run.output
    # Of four, three, two and one recordings in their folders.
    assert (run.jobs["preprocess"], run.jobs["fit"], run.jobs["describe"]) == (6, 3, 4)
    ours, theirs = results_of_all(project), results_of_all(finished)
    assert {"templates.npz", "evaluation/predictions.csv"} < ours.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []
    assert_same_recordings(project, finished, NAMES)
    rejected = Results.of_table(project.results, project.results / "recordings.csv")
    assert np.isnan(rejected.matrix("1mm/bad")).all()
    assert rejected.fits(["1mm/bad"])["1mm/bad"]["parameters"] is None
    assert project.snakemake(*TABLES).did_nothing


def test_a_run_says_that_the_archive_has_passed_a_limit(tmp_path):
    names = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in (1, 2)]
    project = Project.create(tmp_path / "project", names, 400, particles=10, iterations=10)
    path = project.folder / "workflow/scripts/capsule/store/batches.py"
    text = path.read_text(encoding="utf-8")
    assert LIMITS in text
    path.write_text(text.replace(LIMITS, "_EACH_ALONE, _IN_TENS = 4, 5000"), encoding="utf-8")
    assert "instead of" not in make(project, "results/recordings.csv").output
    write_archive(project.raw, ["3mm/r05"], samples=400)
    run = make(project, "results/recordings.csv")
    told = "5 recordings: each job now takes up to 16 instead of 1, so everything is made once"
    assert run.output.count(told) == 1
    assert run.jobs["preprocess"] == 2
    # Three files of each recording.
    told = "12 files are of recordings or batches that are gone, and are not used, such as results/"
    assert run.output.count(told) == 1
