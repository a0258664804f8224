"""Jobs of sets of recordings give the same results as jobs of one, and make only what changed."""

import os
import signal

import pytest

from capsule.recording import format_recording
from support.marks import needs_process_groups
from support.project import Project
from support.synthetic import make_recording

pytestmark = [
    pytest.mark.workflow,
    needs_process_groups,
]

RECORDINGS = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in range(1, 5)]
TARGET = "results/templates.npz"


@pytest.fixture(scope="module")
def new(tmp_path_factory):
    folder = tmp_path_factory.mktemp("new") / "project"
    return Project.create(folder, RECORDINGS, samples=400, particles=10, iterations=10)


def in_sets_of(most, original, folder):
    """Return a copy of a project with another number of recordings per job."""
    project = original.copy(folder)
    project.configure(recordings_per_job=most)
    return project


def make(project, *arguments, cores=2):
    """Make the templates, and return the content of all results."""
    run = project.snakemake(TARGET, *arguments, cores=cores)
    assert run.status == 0, run.output
    return project.result_bytes()


@pytest.fixture(scope="module")
def finished(new, tmp_path_factory):
    """Return a project after a run with a job for each recording."""
    project = new.copy(tmp_path_factory.mktemp("finished") / "project")
    make(project)
    assert not (project.results / "sets").exists()
    return project


def records_of(project):
    """Return the records of single recordings."""
    folders = (project.results / "records" / kind for kind in ("signals", "fits"))
    return {path.name: path.read_bytes() for folder in folders for path in folder.rglob("*.json")}


def times_of(project):
    """Return when each result of a recording was written."""
    kinds = ("signals", "matrices", "checks", "fits")
    paths = [path for kind in kinds for path in project.results.glob(f"{kind}/*/*")]
    return {path.relative_to(project.results).as_posix(): path.stat().st_mtime_ns for path in paths}


def test_sets_give_the_same_bytes_and_another_size_makes_nothing_again(finished, new, tmp_path):
    project = in_sets_of(3, new, tmp_path / "project")
    assert make(project, cores=1) == finished.result_bytes()
    assert records_of(project) == records_of(finished)
    assert project.snakemake(TARGET).did_nothing
    times = times_of(project)
    for most in (100, 1):
        project.configure(recordings_per_job=most)
        assert project.snakemake(TARGET).did_nothing
    assert times_of(project) == times
    assert not (project.results / "sets").exists()


def test_a_job_makes_only_the_recordings_that_have_changed(finished, new, tmp_path):
    project = in_sets_of(3, finished, tmp_path / "project")
    fresh = in_sets_of(100, new, tmp_path / "fresh")
    before = times_of(project)
    edited = format_recording(make_recording(3.0, "3mm/edited", samples=400))
    for raw in (project.raw, fresh.raw):
        (raw / "3mm/r02.csv").write_bytes(edited)
        (raw / "3mm/r05.csv").write_bytes(b"")
    (project.results / "fits/3mm/r03.json").unlink()
    (project.results / "matrices/3mm/r04.npy").write_bytes(b"damaged")
    planned = project.snakemake("-n", TARGET).output.splitlines()
    assert {line for line in planned if line.startswith(("- preprocess", "- fit"))} == {
        "- preprocess_set 3mm/r02, because raw/3mm/r02.csv has changed",
        "- preprocess_set 3mm/r04, because results/matrices/3mm/r04.npy has changed",
        "- preprocess_set 3mm/r05, because its results are missing",
        "- fit_set 3mm/r02, because results/matrices/3mm/r02.npy changes",
        "- fit_set 3mm/r03, because its results are missing",
        "- fit_set 3mm/r04, because results/matrices/3mm/r04.npy has changed",
        "- fit_set 3mm/r05, because its results are missing",
    }
    assert make(project) == make(fresh)
    rejected = [row["recording"] for row in project.table("recordings.csv") if row["reason"]]
    assert rejected == ["3mm/r05"]
    after = times_of(project)
    changed = {name for name in before if after[name] != before[name]}
    kinds = ("signals/3mm/{}.npy", "matrices/3mm/{}.npy", "checks/3mm/{}.json", "fits/3mm/{}.json")
    expected = {kind.format(run) for kind in kinds for run in ("r02", "r04")}
    assert changed == expected | {"fits/3mm/r03.json"}
    project.configure(recordings_per_job=1)
    assert project.snakemake(TARGET).did_nothing


def test_an_edit_together_with_another_size_of_the_sets_reaches_all_results(
    finished, new, tmp_path
):
    project = in_sets_of(3, finished, tmp_path / "project")
    (project.raw / "3mm/r02.csv").write_bytes(b"")
    run = project.snakemake("-n", TARGET)
    assert run.jobs == {"preprocess_set": 1, "fit_set": 1, "index": 1, "average": 1}


def test_a_killed_set_goes_on_where_it_was(finished, new, tmp_path):
    project = in_sets_of(100, new, tmp_path / "project")
    with project.start(TARGET) as process:
        done = []
        while not done and process.poll() is None:
            done = list(project.results.glob("records/signals/*/*.npy.json"))
        os.killpg(process.pid, signal.SIGKILL)
    assert done
    before = {path: path.stat().st_mtime_ns for path in done}
    assert make(project) == finished.result_bytes()
    assert {path: path.stat().st_mtime_ns for path in done} == before


def test_all_recordings_are_made_again_if_asked_for(finished, tmp_path):
    project = in_sets_of(3, finished, tmp_path / "project")
    before = times_of(project)
    planned = project.snakemake("-n", "-F", TARGET).output
    assert "- fit_set 3mm/r01, because it was asked for" in planned
    assert project.snakemake(TARGET).did_nothing
    assert make(project, "-F") == finished.result_bytes()
    after = times_of(project)
    assert [name for name in before if after[name] == before[name]] == []


def test_on_request_a_rejected_recording_stops_before_any_fit_of_a_set(new, tmp_path):
    project = in_sets_of(100, new, tmp_path / "project")
    project.configure(on_rejected="fail")
    (project.raw / "3mm/bad.csv").write_bytes(b"")
    run = project.snakemake(TARGET)
    assert run.status != 0
    assert run.jobs["preprocess_set"] and not run.jobs["fit_set"]
    assert "3mm/bad: the file is empty" in run.output
    (project.raw / "3mm/bad.csv").unlink()
    make(project)
    assert project.snakemake(TARGET).did_nothing
