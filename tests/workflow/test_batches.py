"""Jobs of several recordings give the same results as jobs of one."""

import os
import re
import signal

import numpy as np
import pytest

from capsule.store.batches import batches
from capsule.store.results import Results
from support.marks import needs_process_groups
from support.project import Project
from support.same_recordings import assert_same_recordings, results_of_all
from support.synthetic import write_archive

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

RECORDINGS = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in range(1, 5)]
TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
LIMITS = "_EACH_ALONE, _IN_TENS = 500, 5000"


@pytest.fixture(scope="module")
def new(tmp_path_factory):
    folder = tmp_path_factory.mktemp("new") / "project"
    return Project.create(folder, RECORDINGS, samples=400, particles=10, iterations=10)


def in_batches_of(most, original, folder):
    """Return a copy of a project with another number of recordings per job."""
    project = original.copy(folder)
    project.configure(recordings_per_job=most)
    return project


def make(project, **how):
    """Make the tables, and return the run."""
    run = project.snakemake(*TABLES, **how)
    assert run.status == 0, run.output
    return run


def times_of(project):
    """Return when each result of a batch was written."""
    kinds = ("signals", "matrices", "checks", "fits")
    paths = [path for kind in kinds for path in project.results.glob(f"{kind}/*/*")]
    return {path.relative_to(project.results).as_posix(): path.stat().st_mtime_ns for path in paths}


@pytest.fixture(scope="module")
def alone(new, tmp_path_factory):
    """Return a project after a run with a job for each recording."""
    project = new.copy(tmp_path_factory.mktemp("alone") / "project")
    assert make(project).jobs["preprocess"] == len(RECORDINGS)
    return project


@pytest.fixture(scope="module")
def in_threes(new, tmp_path_factory):
    """Return a project after a run with up to three recordings in a job."""
    project = in_batches_of(3, new, tmp_path_factory.mktemp("threes") / "project")
    make(project, cores=1)
    return project


def test_batches_give_the_same_bytes(alone, in_threes):
    assert results_of_all(in_threes) == results_of_all(alone)
    assert_same_recordings(in_threes, alone, RECORDINGS)
    assert in_threes.snakemake(*TABLES).did_nothing


def test_a_batch_is_one_job_and_one_file(alone, new, tmp_path):
    project = in_batches_of(100, new, tmp_path / "project")
    jobs = make(project).jobs
    assert (jobs["preprocess"], jobs["fit"], jobs["describe"]) == (2, 1, 2)
    kinds = ("signals/{}.npz", "matrices/{}.npz", "checks/{}.json")
    files = {kind.format(batch) for kind in kinds for batch in ("0mm/batch", "3mm/batch")}
    assert times_of(project).keys() == files | {"fits/3mm/batch.json"}
    assert results_of_all(project) == results_of_all(alone)


def test_a_new_recording_changes_only_its_own_batch(in_threes, tmp_path):
    project = in_threes.copy(tmp_path / "project")
    before, divided = times_of(project), batches(RECORDINGS, 3)
    write_archive(project.raw, ["3mm/r10"], samples=400)
    now = batches([*RECORDINGS, "3mm/r10"], 3)
    (changed,) = [batch for batch in now if now[batch] != divided.get(batch)]
    assert len(now[changed]) > 1
    jobs = make(project).jobs
    assert (jobs["preprocess"], jobs["fit"], jobs["describe"]) == (1, 1, 1)
    after = times_of(project)
    kinds = ("signals/{}.npz", "matrices/{}.npz", "checks/{}.json", "fits/{}.json")
    written = {name for name in before if after[name] != before[name]}
    assert written == {kind.format(changed) for kind in kinds}


def test_a_bad_recording_costs_the_others_of_its_batch_nothing(alone, new, tmp_path):
    project = in_batches_of(100, new, tmp_path / "project")
    (project.raw / "3mm/bad.csv").write_bytes(b"")
    assert "rejected: raw/3mm/bad: the file is empty" in make(project).output
    ours, theirs = results_of_all(project), results_of_all(alone)
    assert ours == theirs
    assert_same_recordings(project, alone, RECORDINGS)
    rejected = Results.of_table(project.results, project.results / "recordings.csv")
    assert np.isnan(rejected.matrix("3mm/bad")).all()
    assert rejected.fits(["3mm/bad"])["3mm/bad"]["parameters"] is None


def test_a_run_says_that_the_archive_has_passed_a_limit(new, tmp_path):
    project = new.copy(tmp_path / "project")
    path = project.folder / "workflow/scripts/capsule/store/batches.py"
    text = path.read_text(encoding="utf-8")
    assert LIMITS in text
    path.write_text(text.replace(LIMITS, "_EACH_ALONE, _IN_TENS = 8, 5000"), encoding="utf-8")
    assert "instead of" not in make(project).output
    write_archive(project.raw, ["3mm/r05"], samples=400)
    run = make(project)
    told = "9 recordings: each job now takes up to 16 instead of 1, so everything is made once"
    assert run.output.count(told) == 1
    assert run.jobs["preprocess"] == 2
    # Three files of each recording, and the fits of the nodules.
    told = "28 files are of recordings or batches that are gone, and are not used, such as results/"
    assert run.output.count(told) == 1
    assert "instead of" not in project.snakemake("--forcerun", "detect", "--", *TABLES).output


def test_results_of_a_recording_that_is_gone_are_named(in_threes, alone, tmp_path):
    one_by_one, project = alone.copy(tmp_path / "one"), in_threes.copy(tmp_path / "threes")
    for each in (one_by_one, project):
        (each.raw / "3mm/r02.csv").unlink()
    assert "4 files are of recordings or batches that are gone" in make(one_by_one).output
    run = make(project)
    assert results_of_all(project) == results_of_all(one_by_one)
    divided, now = batches(RECORDINGS, 3), batches(sorted(set(RECORDINGS) - {"3mm/r02"}), 3)
    gone = divided.keys() - now.keys()
    told = re.search(r"(\d+) files are of recordings or batches that are gone", run.output)
    assert int(told[1] if told else 0) == 4 * len(gone)


@needs_process_groups
def test_a_killed_batch_is_made_again(alone, new, tmp_path):
    project = in_batches_of(100, new, tmp_path / "project")
    with project.start(*TABLES) as process:
        assert any(re.match(r"\d+ of \d+: fit ", line) for line in process.stdout)
        os.killpg(process.pid, signal.SIGKILL)
    run = make(project)
    assert run.jobs["fit"] == 1
    assert results_of_all(project) == results_of_all(alone)
    assert_same_recordings(project, alone, RECORDINGS)


def test_on_request_a_rejected_recording_stops_before_any_fit_of_a_batch(new, tmp_path):
    project = in_batches_of(3, new, tmp_path / "project")
    project.configure(on_rejected="fail")
    (project.raw / "3mm/bad.csv").write_bytes(b"")
    # With two cores, a fit may start beside the last check.
    run = project.snakemake(*TABLES, cores=1)
    assert run.status != 0
    assert run.jobs["preprocess"] and not run.jobs["fit"]
    assert "3mm/bad: the file is empty" in run.output
    (project.raw / "3mm/bad.csv").unlink()
    make(project)
    assert project.snakemake(*TABLES).did_nothing
